"""People as motion: at a constant rate for motion capture files, as skeletons, as joint angles."""
