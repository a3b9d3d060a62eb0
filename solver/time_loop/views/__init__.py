"""What observers are shown of a march: channels, rows of values, motion, energy, checkpoints."""
