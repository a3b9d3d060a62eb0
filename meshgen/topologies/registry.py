"""The topologies by name. To add one, write a function in a file here and ``register`` it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from catenary.meshgen.line import Line
from catenary.meshgen.topologies.line_data import LineData

Make = Callable[[LineData], Line]


class Topology(NamedTuple):
    """A topology: the function that makes its lines, and parts of ``LineData`` that some have.

    ``parts`` must be given for this topology, ``may`` may be; further ones must not.
    """

    make: Make
    parts: tuple[str, ...]
    may: tuple[str, ...]


# Parts of most topologies: wires hang by droppers from a messenger wire.
HUNG = ("contact_wire", "messenger_wire", "dropper")

_TOPOLOGIES: dict[str, Topology] = {}


def register(
    name: str, parts: tuple[str, ...] = HUNG, may: tuple[str, ...] = ()
) -> Callable[[Make], Make]:
    """Decorator: the function makes lines of the topology ``name``; a second one is an error.

    ``parts`` are names of what it needs of ``LineData``, ``may`` of what it takes if it is there.
    """

    def keep(make: Make) -> Make:
        if name in _TOPOLOGIES:
            raise ValueError(f"topology {name} is registered already")
        _TOPOLOGIES[name] = Topology(make, parts, may)
        return make

    return keep


def unregister(name: str) -> None:
    """Take a topology out of the table again."""
    del _TOPOLOGIES[name]


def registered() -> dict[str, Topology]:
    """The topologies registered so far by name."""
    return dict(_TOPOLOGIES)
