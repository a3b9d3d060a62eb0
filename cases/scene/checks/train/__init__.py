"""What a train must hold beyond the range of each key."""
