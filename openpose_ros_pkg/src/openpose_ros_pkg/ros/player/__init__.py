"""What stands in for a camera: files that are played, by a thread that ends the node with them."""
