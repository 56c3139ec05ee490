"""The ROS master: calls that end in time, and the end of a node whose master is another one."""
