"""Sentences on a run: its pantographs, incidents, ends of the line, waves that come back."""
