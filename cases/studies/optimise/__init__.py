"""Optimisation of a scene: variables, objective and constraints over a set of scenes."""
