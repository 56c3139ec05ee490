"""RGB-D folders: image files, stamps, calibration."""
