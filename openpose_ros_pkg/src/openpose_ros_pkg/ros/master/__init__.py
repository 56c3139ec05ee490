"""The ROS master: calls that end in time."""
