"""The rclpy nodes, one per file: each gives a stage its topics, services and parameters."""
