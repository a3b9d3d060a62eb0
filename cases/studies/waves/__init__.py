"""Waves that a train sends along a line: seen in a run, and beside them what theory says."""
