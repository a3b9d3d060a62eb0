"""The fields of snapshots: one table of what can be recorded, of which blocks, and from what.

Scene, recorder, files and readers follow from ``FIELDS``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from catenary.meshgen.mesh import DROPPERS
from catenary.postproc.record.snapshots.blocks import Block

_Count = TypeVar("_Count", int, np.ndarray)

# Unknowns of a node that fields are made of: upward and lateral displacement, slopes dw/dx and
# dv/dx, and displacement along the track.
UP, ASIDE, SLOPE, TURN, ALONG = "w", "v", "theta_y", "theta_z", "u"


@dataclass(frozen=True)
class FieldKind:
    """A field of snapshots.

    Attributes
    ----------
    name : of the field in files
    unit : SI unit, "-" if none
    meaning : description with its sign, in words
    components : numbers of a value
    motions : unknowns that it takes at all nodes, each with whether their rate is meant
    of_wires : whether wires alone have it, and not other blocks that move
    of_droppers : whether it belongs to the cells of the droppers
    only_with : unknown without which it takes no motion, "" if it always does
    number : how it is stored, a type of NumPy
    """

    name: str
    unit: str
    meaning: str
    components: int = 1
    motions: tuple[tuple[str, bool], ...] = ()
    of_wires: bool = False
    of_droppers: bool = False
    only_with: str = ""
    number: str = "<f4"

    @property
    def item_bytes(self) -> int:
        """Bytes of a value."""
        return int(self.number[-1]) * self.components

    def motions_of(self, unknowns: Sequence[str]) -> list[tuple[str, bool]]:
        """The ``motions`` that it needs where nodes have these unknowns."""
        if self.only_with and self.only_with not in unknowns:
            return []
        return [motion for motion in self.motions if motion[0] in unknowns]

    def belongs_to(self, block: Block) -> bool:
        """Whether a block has it."""
        if self.of_droppers:
            return block.name == DROPPERS
        return block.is_wire if self.of_wires else block.moves

    def values_of(self, n_points: _Count) -> _Count:
        """Number of values of blocks with so many points."""
        return n_points // 2 if self.of_droppers else n_points


KINDS: dict[str, FieldKind] = {
    kind.name: kind
    for kind in (
        FieldKind("uplift", "m", "displacement upward from rest", motions=((UP, False),)),
        FieldKind(
            "displacement",
            "m",
            "displacement from rest along x, y, z",
            components=3,
            motions=((UP, False), (ASIDE, False), (ALONG, False)),
        ),
        FieldKind(
            "velocity",
            "m/s",
            "velocity along x, y, z",
            components=3,
            motions=((UP, True), (ASIDE, True), (ALONG, True)),
        ),
        FieldKind(
            "tension",
            "N",
            "tension of the wire ahead of the point, with what its stretch adds where wires move "
            "along the track",
            motions=tuple((name, False) for name in (UP, SLOPE, ASIDE, TURN, ALONG)),
            only_with=ALONG,
            of_wires=True,
        ),
        FieldKind(
            "bending_moment",
            "N m",
            "EI d2w/dx2 of the wire as it hangs, mean of both sides of a node; above 0 where it "
            "curves upward",
            motions=((UP, False), (SLOPE, False)),
            of_wires=True,
        ),
        FieldKind("dropper_force", "N", "tension, negative in compression", of_droppers=True),
        FieldKind(
            "dropper_state",
            "-",
            "1 taut, 0 slack or broken, -1 in compression",
            of_droppers=True,
            number="|i1",
        ),
    )
}

# Fields that a scene may choose: the state of droppers comes with their force.
FIELDS = tuple(name for name in KINDS if name != "dropper_state")
USUAL_FIELDS = ("uplift", "displacement")


def kinds_of(chosen: tuple[str, ...]) -> tuple[FieldKind, ...]:
    """The kinds that chosen fields bring, in the order of the table."""
    names = {*chosen, *(("dropper_state",) if "dropper_force" in chosen else ())}
    return tuple(kind for name, kind in KINDS.items() if name in names)
