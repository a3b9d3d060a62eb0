"""Waves of a line: what excites them, which travel and how fast, what obstacles send back."""
