"""Reading and judging of result files."""
