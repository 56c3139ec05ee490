"""Hands and faces of people whose bodies are known: where they are in the image, and their points."""
