"""Choices for a film, and views of a line in films and ParaView."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class View(StrEnum):
    """From the right side, from the right and above, from above, or from behind the train."""

    SIDE = "side"
    OBLIQUE = "oblique"
    PLAN = "plan"
    ALONG = "along"


@dataclass(frozen=True)
class FilmOptions:
    """Choices for a film; None leaves one to the run.

    Attributes
    ----------
    start, end : from and to in simulated time [s]
    rate : pictures a second
    every : travel of the train between two pictures [m]
    width : length of line in a picture [m]
    motion : factor by which motions are drawn larger
    view : where the line is looked at from
    camera : the pantograph that the camera goes with, by its name or its number from the front;
        None for the middle of all
    """

    start: float | None = None
    end: float | None = None
    rate: float = 25.0
    every: float | None = None
    width: float | None = None
    motion: float | None = None
    view: View | None = None
    camera: str | None = None
