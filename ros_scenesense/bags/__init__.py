"""Bags: sessions of the graph as rosbag2 recordings; written, described, repaired and played."""
