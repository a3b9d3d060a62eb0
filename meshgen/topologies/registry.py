"""The topologies by name. To add one, write a function in a file here and ``register`` it."""

from __future__ import annotations

from collections.abc import Callable

from catenary.meshgen.line import Line
from catenary.meshgen.topologies.line_data import LineData

Topology = Callable[[LineData], Line]

_TOPOLOGIES: dict[str, Topology] = {}


def register(name: str) -> Callable[[Topology], Topology]:
    """Decorator: the function makes lines of the topology ``name``; a second one is an error."""

    def keep(make: Topology) -> Topology:
        if name in _TOPOLOGIES:
            raise ValueError(f"topology {name} is registered already")
        _TOPOLOGIES[name] = make
        return make

    return keep


def unregister(name: str) -> None:
    """Take a topology out of the table again."""
    del _TOPOLOGIES[name]


def registered() -> dict[str, Topology]:
    """The topologies registered so far by name."""
    return dict(_TOPOLOGIES)
