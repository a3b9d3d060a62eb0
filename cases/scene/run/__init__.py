"""The run, one subject a file: its keys and their conversion to SI units."""
