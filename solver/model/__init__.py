"""The discrete line: unknowns, elements, matrices, and which rank owns what."""
