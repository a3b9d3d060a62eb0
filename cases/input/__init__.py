"""Reading and judging scenes: what a file from anybody may hold, and what is said of it."""
