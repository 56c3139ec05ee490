"""Keypoints of a recording as plots."""
