"""What happens in a sequence: scenarios by hand and random ones."""
