"""People as REP-155 (ROS4HRI) has them."""
