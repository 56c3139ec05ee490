"""Markers and the console report."""
