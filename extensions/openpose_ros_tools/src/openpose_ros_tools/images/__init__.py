"""Folders of images: layouts, files, calibrations, stamps."""
