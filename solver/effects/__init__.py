"""Effects that a scene may simulate, each with its additions to the model."""
