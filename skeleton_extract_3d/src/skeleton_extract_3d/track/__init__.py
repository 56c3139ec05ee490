"""Over time: identity, filter, joints without a keypoint."""
