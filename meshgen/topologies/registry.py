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
    """Decorator that registers a function as the maker of lines of the topology ``name``.

    Parameters
    ----------
    name : str
        Name of the topology.
    parts : tuple of str, optional
        Fields of ``LineData`` that it needs.
    may : tuple of str, optional
        Fields that it uses if they are given.

    Raises
    ------
    ValueError
        If there is a topology of that name.
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
