"""Linearisation, frequency response, and the lumped model fitted to it."""
