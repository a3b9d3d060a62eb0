"""Views of a march for observers: channels, rows of values, motion, energy, checkpoints."""
