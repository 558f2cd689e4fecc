"""What several tests share: processes, private ROS graphs, ports."""
