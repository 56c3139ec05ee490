"""Files that OpenPose users expect: JSON and keypoint files, annotated images and videos."""
