"""People and what they do, live in any browser."""
