"""From posed people in a room to the images of a camera: ray casting, light, noise of depth and colour."""
