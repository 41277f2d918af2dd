"""Reasoning: answer-set programs solved by clingo, and what the answers mean. No ROS."""
