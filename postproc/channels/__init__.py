"""What is recorded of a run: facts, choice of the line's channels, and the head of the result file."""
