"""Time integration of rigid bodies with constraints."""
