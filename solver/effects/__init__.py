"""What a scene may simulate, each effect with what it adds to the model."""
