"""Rigid bodies, joints and forces in space, their arrays, and their motion in time steps."""
