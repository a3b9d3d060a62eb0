"""Writing results: what of a run is recorded, how its files are laid out and kept whole."""
