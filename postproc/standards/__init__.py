"""The limits of EN 50367, edition by edition."""
