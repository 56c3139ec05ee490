"""What knows ROS: the node, and the messages of REP-155."""
