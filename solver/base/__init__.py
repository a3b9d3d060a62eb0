"""Leaves that every layer may import: errors, ranks, aligned arrays."""
