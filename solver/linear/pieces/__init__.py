"""Pieces of a long line: those that a window needs have matrices, factors and unit responses."""
