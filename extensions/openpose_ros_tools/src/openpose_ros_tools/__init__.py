"""Work on recordings: a ROS-free core, and what reads and writes bags in ``ros/``."""
