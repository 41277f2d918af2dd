"""The stages: one class per node of the graph, messages in, messages out, no ROS."""
