"""Sensitivities of a case: what its statistics change by with each of its parameters."""
