"""Tolerances of an installation: how far a line may be off for criteria to hold."""
