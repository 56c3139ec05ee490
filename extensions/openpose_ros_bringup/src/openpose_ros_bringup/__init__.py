"""What starts the chain: cameras' drivers, the view, and checks of what runs."""
