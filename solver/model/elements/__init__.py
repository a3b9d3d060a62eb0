"""Beams under tension: matrices of elements, and functions between nodes."""
