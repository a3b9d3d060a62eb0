"""Derivatives of a march by its parameters."""
