"""From the outputs of networks to people in pixels of the input."""
