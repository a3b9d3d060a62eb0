"""Unknowns of a line, their stations and their numbers."""
