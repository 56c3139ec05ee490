"""Recorded keypoints: out of and into bags, tables, plots."""
