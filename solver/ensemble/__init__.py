"""Marches of several scenes that share a line, side by side in the lanes of vectors."""
