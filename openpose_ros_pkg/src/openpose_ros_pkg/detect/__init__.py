"""What networks see of an image, and how their opinions become people; tracking people from frame to frame."""
