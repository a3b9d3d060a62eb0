"""The name of the frame at rest, which scenes and mechanisms share."""

from __future__ import annotations

# What bodies can be joined to besides each other: the frame at rest.
SPACE = "space"
