"""The facts that the doctor's checks look at, from a running ROS system."""
