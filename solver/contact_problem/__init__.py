"""The small complementarity problem of a step: contact forces and slack droppers."""
