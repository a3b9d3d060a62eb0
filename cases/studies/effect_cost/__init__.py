"""Cost of each effect of a scene, and the change of results by it."""
