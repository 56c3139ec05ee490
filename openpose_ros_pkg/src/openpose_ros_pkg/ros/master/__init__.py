"""The ROS master: calls that end in time, and a node's registrations with it."""
