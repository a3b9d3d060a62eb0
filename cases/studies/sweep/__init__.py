"""Variants of a case, run one after the other."""
