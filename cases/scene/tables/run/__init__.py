"""Keys of the run: contact, numerics, incidents, output, evaluation."""
