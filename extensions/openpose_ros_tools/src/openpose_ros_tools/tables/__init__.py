"""Keypoints as tables: CSV columns, selection, whole recordings."""
