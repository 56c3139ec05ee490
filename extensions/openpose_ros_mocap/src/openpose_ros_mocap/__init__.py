"""Comparison of people with motion capture: a ROS-free core, and what reads bags in ``ros/``."""
