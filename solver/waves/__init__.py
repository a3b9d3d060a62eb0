"""Waves of a line that repeats itself: which of them travel, and how fast."""
