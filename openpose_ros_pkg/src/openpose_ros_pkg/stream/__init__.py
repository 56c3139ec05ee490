"""Streams of images: newest wins, pairing by stamp, the loop of frames, timing."""
