"""Lift people's body joints from the image into space: a ROS-free core, and thin ROS nodes around it in ``ros/``."""
