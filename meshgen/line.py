"""The line as an engineer describes it: masts, wires by name and role, what hangs between them.

SI units, no mesh yet. Axes: x along the track from the first anchor, y lateral, z up from the top
of rail. Which wires a line has is decided by its topology (``catenary.meshgen.topologies``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from catenary.meshgen.spans import Spans

# Places closer than this along the track are one [m].
_SAME_PLACE = 1e-6


class Role(str, Enum):
    """What a wire is there for."""

    CONTACT = "contact"
    MESSENGER = "messenger"
    AUXILIARY = "auxiliary"
    STITCH = "stitch"


class End(str, Enum):
    """How a piece of wire ends: held in height by a tensioner, or carried by a clamp there."""

    HELD = "held"
    CLAMPED = "clamped"


@dataclass(frozen=True)
class Conductor:
    """A tensioned conductor: tension [N], mass per length [kg/m], bending stiffness EI [N m2]."""

    tension: float
    mass_per_length: float
    bending_stiffness: float

    @property
    def wave_speed(self) -> float:
        """Speed of transverse waves on it as a string, sqrt(F/rho) [m/s] (paper eq. 1.1)."""
        return float(np.sqrt(self.tension / self.mass_per_length))


@dataclass(frozen=True)
class Piece:
    """A wire from end to end: points that it passes before form finding, straight in between.

    x : positions along the track, ascending [m]
    y : lateral positions [m]
    z : heights; of an end that is held and of a support those at which it stays [m]
    ends : how it begins and ends
    """

    x: tuple[float, ...]
    y: tuple[float, ...]
    z: tuple[float, ...]
    ends: tuple[End, End] = (End.HELD, End.HELD)

    def points(self, x: np.ndarray) -> np.ndarray:
        """Points of the piece at positions ``x`` (n,) along the track, shape (n, 3) [m]."""
        return np.column_stack([x, np.interp(x, self.x, self.y), np.interp(x, self.x, self.z)])


@dataclass(frozen=True)
class Profile:
    """Heights that a wire is to have at rest where it is held: at its droppers' lower ends.

    height : at the masts of the running spans [m]
    sag_x, sag : pre-sag below that height at positions along the track, linear between them [m]
    rise : height gained over all transition spans at the start, and at the end [m]
    ends, running : from and to of the wire and of where it is level [m]
    end_rise : height gained at the end if it is another one [m]
    """

    height: float
    sag_x: tuple[float, ...]
    sag: tuple[float, ...]
    rise: float
    ends: tuple[float, float]
    running: tuple[float, float]
    end_rise: float | None = None

    @property
    def rises(self) -> bool:
        """Whether it is higher anywhere than where it is level, pre-sag aside."""
        at_end = self.rise if self.end_rise is None else self.end_rise
        rising = self.rise > 0.0 and self.running[0] > self.ends[0]
        return rising or (at_end > 0.0 and self.running[1] < self.ends[1])

    def level(self, x: np.ndarray) -> np.ndarray:
        """Height without pre-sag at positions ``x`` [m], shape as ``x``.

        Constant in the running spans; in the transition spans a parabola that leaves the running
        height without a kink and has gained its rise at the anchor.
        """
        x = np.asarray(x, dtype=float)
        start, end = self.running
        height = np.full_like(x, self.height)
        if start > self.ends[0]:
            into = np.clip((start - x) / (start - self.ends[0]), 0.0, None)
            height += self.rise * into**2
        if end < self.ends[1]:
            into = np.clip((x - end) / (self.ends[1] - end), 0.0, None)
            height += (self.rise if self.end_rise is None else self.end_rise) * into**2
        return height

    def pre_sag(self, x: np.ndarray) -> np.ndarray:
        """Pre-sag at positions ``x`` [m], shape as ``x``."""
        return np.interp(x, self.sag_x, self.sag)


@dataclass(frozen=True)
class Wire(Conductor):
    """A wire of a line.

    Attributes
    ----------
    name : of the wire, of its group in a mesh file and of its component in the damping
    role : what it is there for
    pieces : where it runs, one piece or several by ascending x that do not overlap
    profile : heights wanted at its droppers' lower ends; None if none hangs it
    taken : stretches (from, to, tension) over which wires that are clamped to it carry that much of
        its tension, in ascending order [m], [m], [N]
    """

    name: str
    role: Role
    pieces: tuple[Piece, ...]
    profile: Profile | None = None
    taken: tuple[tuple[float, float, float], ...] = ()

    @classmethod
    def of(
        cls,
        conductor: Conductor,
        name: str,
        role: Role,
        pieces: tuple[Piece, ...],
        profile: Profile | None = None,
        taken: tuple[tuple[float, float, float], ...] = (),
    ) -> Wire:
        """A wire made of a conductor."""
        return cls(
            conductor.tension,
            conductor.mass_per_length,
            conductor.bending_stiffness,
            name,
            role,
            pieces,
            profile,
            taken,
        )

    def tension_at(self, x: np.ndarray | float) -> np.ndarray:
        """Tension at positions ``x`` [m], shape as ``x`` [N]."""
        tension = np.full(np.shape(x), self.tension)
        if self.taken:
            start, end, less = np.array(self.taken).T
            which = np.clip(np.searchsorted(start, x, side="right") - 1, 0, None)
            tension -= np.where((x >= start[which]) & (x < end[which]), less[which], 0.0)
        return tension

    @property
    def length(self) -> float:
        """Length of all pieces along the track [m]."""
        return sum(piece.x[-1] - piece.x[0] for piece in self.pieces)

    @property
    def top(self) -> float:
        """Height at the masts of the running spans, or the greatest one without a profile [m]."""
        if self.profile is not None:
            return self.profile.height
        return max(max(piece.z) for piece in self.pieces)

    @property
    def held_heights(self) -> list[float]:
        """Heights of its ends that are held, in order of x [m]."""
        ends = ((piece, end) for piece in self.pieces for end in (0, -1))
        return [piece.z[end] for piece, end in ends if piece.ends[end] is End.HELD]

    def points(self, x: np.ndarray) -> np.ndarray:
        """Points of the wire at positions ``x`` (n,) inside its pieces, shape (n, 3) [m]."""
        starts = [piece.x[0] for piece in self.pieces]
        which = np.clip(np.searchsorted(starts, x + _SAME_PLACE, side="right") - 1, 0, None)
        points = np.empty((x.size, 3))
        for number in np.unique(which):
            here = which == number
            points[here] = self.pieces[number].points(x[here])
        if self.profile is not None:
            points[:, 2] = self.profile.level(x) - self.profile.pre_sag(x)
        return points


@dataclass(frozen=True)
class DropperKind:
    """What all droppers of a group share.

    Exactly one of ``stiffness`` [N/m] and ``axial_stiffness`` EA [N] is given; with EA the
    stiffness of each dropper is EA over its own length. Clamp masses in kg.
    """

    stiffness: float | None
    axial_stiffness: float | None
    mass_per_length: float
    upper_clamp_mass: float
    lower_clamp_mass: float

    def stiffness_at(self, length: np.ndarray) -> np.ndarray:
        """Stiffness of droppers of these lengths (n,) [m], shape as ``length`` [N/m]."""
        if self.stiffness is not None:
            return np.full(length.shape, self.stiffness)
        assert self.axial_stiffness is not None
        return np.asarray(self.axial_stiffness / length)


@dataclass(frozen=True)
class Droppers:
    """A group of droppers from one wire down to another.

    Attributes
    ----------
    name : of their group in a mesh file and of their component in the damping
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


@dataclass(frozen=True)
class SteadyArm:
    """A steady arm hinged at its registration end and clamped to a wire.

    length [m], mass per length [kg/m], clamp mass [kg], vertical stiffness at the wire [N/m].
    ``holds_height``: whether the arm holds the wire at its height at rest and so carries weight
    there; otherwise the wire hangs freely between the droppers next to the arm.
    """

    length: float
    mass_per_length: float
    clamp_mass: float
    stiffness: float
    holds_height: bool = False


@dataclass(frozen=True)
class SteadyArms:
    """Steady arms of one kind on one wire; ``x`` are their places, ascending [m]."""

    name: str
    kind: SteadyArm
    wire: str
    x: tuple[float, ...]


@dataclass(frozen=True)
class Supports:
    """Supports of one kind under one wire: springs relaxed at the height of its course there.

    Attributes
    ----------
    name, wire : their own name, and that of the wire that they carry
    stiffness : vertical, of each [N/m]
    x : their places, ascending [m]
    holds : name of a wire that is to have its wanted height there at rest, by which each support is
        as high as that takes; empty if they stay at the height of their wire's course
    """

    name: str
    stiffness: float
    wire: str
    x: tuple[float, ...]
    holds: str = ""


@dataclass(frozen=True)
class Line(Spans):
    """A line: masts, wires, and the groups of what hangs between them and stands under them.

    Attributes
    ----------
    topology : name of what made it
    wires : from the contact wires upwards
    droppers, steady_arms, supports, clamps : groups

    Raises ValueError if names occur twice, a group names no wire, or droppers hang a wire without
    wanted heights: a topology that makes such a line is wrong.
    """

    topology: str
    wires: tuple[Wire, ...]
    droppers: tuple[Droppers, ...]
    steady_arms: tuple[SteadyArms, ...]
    supports: tuple[Supports, ...]
    clamps: tuple[Clamps, ...] = ()

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
        """Groups of what stands at single places of wires: arms, then supports."""
        return (*self.steady_arms, *self.supports)

    @property
    def clamp_group(self) -> np.ndarray:
        """Number of its group for each clamp, group by group."""
        return np.repeat(np.arange(len(self.clamps)), [len(group.x) for group in self.clamps])

    @property
    def profiles(self) -> tuple[Profile, ...]:
        """Heights wanted of the wires that droppers hang, in the order of ``wires``."""
        return tuple(wire.profile for wire in self.wires if wire.profile is not None)

    @property
    def dropper_x(self) -> np.ndarray:
        """Places of the lower ends of all droppers, ascending [m]."""
        return np.sort(np.concatenate([np.zeros(0), *(group.lower_x for group in self.droppers)]))

    def droppers_of_span(self, span: int) -> np.ndarray:
        """Places of the lower ends of a span's droppers, ascending [m]; spans count from 0."""
        masts, x = self.support_positions, self.dropper_x
        return np.asarray(x[(x > masts[span]) & (x < masts[span + 1])])

    def with_shares(self, shares: Mapping[str, float]) -> Line:
        """The line with the tension of the named wires a share of what it was.

        A wire that is clamped to others carries the same share of what it took of their tension.
        """
        clamped = {
            (piece.x[0], piece.x[-1]): shares.get(wire.name, 1.0)
            for wire in self.wires
            for piece in wire.pieces
            if End.CLAMPED in piece.ends
        }
        wires = (
            replace(
                wire,
                tension=shares.get(wire.name, 1.0) * wire.tension,
                taken=tuple((a, b, clamped.get((a, b), 1.0) * less) for a, b, less in wire.taken),
            )
            for wire in self.wires
        )
        return replace(self, wires=tuple(wires))
