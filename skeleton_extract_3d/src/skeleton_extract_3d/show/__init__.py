"""What people look like to a user: RViz markers and the console report."""
