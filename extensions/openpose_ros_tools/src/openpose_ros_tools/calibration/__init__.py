"""Where cameras stand to one another, from the people that they see alone."""
