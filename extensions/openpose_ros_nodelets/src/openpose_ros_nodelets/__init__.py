"""Nodes of point clouds: the floor in them, and depth images of them."""
