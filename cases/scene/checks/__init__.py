"""Whether the tables of a scene fit together."""
