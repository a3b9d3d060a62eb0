"""Sections of a run's report, one subject a file."""
