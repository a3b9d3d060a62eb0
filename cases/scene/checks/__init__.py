"""Checks that the tables of a scene fit together."""
