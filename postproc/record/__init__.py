"""Writing of result files."""
