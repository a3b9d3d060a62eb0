"""Matrices in blocks of stations: unknowns in vector lanes, like stations stored once."""
