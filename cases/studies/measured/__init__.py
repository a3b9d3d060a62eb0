"""Measured passages: what a CSV file holds, described in TOML, and its columns."""
