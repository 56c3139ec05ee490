"""Comparison of people with motion capture."""
