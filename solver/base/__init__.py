"""Foundations without imports from other parts: compiled loops and the folder that keeps them."""
