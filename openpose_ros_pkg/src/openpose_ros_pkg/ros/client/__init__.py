"""What clients of the detection service do: call it, and send it the images of a camera."""
