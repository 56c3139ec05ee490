"""What knows ROS: the nodes, and the messages of other packages."""
