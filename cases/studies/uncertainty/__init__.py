"""Uncertainty from a table of runs: quantiles, probabilities of failing, sensitivity indices."""
