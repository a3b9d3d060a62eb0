"""Recorded data of a run: facts, choice of line channels, and the head of the result file."""
