"""One frame: keypoints and points become joints, seen or hidden."""
