"""The line at rest: its shape, its elasticity, and both after an incident."""
