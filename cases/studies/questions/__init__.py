"""Everyday questions: highest speed, distance of pantographs, changes, worst places."""
