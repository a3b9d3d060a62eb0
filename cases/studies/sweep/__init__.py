"""Variants of a case, run one after the other or several at the same time."""
