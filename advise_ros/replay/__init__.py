"""Rebuilding a recorded session without a ROS graph, and comparing it with what was published."""
