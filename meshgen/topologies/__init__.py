"""Topologies: which wires, droppers and hardware a line has; all are lists of wires and links."""
