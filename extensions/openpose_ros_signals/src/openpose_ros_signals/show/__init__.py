"""What people see of signals."""
