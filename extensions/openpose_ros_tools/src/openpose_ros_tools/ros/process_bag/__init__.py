"""process_bag: find the people in recorded bags."""
