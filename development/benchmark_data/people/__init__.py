"""People: bodies, clothes, poses, motion and gestures."""
