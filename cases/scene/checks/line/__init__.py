"""What a line must hold beyond the range of each key."""
