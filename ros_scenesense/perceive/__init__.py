"""One real RGB-D frame through the pipeline, from files, without ROS."""
