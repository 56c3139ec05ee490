"""What knows ROS: the node, its inputs and messages."""
