"""Which unknowns a line has, at which stations, and their numbers."""
