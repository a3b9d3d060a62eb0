"""The line as an engineer describes it: masts, track, hardware, wires by name and role.

SI units, no mesh yet. Axes: x along the track from the first anchor, y lateral, z up from the top
of rail. Trains run between two of the masts; the track beneath may have a curve. Droppers, clamps,
steady arms, supports and fittings hang between the wires and stand under them. Which wires a line
has is decided by its topology (``catenary.meshgen.topologies``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from catenary.meshgen.wires import SAME_PLACE, Profile, Role, Wire


def read_only(values: np.ndarray) -> np.ndarray:
    """An array that nothing may write into, as it is shared."""
    values.flags.writeable = False
    return values


def mast_places(span_lengths: Sequence[float]) -> np.ndarray:
    """Places of the masts between spans of some lengths, anchors included, (n_spans + 1,) [m]."""
    return np.concatenate([[0.0], np.cumsum(span_lengths)])


@dataclass(frozen=True)
class Spans:
    """Spans from anchor to anchor.

    Attributes
    ----------
    span_lengths : (n_spans,) [m]
    n_transition : spans at the start and at the end in which contact wires rise to the tensioner
    """

    span_lengths: tuple[float, ...]
    n_transition: tuple[int, int]

    @property
    def n_spans(self) -> int:
        return len(self.span_lengths)

    @cached_property
    def support_positions(self) -> np.ndarray:
        """Positions of all masts, both anchors included, shape (n_spans + 1,) [m]; read-only."""
        return read_only(mast_places(self.span_lengths))

    @property
    def running_range(self) -> tuple[float, float]:
        """Range in which a pantograph may run: from the end of the first transition to the start
        of the last one [m]."""
        masts = self.support_positions
        return float(masts[self.n_transition[0]]), float(masts[self.n_spans - self.n_transition[1]])


@dataclass(frozen=True)
class Curve:
    """A stretch of the line in which the track is a circle, with transitions at both ends.

    Attributes
    ----------
    curvature : 1/R of the circle, > 0 where its centre is to the left, in the sense of y [1/m]
    tilt : of the canted track towards the centre, >= 0 [rad]
    stretch : from and to, transitions included; infinite for the whole line [m]
    transition : length at both ends over which curvature and cant grow linearly [m]
    """

    curvature: float
    tilt: float = 0.0
    stretch: tuple[float, float] = (-np.inf, np.inf)
    transition: float = 0.0

    def share(self, x: np.ndarray) -> np.ndarray:
        """Share of curvature and cant at places ``x`` [m], 0 to 1, shape as ``x``."""
        x = np.asarray(x, dtype=float)
        first, last = self.stretch
        inside = np.minimum(x - first, last - x)
        if self.transition == 0.0:
            return np.where(inside >= 0.0, 1.0, 0.0)
        return np.clip(inside / self.transition, 0.0, 1.0)

    def curvature_at(self, x: np.ndarray) -> np.ndarray:
        """1/R at places ``x`` [m], > 0 to the left, shape as ``x`` [1/m]."""
        return self.curvature * self.share(x)

    def upright_curvature_at(self, x: np.ndarray) -> np.ndarray:
        """Part of 1/R across the canted plane at places ``x`` [m], >= 0 upwards, shape as ``x``
        [1/m]: a straight wire runs inside of the curve, above the inner rail, which is low."""
        share = self.share(x)
        return np.asarray(abs(self.curvature) * share * np.sin(self.tilt * share))

    def upright_part_at(self, x: np.ndarray) -> np.ndarray:
        """Part across the canted plane of a level force to the left at places ``x`` [m], > 0
        upwards, shape as ``x`` [-]."""
        return np.sin(self.roll_at(x))

    def roll_at(self, x: np.ndarray) -> np.ndarray:
        """Cant angle at places ``x`` [m], > 0 where the left rail is low, shape as ``x`` [rad]."""
        return np.asarray(np.sign(self.curvature) * self.tilt * self.share(x))

    def sideways_pull_at(self, x: np.ndarray) -> np.ndarray:
        """Share of a weight that pulls sideways across the canted track at places ``x`` [m], > 0 to
        the left, shape as ``x`` [-]."""
        return np.tan(self.roll_at(x))


@dataclass(frozen=True)
class DropperKind:
    """Data that all droppers of a group share.

    Exactly one of ``stiffness`` [N/m], ``axial_stiffness`` EA [N] and ``curve`` is given; with EA
    the stiffness of each dropper is EA over its length, and the points of a curve, strain [-]
    and tension [N] from (0, 0) on, both ascending, are those of its stretch over that length.
    Clamp masses in kg.
    """

    stiffness: float | None
    axial_stiffness: float | None
    mass_per_length: float
    upper_clamp_mass: float
    lower_clamp_mass: float
    curve: tuple[tuple[float, float], ...] | None = None

    @property
    def n_pieces(self) -> int:
        """Number of slopes of their tension."""
        return 1 if self.curve is None else len(self.curve) - 1

    def slopes_at(self, length: np.ndarray) -> Slopes:
        """Tension over stretch of droppers of these lengths (n,) [m]."""
        if self.curve is not None:
            strain, tension = np.array(self.curve[:-1]).T
            return Slopes(
                length[:, None] * strain,
                np.tile(tension, (length.size, 1)),
                steepness(self.curve) / length[:, None],
            )
        none = np.zeros((length.size, 1))
        if self.stiffness is not None:
            return Slopes(none, none, np.full(none.shape, self.stiffness))
        assert self.axial_stiffness is not None
        return Slopes(none, none, self.axial_stiffness / length[:, None])

    def stiffest_at(self, length: float) -> float:
        """The largest stiffness of a dropper of a length [m] [N/m]."""
        return float(self.slopes_at(np.array([length])).slope.max())


@dataclass(frozen=True)
class Droppers:
    """A group of droppers from one wire down to another.

    Attributes
    ----------
    name : of their group in a mesh file and of their component in the damping
    kind : stiffness, masses and law of each
    upper, lower : names of the wires that they join
    upper_x, lower_x : positions of their ends, in ascending order of ``lower_x`` [m]
    """

    name: str
    kind: DropperKind
    upper: str
    lower: str
    upper_x: tuple[float, ...]
    lower_x: tuple[float, ...]


@dataclass(frozen=True)
class Clamps:
    """Clamps by which one wire hangs from another without a dropper: links that push as well.

    Attributes
    ----------
    name : of their component in the damping
    stiffness, mass : of each; half of the mass at either wire [N/m], [kg]
    upper, lower : names of the wires
    x : their places, ascending [m]
    """

    name: str
    stiffness: float
    mass: float
    upper: str
    lower: str
    x: tuple[float, ...]


# Axial stiffness of a steady arm, far above that of the wire that it holds [N/m].
BAR_STIFFNESS = 1e7


@dataclass(frozen=True)
class SteadyArm:
    """A steady arm hinged at its registration end and clamped to a wire.

    Attributes
    ----------
    length : from hinge to clamp [m]
    mass_per_length : of the arm [kg/m]
    clamp_mass : of the clamp on the wire [kg]
    stiffness : vertical stiffness at the wire [N/m]
    holds_height : whether the arm holds the wire at its height at rest and so carries weight there;
        if not, the wire hangs freely between the droppers next to the arm
    inclination : angle by which it rises from the wire to its hinge at rest, with lateral motion
        [rad]; None if the angle follows from the weight at the arm
    uplift_stop : lift of the wire at which the arm meets a stop [m]; None without a stop
    stop_stiffness : stiffness of the stop [N/m]
    by_radial_force : whether its vertical stiffness is its radial force over its length, in place
        of ``stiffness``
    registration_stiffness : stiffness of the registration arm at the hinge, along the steady arm
        [N/m]; None if it is rigid
    """

    length: float
    mass_per_length: float
    clamp_mass: float
    stiffness: float
    holds_height: bool = False
    inclination: float | None = None
    uplift_stop: float | None = None
    stop_stiffness: float = 1e5
    by_radial_force: bool = False
    registration_stiffness: float | None = None

    @property
    def bar_stiffness(self) -> float:
        """Axial stiffness of the arm and of the registration arm that holds its hinge [N/m]."""
        if self.registration_stiffness is None:
            return BAR_STIFFNESS
        return 1.0 / (1.0 / BAR_STIFFNESS + 1.0 / self.registration_stiffness)


@dataclass(frozen=True)
class SteadyArms:
    """Steady arms of one kind on one wire; ``x`` are their places, ascending [m]."""

    name: str
    kind: SteadyArm
    wire: str
    x: tuple[float, ...]

    def vertical_stiffness(self, wire: Wire) -> np.ndarray:
        """Stiffness (n,) of each at ``wire``, which they hold, if nothing moves sideways [N/m]."""
        if not self.kind.by_radial_force:
            return np.full(len(self.x), self.kind.stiffness)
        return np.abs(wire.radial_force(np.array(self.x))) / self.kind.length


@dataclass(frozen=True)
class Supports:
    """Supports of one kind under one wire: springs relaxed at the height of its course there.

    Attributes
    ----------
    name, wire : their own name, and that of the wire that they carry
    stiffness : vertical stiffness of each support [N/m]
    x : their places, ascending [m]
    holds : name of a wire that has its wanted height there at rest: form finding sets the height of
        each support accordingly; empty if supports are at the height of their wire's course
    """

    name: str
    stiffness: float
    wire: str
    x: tuple[float, ...]
    holds: str = ""


@dataclass(frozen=True)
class Fittings:
    """Fittings of one kind on one wire, such as section insulators: lumped masses.

    Attributes
    ----------
    kind : their name
    wire : its name
    x : their places, ascending [m]
    mass : of each [kg]
    """

    kind: str
    wire: str
    x: tuple[float, ...]
    mass: tuple[float, ...]


class Slopes(NamedTuple):
    """Piecewise linear laws of n springs with m pieces each.

    The first piece also holds below its begin, the last one without end.

    Attributes
    ----------
    begin : (n, m) stretch at which each piece begins [m], 0 for the first piece
    force : (n, m) force at ``begin`` [N], 0 for the first piece
    slope : (n, m) stiffness of each piece [N/m]
    """

    begin: np.ndarray
    force: np.ndarray
    slope: np.ndarray

    def piece_under(self, force: np.ndarray) -> np.ndarray:
        """Number (n,) of the piece on which each spring has ``force`` (n,) [N]; at the end of a
        piece that of the next one."""
        return np.asarray((force[:, None] >= self.force[:, 1:]).sum(axis=1))

    def at(self, piece: np.ndarray) -> Slopes:
        """The piece of number ``piece`` (n,) of each spring; arrays (n,)."""
        each = np.arange(piece.size), piece
        return Slopes(self.begin[each], self.force[each], self.slope[each])

    def stretch_under(self, force: np.ndarray) -> np.ndarray:
        """Stretch (n,) under forces (n,) [N] [m]."""
        on = self.at(self.piece_under(force))
        return np.asarray(on.begin + (force - on.force) / on.slope)

    def force_at(self, stretch: np.ndarray) -> np.ndarray:
        """Forces (n,) at stretches (n,) [m] [N]."""
        on = self.at((stretch[:, None] >= self.begin[:, 1:]).sum(axis=1))
        return np.asarray(on.force + on.slope * (stretch - on.begin))

    def energy_under(self, force: np.ndarray) -> np.ndarray:
        """Energy of springs under forces (n,) [N], [J]."""
        piece = self.piece_under(force)
        mean = 0.5 * (self.force[:, 1:] + self.force[:, :-1])
        work = np.cumsum(mean * np.diff(self.begin, axis=1), axis=1)
        on, below = self.at(piece), np.pad(work, ((0, 0), (1, 0)))[np.arange(piece.size), piece]
        return np.asarray(below + (force**2 - on.force**2) / (2.0 * on.slope))


def steepness(curve: Sequence[tuple[float, float]]) -> np.ndarray:
    """Slopes (m,) between the points (m + 1,) of a curve."""
    rise = np.diff(np.array(curve), axis=0)
    return np.asarray(rise[:, 1] / rise[:, 0])


class DropperPlace(NamedTuple):
    """Lower end of a dropper along the track [m], and which one it is, from 0, of those that twin
    wires, or the wires of two tension sections, have there."""

    x: float
    nth: int = 0


def droppers_at(x: np.ndarray, places: Sequence[DropperPlace]) -> np.ndarray:
    """Numbers of the droppers that stand nearest to places, (n_places,) int.

    ``x`` are the lower ends of all droppers, (n_droppers,) [m], in the order of a mesh.
    """
    found = np.zeros(len(places) if x.size else 0, dtype=np.int64)
    for number, (place, nth) in enumerate(places[: found.size]):
        away = np.abs(x - place)
        there = np.flatnonzero(away <= away.min() + SAME_PLACE)
        found[number] = there[min(nth, there.size - 1)]
    return found


@dataclass(frozen=True)
class Line(Spans):
    """A line: masts, wires, and the groups of what hangs between them and stands under them.

    Attributes
    ----------
    topology : name of what made it
    wires : from the contact wires upwards
    droppers, steady_arms, supports, clamps : groups
    curve : of the track, None if it is straight; lateral positions count from the track's middle
    twins : pairs of like wires side by side: the second one of each, and the first one
    fittings : insulators and the like on wires, which no mesh file has

    Raises ValueError if names occur twice, a group names no wire, or droppers hang a wire without
    wanted heights: a topology that makes such a line is wrong.
    """

    topology: str
    wires: tuple[Wire, ...]
    droppers: tuple[Droppers, ...]
    steady_arms: tuple[SteadyArms, ...]
    supports: tuple[Supports, ...]
    clamps: tuple[Clamps, ...] = ()
    fittings: tuple[Fittings, ...] = ()
    curve: Curve | None = None
    twins: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        wires = {wire.name for wire in self.wires}
        groups = [*self.droppers, *self.hardware, *self.clamps]
        names = [wire.name for wire in self.wires] + [group.name for group in groups]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"topology {self.topology}: two parts have the name {twice[0]}")
        asked = {part.wire for part in self.hardware}
        asked |= {part.holds for part in self.supports if part.holds}
        asked |= {wire for part in self.droppers for wire in (part.upper, part.lower)}
        asked |= {wire for part in self.clamps for wire in (part.upper, part.lower)}
        asked |= {wire for pair in self.twins for wire in pair}
        unknown = sorted(asked - wires)
        if unknown:
            raise ValueError(f"topology {self.topology}: there is no wire {unknown[0]}")
        for part in self.droppers:
            if self.wire(part.lower).profile is None:
                raise ValueError(
                    f"topology {self.topology}: {part.name} hang {part.lower}, which has no profile"
                )

    def wire(self, name: str) -> Wire:
        """The wire of that name; KeyError if there is none."""
        for wire in self.wires:
            if wire.name == name:
                return wire
        raise KeyError(f"the line has no wire {name}")

    @property
    def components(self) -> tuple[str, ...]:
        """Names of all wires and groups, which damping may be given for."""
        parts = (*self.wires, *self.droppers, *self.hardware, *self.clamps)
        return tuple(part.name for part in parts)

    def wires_of(self, role: Role) -> tuple[Wire, ...]:
        """The wires of a role, in the order of ``wires``."""
        return tuple(wire for wire in self.wires if wire.role is role)

    @property
    def hardware(self) -> tuple[SteadyArms | Supports, ...]:
        """Groups at single places of wires: arms, then supports."""
        return (*self.steady_arms, *self.supports)

    @property
    def clamp_group(self) -> np.ndarray:
        """Number of its group for each clamp, group by group."""
        return np.repeat(np.arange(len(self.clamps)), [len(group.x) for group in self.clamps])

    @property
    def profiles(self) -> tuple[Profile, ...]:
        """Heights wanted of the wires that droppers hang, in the order of ``wires``."""
        return tuple(wire.profile for wire in self.wires if wire.profile is not None)

    @cached_property
    def dropper_x(self) -> np.ndarray:
        """Places of the lower ends of all droppers, ascending [m]; read-only."""
        places = np.concatenate([np.zeros(0), *(group.lower_x for group in self.droppers)])
        return read_only(np.sort(places))

    def droppers_of_span(self, span: int) -> np.ndarray:
        """Places of the lower ends of a span's droppers, ascending [m]; spans count from 0."""
        masts, x = self.support_positions, self.dropper_x
        first = np.searchsorted(x, masts[span], side="right")
        return x[first : np.searchsorted(x, masts[span + 1])]

    def dropper_of_span(self, span: int, number: int) -> DropperPlace:
        """Place of a dropper by its number in a span; both count from 1."""
        x = self.droppers_of_span(span - 1)[:number]
        return DropperPlace(float(x[-1]), int((x[-1] - x[:-1] <= SAME_PLACE).sum()))

    @property
    def numbered_droppers(self) -> dict[tuple[int, int], float]:
        """Places of the droppers of all spans [m], by the span and the number in it, from 1."""
        return {
            (span + 1, number): float(x)
            for span in range(self.n_spans)
            for number, x in enumerate(self.droppers_of_span(span), start=1)
        }

    def running_spans(self, wire: Wire) -> list[int]:
        """Spans in which trains run on a wire, from support to support; they count from 0.

        Those in which it rises to an end of its section do not count. Those at an end of the wire,
        which is held otherwise than at a support, count only if there are no others.
        """
        sections = wire.profile.sections if wire.profile is not None else ()
        level = [own.running for own in sections] or [self.running_range]
        there, inner = [], []
        for span, (start, end) in enumerate(pairwise(self.support_positions.tolist())):
            within = [
                piece
                for piece in wire.pieces
                for low, high in level
                if max(low, piece.x[0]) < start + SAME_PLACE
                and end - SAME_PLACE < min(high, piece.x[-1])
            ]
            there += [span] * bool(within)
            inner += [span] * any(
                piece.x[0] < start - SAME_PLACE and end + SAME_PLACE < piece.x[-1]
                for piece in within
            )
        return inner or there

    def with_shares(self, shares: Mapping[str, float]) -> Line:
        """The line with the tensions of some wires multiplied by ``shares`` [-], by name.

        A wire that is clamped to others takes from them its own share of the tension before.
        """
        wires = (
            replace(
                wire,
                tension=shares.get(wire.name, 1.0) * wire.tension,
                taken=tuple(
                    part._replace(tension=shares.get(part.by, 1.0) * part.tension)
                    for part in wire.taken
                ),
            )
            for wire in self.wires
        )
        return replace(self, wires=tuple(wires))
