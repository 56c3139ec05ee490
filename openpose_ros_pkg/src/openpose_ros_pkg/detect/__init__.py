"""How networks look at an image and how their opinions become people; following people from frame to frame."""
