"""Verbs that run many simulations, or study the line itself."""
