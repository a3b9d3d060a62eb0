"""Running variants of a case: what is done, what is left."""
