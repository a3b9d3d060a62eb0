"""Accuracy study: error and time of runs with other steps, meshes, schemes and models."""
