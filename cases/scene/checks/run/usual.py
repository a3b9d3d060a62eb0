"""Whether numbers of a scene were probably written in another unit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.input.origin import Origin
from catenary.cases.scene.keys.usual_ranges import USUAL, unit_guess
from catenary.cases.scene.scene import Scene
from catenary.cases.scene.tables.units import unit_of

_MEANT = ", or case.accept_unusual = true if it is meant"


def usual_faults(scene: Scene) -> Iterator[Fault]:
    """A fault for every number that was probably written in another unit.

    None in a scene that says with ``case.accept_unusual`` that its numbers are meant.
    """
    if scene.case.accept_unusual:
        return
    plain = scene.model_dump(exclude_none=True)
    for pattern in USUAL:
        yield from _faults(plain, pattern.split("."), "", scene.origin)


def _faults(value: Any, parts: list[str], key: str, origin: Origin) -> Iterator[Fault]:
    if parts and isinstance(value, list):
        for i, entry in enumerate(value):
            yield from _faults(entry, parts, f"{key}.{i}", origin)
        return
    if parts:
        inner = value if isinstance(value, dict) else {}
        for name in inner if parts[0] == "*" else [parts[0]] if parts[0] in inner else []:
            below = f"{key}.{name}" if key else name
            yield from _faults(inner[name], parts[1:], below, origin)
        return
    for number in value if isinstance(value, list) else [value]:
        guess = unit_guess(key, number)
        if guess:
            unit = unit_of(key)
            yield Fault(key, f"{key} is {number:.12g} {unit} {origin.of(key)}; {guess}{_MEANT}")
            return
