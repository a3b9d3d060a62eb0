"""Data of a line in SI units, from which a topology makes its wires and links."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from catenary.meshgen.line import (
    Clamps,
    Curve,
    DropperKind,
    Droppers,
    Spans,
    SteadyArm,
    SteadyArms,
    Supports,
)
from catenary.meshgen.wires import SAME_PLACE, Conductor, Role, Section

# Two cuts of a wire closer than this are taken for a slip of the pen [m]: a millimetre, less the
# round-off of places up to 1000 km along the track.
SHORTEST_GAP = 1e-3 - 2e-10


class Course(NamedTuple):
    """Values at places along the line, ascending, straight in between [m]."""

    x: tuple[float, ...]
    value: tuple[float, ...]

    def at(self, x: np.ndarray) -> np.ndarray:
        """Values at places ``x``, shape as ``x`` [m]."""
        return np.asarray(np.interp(x, self.x, self.value))


@dataclass(frozen=True)
class FreeWire:
    """A wire of a free line.

    Attributes
    ----------
    conductor, name, role : as of a ``Wire``
    stretches : (from, to) of its pieces, ascending [m]
    heights : heights above the rail at its supports and ends; None if it is straight between clamps
    lateral : lateral positions; None for those of the wire that it is clamped to
    drawn : whether ``heights`` are its whole course, to which no sag is added
    clamped_to : names of the wires that its pieces are clamped to at their start and at their end,
        "" for a held end
    tensioned : whether held ends have a tensioner; None as at the ends of the line
    clamp_mass, clamp_stiffness : of each of its clamps [kg], [N/m]
    clamps : name of the group of these clamps; empty for its own name with ``_clamps``
    sections : in which it runs, if it is hung; empty for those of the line
    """

    conductor: Conductor
    name: str
    role: Role
    stretches: tuple[tuple[float, float], ...]
    heights: Course | None
    lateral: Course | None
    drawn: bool = False
    clamped_to: tuple[str, str] = ("", "")
    tensioned: tuple[bool | None, bool | None] = (None, None)
    clamp_mass: float = 0.0
    clamp_stiffness: float = 1e7
    clamps: str = ""
    sections: tuple[Section, ...] = ()

    def passes(self, x: np.ndarray, close: float = SAME_PLACE) -> np.ndarray:
        """Whether it has a piece at places ``x``, or as ``close``, bool, shape as ``x`` [m]."""
        starts, ends = np.array(self.stretches).T
        which = np.clip(np.searchsorted(starts, x + close, side="right") - 1, 0, None)
        return np.asarray((starts[which] - close <= x) & (x <= ends[which] + close))

    @property
    def bearers(self) -> tuple[str, ...]:
        """Names of the wires that it is clamped to, each once."""
        return tuple(dict.fromkeys(name for name in self.clamped_to if name))


@dataclass(frozen=True)
class FreeDroppers(Droppers):
    """Droppers and how far each lets its lower wire hang below that one's heights [m]."""

    pre_sag: tuple[float, ...]


FreeLink = FreeDroppers | Clamps | SteadyArms | Supports


@dataclass(frozen=True)
class ClampedWire:
    """A short wire clamped to another one on both sides of each inner support.

    ``length`` from clamp to clamp [m]; of each clamp ``clamp_mass`` [kg], half of it on either
    wire, and ``clamp_stiffness`` [N/m]. A stitch wire is clamped to the messenger wire and carries
    the droppers beside the support, a bridle to the contact wire.
    """

    conductor: Conductor
    length: float
    clamp_mass: float
    clamp_stiffness: float


@dataclass(frozen=True)
class AuxiliaryWire:
    """A wire between messenger and contact wire, hung from the one and carrying the other.

    ``height`` above the contact wire at the supports [m]; ``dropper`` and ``dropper_positions``
    are those by which it hangs, per span, distances from the left support, ascending [m].
    """

    conductor: Conductor
    height: float
    dropper: DropperKind
    dropper_positions: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Twin:
    """Two wires side by side in place of one: ``spacing`` between them [m], and whether droppers
    hang them by turns (``alternating``) or both at each place."""

    spacing: float
    alternating: bool


@dataclass(frozen=True)
class Overlaps:
    """Spans in which one tension section ends and the next one begins.

    Attributes
    ----------
    first : number of the first span of each overlap, from 0, ascending
    n_spans : number of spans of each overlap; overlaps do not overlap each other
    rise : height that contact wires gain from the middle of an overlap to the end of their section
        [m]
    distance : lateral distance of the wires of the two sections [m]
    """

    first: tuple[int, ...]
    n_spans: int
    rise: float
    distance: float


@dataclass(frozen=True)
class LineData(Spans):
    """Data of a line, as a scene has them.

    Attributes
    ----------
    dropper_positions : per span, distances from the span's left support, ascending [m]
    pre_sag : per span and dropper, distance of the contact wire below ``contact_height`` [m]
    stagger : (n_spans + 1,) lateral position of the contact wire at each support [m]
    contact_height : height of the contact wire at the supports of the running spans [m]
    encumbrance : height of the messenger wire above ``contact_height`` at the supports [m]
    contact_wire, messenger_wire : conductors, None of a free line or if there is none
    dropper : kind of the contact wire's droppers
    support_stiffness : vertical stiffness of the topmost wire's support at a mast [N/m]
    steady_arm : the arms at the inner supports
    transition_rise : height gained by the contact wire over all transition spans of one end [m]
    topology : name of the topology that makes the line
    auxiliary_wire, stitch_wire, twin, bridle : parts of which some topologies make wires
    messenger_stagger : lateral position of the messenger wire at each support, as ``stagger``; None
        if it stays above the middle of the track
    curve : of the track, None if it is straight
    overlaps : where the next tension section begins, None if there is only one
    wires, links : of a free line; of others None, until the topology has listed them
    twins : pairs of like wires side by side: the second one of each, and the first one
    """

    dropper_positions: tuple[tuple[float, ...], ...]
    pre_sag: tuple[tuple[float, ...], ...]
    stagger: tuple[float, ...]
    contact_height: float
    encumbrance: float
    contact_wire: Conductor | None
    messenger_wire: Conductor | None
    dropper: DropperKind | None
    support_stiffness: float
    steady_arm: SteadyArm
    transition_rise: float
    topology: str = "simple"
    auxiliary_wire: AuxiliaryWire | None = None
    stitch_wire: ClampedWire | None = None
    twin: Twin | None = None
    bridle: ClampedWire | None = None
    overlaps: Overlaps | None = None
    messenger_stagger: tuple[float, ...] | None = None
    curve: Curve | None = None
    wires: tuple[FreeWire, ...] | None = None
    links: tuple[FreeLink, ...] | None = None
    twins: tuple[tuple[str, str], ...] = ()

    @cached_property
    def dropper_x(self) -> np.ndarray:
        """Places of all droppers of the contact wire along the line, ascending [m]."""
        return self.along(self.dropper_positions)

    def along(self, positions: tuple[tuple[float, ...], ...]) -> np.ndarray:
        """Places along the line of distances from the left support, per span [m]."""
        starts = np.repeat(self.support_positions[:-1], [len(places) for places in positions])
        within = [place for places in positions for place in places]
        return np.asarray(starts + np.array(within, dtype=float))

    def around_supports(self, length: float) -> np.ndarray:
        """Ends of stretches of ``length`` [m] about inner supports, shape (n_spans - 1, 2) [m]."""
        half = 0.5 * length
        return np.add.outer(self.support_positions[1:-1], (-half, half))

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Tension sections. Wires rise to their ends over transition spans, and in an overlap from
        its middle on."""
        masts, (first, last) = self.support_positions.tolist(), self.running_range
        begins, ends, middles, rises = [masts[0]], [], [first], [self.transition_rise]
        for begin in () if self.overlaps is None else self.overlaps.first:
            assert self.overlaps is not None
            begins.append(masts[begin])
            ends.append(masts[begin + self.overlaps.n_spans])
            middles.append(0.5 * (begins[-1] + ends[-1]))
            rises.append(self.overlaps.rise)
        stretches = zip(begins, [*ends, masts[-1]], strict=True)
        level = pairwise([*middles, last])
        return tuple(map(Section, stretches, level, pairwise([*rises, self.transition_rise])))

    @property
    def contact_heights(self) -> tuple[float, float]:
        """Heights at which contact wires are to hang at their lowest and at their highest [m]."""
        contact = [wire for wire in self.wires or () if wire.role is Role.CONTACT]
        names = [wire.name for wire in contact]
        hanging = [link for link in self.links or () if isinstance(link, FreeDroppers)]
        sags = [max(link.pre_sag, default=0.0) for link in hanging if link.lower in names]
        heights = [z for wire in contact if wire.heights is not None for z in wire.heights.value]
        return min(heights) - max(sags, default=0.0), max(heights)

    def contact_sideways(self, x: np.ndarray) -> list[np.ndarray]:
        """Lateral positions of each contact wire at places ``x``, shape as ``x`` [m].

        Zero where another tension section carries the strips.
        """
        found = []
        for wire in self.wires or ():
            if wire.role is Role.CONTACT and wire.lateral is not None:
                level = [own.running for own in wire.sections] or [(-np.inf, np.inf)]
                here = np.any([(low <= x) & (x <= high) for low, high in level], axis=0)
                found.append(np.where(here, wire.lateral.at(x), 0.0))
        return found
