"""Rendered RGB-D sequences of clothed people with exact joints: scenes by hand, and random ones from a seed."""
