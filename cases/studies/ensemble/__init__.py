"""Many scenes of a case of which statistics are kept: those that share a line march together."""
