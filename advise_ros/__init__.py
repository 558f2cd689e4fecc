"""advise_ros: a drone learns a route from rough demonstrations and asks where it is unsure."""

__version__ = '0.1.0'
