"""Find people's body joints in images: a ROS-free core, and thin ROS nodes around it in ``ros/``."""
