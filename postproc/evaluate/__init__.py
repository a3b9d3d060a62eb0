"""Statistics of a run, the limits of the standards, comparison of runs."""
