"""Files that OpenPose users expect: JSON and keypoint files, annotated pictures and videos."""
