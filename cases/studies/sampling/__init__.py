"""Samples of a case with uncertain keys: distributions, correlations, and fields along the line."""
