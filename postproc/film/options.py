"""Choices for a film, which are options of its verb, and views in films and ParaView."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from catenary.base.options import Bounds

Motion = Annotated[float | None, Bounds(1, 1e5)]


class View(StrEnum):
    """From the right side, from the right and above, from above, or from behind the train."""

    SIDE = "side"
    OBLIQUE = "oblique"
    PLAN = "plan"
    ALONG = "along"


@dataclass(frozen=True)
class FilmOptions:
    """Choices for a film; None leaves one to the run.

    Parameters
    ----------
    start : Simulated time to begin at [s].
    end : Simulated time to end at [s].
    rate : Frames per second.
    every : Travel of the train between two frames; a hundredth of their width if absent.
    width : Line in the picture; some two spans if absent.
    motion : Factor by which displacements are enlarged.
    view : From the side, from the side and above, from above, or from behind the train; oblique if
        absent where wires lie beside each other, side otherwise.
    camera : Pantograph that the camera follows: its name, or its number from the front; the middle
        of all if absent.
    """

    start: Annotated[float | None, "--from", Bounds(0, 1e7)] = None
    end: Annotated[float | None, "--to", Bounds(0, 1e7)] = None
    rate: Annotated[float, "--fps", Bounds(1, 120)] = 25.0
    every: Annotated[float | None, "--every-m", Bounds(1e-3, 1e4)] = None
    width: Annotated[float | None, "--width-m", Bounds(5, 2000)] = None
    motion: Motion = None
    view: View | None = None
    camera: str | None = None
