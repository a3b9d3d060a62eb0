"""Loads in time that a step adds: gusts, given forces, what ends of the line remember."""
