"""Data of a line in SI units, from which a topology makes its wires and links."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
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
from catenary.meshgen.wires import Conductor, Role, Section

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

    def passes(self, x: float, close: float = 1e-6) -> bool:
        """Whether it has a piece at a place [m]."""
        return any(start - close <= x <= end + close for start, end in self.stretches)

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

    def sections(self, masts: np.ndarray) -> np.ndarray:
        """Start and end of each tension section, (k, 2) [m], of a line with ``masts`` (n,) [m]."""
        first = np.array(self.first, dtype=np.int64)
        starts = np.append(masts[0], masts[first])
        return np.column_stack([starts, np.append(masts[first + self.n_spans], masts[-1])])


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
    contact_wire, messenger_wire : conductors, None for the latter if there is none
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
    wires, links : of a free line, None of others
    """

    dropper_positions: tuple[tuple[float, ...], ...]
    pre_sag: tuple[tuple[float, ...], ...]
    stagger: tuple[float, ...]
    contact_height: float
    encumbrance: float
    contact_wire: Conductor
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

    def whole(self, rise: float) -> Section:
        """The line from anchor to anchor, with a ``rise`` over the transition spans [m]."""
        masts = self.support_positions
        return Section((float(masts[0]), float(masts[-1])), self.running_range, (rise, rise))

    @property
    def lowest_contact(self) -> float:
        """Height at which a contact wire is to hang at its lowest [m]."""
        if self.wires is None or self.links is None:
            return self.contact_height - max(max(sags, default=0.0) for sags in self.pre_sag)
        contact = [wire for wire in self.wires if wire.role is Role.CONTACT]
        names = [wire.name for wire in contact]
        hanging = [link for link in self.links if isinstance(link, FreeDroppers)]
        sags = [max(link.pre_sag) for link in hanging if link.lower in names]
        heights = [min(wire.heights.value) for wire in contact if wire.heights is not None]
        return min(heights) - max(sags, default=0.0)

    def contact_sideways(self, x: np.ndarray) -> list[np.ndarray]:
        """Lateral positions of each contact wire at places ``x``, shape as ``x`` [m].

        Those of a free line; of others the stagger, which wires are near to.
        """
        if self.wires is None:
            return [np.interp(x, self.support_positions, self.stagger)]
        contact = (wire for wire in self.wires if wire.role is Role.CONTACT)
        return [wire.lateral.at(x) for wire in contact if wire.lateral is not None]

    def check(self) -> None:
        """Refuse lists of wrong length and droppers outside their spans.

        Raises
        ------
        InputError
            If lists do not fit the number of spans, a dropper is not inside its span, or droppers
            are not in order.
        """
        if self.n_spans == 0:
            raise InputError("the line has no span: span_lengths must name at least one length")
        for name, n, wanted in (
            ("dropper_positions", len(self.dropper_positions), self.n_spans),
            ("pre_sag", len(self.pre_sag), self.n_spans),
            ("stagger", len(self.stagger), self.n_spans + 1),
        ):
            if n != wanted:
                raise InputError(f"{name} has {n} entries, but {self.n_spans} spans need {wanted}")
        if self.messenger_stagger is not None and len(self.messenger_stagger) != self.n_spans + 1:
            raise InputError(
                f"messenger_stagger has {len(self.messenger_stagger)} entries, but {self.n_spans} "
                f"spans need {self.n_spans + 1}"
            )
        if self.auxiliary_wire is not None:
            above = self.auxiliary_wire.dropper_positions
            for span, (length, places) in enumerate(
                zip(self.span_lengths, above, strict=True), start=1
            ):
                _check_span(span, length, places)
        spans = zip(self.span_lengths, self.dropper_positions, self.pre_sag, strict=True)
        for span, (length, places, lowered) in enumerate(spans, start=1):
            if len(places) != len(lowered):
                raise InputError(
                    f"span {span} has {len(places)} droppers, but pre_sag names {len(lowered)} "
                    "values"
                )
            _check_span(span, length, places)


def _check_span(span: int, length: float, places: tuple[float, ...]) -> None:
    if not length > SHORTEST_GAP:
        raise InputError(f"the length of span {span} is {length:g} m, but must be positive")
    for place in places:
        if not SHORTEST_GAP <= place <= length - SHORTEST_GAP:
            where = (
                "on a mast" if min(abs(place), abs(place - length)) < SHORTEST_GAP else "outside"
            )
            raise InputError(
                f"the dropper at {place:g} m of span {span} lies {where}, but must lie "
                f"between the masts, which stand at 0 and {length:g} m"
            )
    for left, right in zip(places[:-1], places[1:], strict=True):
        if right - left < SHORTEST_GAP:
            raise InputError(
                f"the droppers at {left:.10g} and {right:.10g} m of span {span} are not in "
                f"ascending order at least {SHORTEST_GAP:g} m apart"
            )
