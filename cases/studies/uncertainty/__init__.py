"""Uncertainty: samples of a case with uncertain keys; quantiles, failures and indices."""
