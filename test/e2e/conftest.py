"""Whole stories; the fixtures are explained in test/ros/conftest.py."""

from support.fixtures import free_tcp_port, free_udp_port, graph, ros_env, square_file

__all__ = ['free_tcp_port', 'free_udp_port', 'graph', 'ros_env', 'square_file']
