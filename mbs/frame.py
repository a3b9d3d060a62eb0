"""The name of the frame at rest, which scenes and mechanisms share."""

from __future__ import annotations

# Name of the frame at rest, to which bodies can be joined as well.
SPACE = "space"
