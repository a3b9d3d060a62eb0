"""How a line goes on beyond an end: half lines of a periodic line, and what they do in steps."""
