"""What is recorded of a run: channels, their choice, and the head of the result file."""
