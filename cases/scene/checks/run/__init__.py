"""What a run must hold beyond the range of each key."""
