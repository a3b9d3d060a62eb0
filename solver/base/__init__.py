"""Leaves that every layer may import: errors, ranks, compiled loops, aligned arrays."""
