"""Reading result files, sound or damaged."""
