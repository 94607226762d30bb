"""What the name of a column, of a rate or of a file says."""
