"""Pictures of a run and of its line, as figures of matplotlib in one style."""
