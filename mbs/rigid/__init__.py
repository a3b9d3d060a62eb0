"""Rigid bodies, joints and forces in space, and their arrays."""
