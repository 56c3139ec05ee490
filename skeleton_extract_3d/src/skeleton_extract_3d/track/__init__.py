"""Over time: who is who, filter, joints without a keypoint."""
