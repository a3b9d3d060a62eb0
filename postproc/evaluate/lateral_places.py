"""Lateral places of contact wires on the strips of pantographs, beside the strips' length."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from catenary.postproc.read.results import Results


@dataclass(frozen=True)
class LateralRange:
    """One pantograph over every step of a run with lateral motion.

    Attributes
    ----------
    name : "leading", "trailing", ...
    place : farthest place of a contact wire from the middle of a strip, to the left [m]
    time, x : when that was [s], and where along the track [m]
    half_length : of the strips [m], NaN if it is not known
    left_time, left_x : when and where a wire first was beyond the end of a strip, NaN if it never
        was
    """

    name: str
    place: float
    time: float
    x: float
    half_length: float
    left_time: float = math.nan
    left_x: float = math.nan

    @property
    def left(self) -> bool:
        """Whether a wire has left a strip."""
        return not math.isnan(self.left_time)


def lateral_ranges(results: Results) -> list[LateralRange]:
    """Ranges of all pantographs, none without lateral motion. Not collective."""
    if not results.has("lateral_place") or not results.n_rows("time"):
        return []
    half_lengths = results.facts_of("strip_half_length")
    found = []
    columns = [list(own.values()) for own in results.contact_columns()]
    for p, (name, own) in enumerate(zip(results.pantograph_names(), columns, strict=True)):
        farthest, at, left = 0.0, 0, -1
        half = float(half_lengths[p])
        for part, places in results.blocks("lateral_place"):
            mine = np.where(np.isfinite(places[:, own]), places[:, own], 0.0)
            worst = mine[np.arange(len(mine)), np.abs(mine).argmax(axis=1)]
            row = int(np.abs(worst).argmax())
            if abs(worst[row]) > abs(farthest) or part.start == 0:
                farthest, at = float(worst[row]), part.start + row
            beyond = np.flatnonzero(np.abs(worst) > half)
            if left < 0 and beyond.size:
                left = part.start + int(beyond[0])
        position = results.column("contact_position", p)
        when = results.time_at(at), float(position[at])
        gone = (results.time_at(left), float(position[left])) if left >= 0 else (math.nan, math.nan)
        found.append(LateralRange(name, farthest, *when, half, *gone))
    return found


def sentence(p: LateralRange) -> str:
    """Sentence on a wire that left a strip, with time and place."""
    who = "the pantograph" if p.name == "pantograph" else f"the {p.name} pantograph"
    return (
        f"At {p.left_time:.4g} s, {p.left_x:.4g} m, a contact wire leaves the strips of {who}, "
        f"which end {p.half_length:.3g} m beside their middle: it gets {abs(p.place):.3g} m away "
        "from that. What follows assumes that it stays on them."
    )


def as_table(ranges: list[LateralRange]) -> list[dict[str, Any]]:
    """Plain values for the summary."""
    return [
        {
            "name": p.name,
            "max_place_mm": 1e3 * p.place,
            "time_s": p.time,
            "at_m": p.x,
            "strip_half_length_mm": 1e3 * p.half_length,
            "left_strip_s": p.left_time,
            "left_strip_at_m": p.left_x,
        }
        for p in ranges
    ]
