"""Rigid bodies, joints and forces in space, their arrays and kernels."""
