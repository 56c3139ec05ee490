"""People in the messages of other packages."""
