"""Measured passages beside a run: alignment, errors of the measurement, tolerances, files."""
