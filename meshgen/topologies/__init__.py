"""Topologies: which wires, droppers and hardware a line has, one file each."""
