"""Streams of images: newest wins, pairing by stamp, pipeline, timing."""
