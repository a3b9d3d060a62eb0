"""Courses given as pairs of place or time and deviation, which several tables take."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

from pydantic import Field

from catenary.cases.scene.tables.table import ascending

PAIR = Annotated[list[Annotated[float, Field(ge=-1e6, le=1e6)]], Field(min_length=2, max_length=2)]


def within(most: float) -> Callable[[list[list[float]]], list[list[float]]]:
    """The check that pairs have ascending first numbers and deviations up to ``most`` [m]."""

    def check(pairs: list[list[float]]) -> list[list[float]]:
        ascending([pair[0] for pair in pairs], "its first numbers")
        for at, value in pairs:
            if abs(value) > most:
                raise ValueError(f"must stay within {most:g} m, but is {value:g} m at {at:g}")
        return pairs

    return check
