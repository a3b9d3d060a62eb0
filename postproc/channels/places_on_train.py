"""How pantographs are called by their places on the train."""

from __future__ import annotations


def places_on_train(n: int) -> list[str]:
    """Names of ``n`` pantographs by their places, from the first: ``leading``, ``trailing``."""
    if n == 1:
        return ["pantograph"]
    return ["leading", *(f"no. {place}" for place in range(2, n)), "trailing"]


def in_sentence(place: str) -> str:
    """A pantograph by its place on the train: ``the leading pantograph``, ``the pantograph``."""
    if place == "pantograph":
        return "the pantograph"
    return f"pantograph {place}" if place.startswith("no. ") else f"the {place} pantograph"
