"""Where a line is looked at from in films and ParaView."""

from __future__ import annotations

from enum import StrEnum


class View(StrEnum):
    """From the right side, from above, or from behind the train along the track."""

    SIDE = "side"
    PLAN = "plan"
    ALONG = "along"
