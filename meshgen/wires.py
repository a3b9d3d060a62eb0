"""Wires: conductor and role, the pieces in which each runs, and the heights wanted of it.

SI units. Axes: x along the track from the first anchor, y lateral, z up from the top of rail.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np

# Places closer than this along the track are one [m].
SAME_PLACE = 1e-6


class Role(StrEnum):
    """Role of a wire."""

    CONTACT = "contact"
    MESSENGER = "messenger"
    AUXILIARY = "auxiliary"
    STITCH = "stitch"


class End(StrEnum):
    """End of a piece of wire: held in height by a tensioner, or carried by a clamp."""

    HELD = "held"
    CLAMPED = "clamped"


# Thermal expansion of copper and its alloys (TB/T 2810, 2821) [1/K].
EXPANSION_OF_COPPER = 1.7e-5


@dataclass(frozen=True)
class Conductor:
    """A tensioned conductor.

    Attributes
    ----------
    tension : at rest [N]
    mass_per_length : [kg/m]
    bending_stiffness : EI [N m2]
    axial_stiffness : EA [N], None if not given
    expansion : coefficient of thermal expansion [1/K]
    diameter : for wind loads [m], None if not given
    drag_coefficient : of the diameter [-]
    """

    tension: float
    mass_per_length: float
    bending_stiffness: float
    axial_stiffness: float | None = field(default=None, kw_only=True)
    expansion: float = field(default=EXPANSION_OF_COPPER, kw_only=True)
    diameter: float | None = field(default=None, kw_only=True)
    drag_coefficient: float = field(default=1.2, kw_only=True)

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
    tensioned : whether held ends have a tensioner along the track; None as the line's ends have
    """

    x: tuple[float, ...]
    y: tuple[float, ...]
    z: tuple[float, ...]
    ends: tuple[End, End] = (End.HELD, End.HELD)
    tensioned: tuple[bool | None, bool | None] = (None, None)

    @cached_property
    def course(self) -> np.ndarray:
        """The points that it passes, (3, n) [m]."""
        return np.array([self.x, self.y, self.z])


@dataclass(frozen=True)
class Section:
    """Level part of a wire in a tension section, and its rise to either end of it.

    ends, running : from and to of the section, and of where the wire is level [m]
    rise : height gained from there to the start, and to the end [m]
    """

    ends: tuple[float, float]
    running: tuple[float, float]
    rise: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Profile:
    """Heights that a wire is to have at rest where it is held: at its droppers' lower ends.

    height : at the masts of the running spans [m]
    sag_x, sag : pre-sag below that height at positions along the track, linear between them [m]
    sections : in which the wire runs, ascending
    above_x, above : further height at positions along the track, linear between them [m]
    """

    height: float
    sag_x: tuple[float, ...]
    sag: tuple[float, ...]
    sections: tuple[Section, ...]
    above_x: tuple[float, ...] = ()
    above: tuple[float, ...] = ()

    def base(self, x: np.ndarray) -> np.ndarray:
        """Height without pre-sag and rise towards the ends, shape as ``x`` [m]."""
        height = np.full_like(x, self.height, dtype=float)
        return height + np.interp(x, self.above_x, self.above) if self.above_x else height

    @property
    def rises(self) -> bool:
        """Whether it is higher anywhere than where it is level, pre-sag aside."""
        return any(
            (own.rise[0] > 0.0 and own.running[0] > own.ends[0])
            or (own.rise[1] > 0.0 and own.running[1] < own.ends[1])
            for own in self.sections
        )

    def level(self, x: np.ndarray) -> np.ndarray:
        """Height without pre-sag at positions ``x`` [m], shape as ``x``.

        ``base`` where a section is level; from there a parabola that leaves this height without a
        kink and has gained its rise at the end of the section.
        """
        x = np.asarray(x, dtype=float)
        ends, running, rise = (
            np.array([getattr(own, name) for own in self.sections])
            for name in ("ends", "running", "rise")
        )
        which = np.searchsorted(ends[:, 0], x + SAME_PLACE, side="right") - 1
        which = np.clip(which, 0, None)
        height = self.base(x)
        for side, sign in enumerate((-1.0, 1.0)):
            over = sign * (ends[:, side] - running[:, side])
            rises = np.where(over > 0.0, rise[:, side], 0.0)[which]
            into = sign * (x - running[which, side]) / np.where(over > 0.0, over, 1.0)[which]
            height += rises * np.clip(into, 0.0, None) ** 2
        return height

    def pre_sag(self, x: np.ndarray) -> np.ndarray:
        """Pre-sag at positions ``x`` [m], shape as ``x``."""
        return np.interp(x, *self._sags)

    @cached_property
    def _sags(self) -> np.ndarray:
        return np.array([self.sag_x, self.sag])


class Taken(NamedTuple):
    """Part of a wire's tension that another wire, which is clamped to it, carries in its place.

    start, end : stretch over which it does [m]
    tension : of the other wire [N]
    by : name of the other wire
    """

    start: float
    end: float
    tension: float
    by: str


@dataclass(frozen=True)
class Wire(Conductor):
    """A wire of a line.

    Attributes
    ----------
    name : of the wire, of its group in a mesh file and of its component in the damping
    role : contact, messenger, auxiliary or stitch wire
    pieces : where it runs, one piece or several by ascending x that do not overlap
    profile : wanted heights at the lower ends of its droppers; None without such droppers
    taken : stretches over which wires clamped to it carry a part of its tension; parts add up
        where stretches overlap
    worn : stretches (from [m], to [m], share [-]) over which it has lost a share of its section,
        from below
    """

    name: str
    role: Role
    pieces: tuple[Piece, ...]
    profile: Profile | None = None
    taken: tuple[Taken, ...] = ()
    worn: tuple[tuple[float, float, float], ...] = ()

    @classmethod
    def of(
        cls,
        conductor: Conductor,
        name: str,
        role: Role,
        pieces: tuple[Piece, ...],
        profile: Profile | None = None,
    ) -> Wire:
        """A wire made of a conductor; see ``Wire`` for the other parameters."""
        own = {part.name: getattr(conductor, part.name) for part in fields(Conductor)}
        return cls(**own, name=name, role=role, pieces=pieces, profile=profile)

    def tension_at(self, x: np.ndarray | float) -> np.ndarray:
        """Tension at positions ``x`` [m], shape as ``x`` [N]."""
        tension = np.full(np.shape(x), self.tension)
        if self.taken:
            parts = np.array([part[:3] for part in self.taken])
            for at, change in zip(parts.T[:2], (-1.0, 1.0), strict=True):
                order = np.argsort(at, kind="stable")
                less = np.cumsum(parts[order, 2])
                passed = np.searchsorted(at[order], x, side="right")
                tension += change * np.where(passed > 0, less[np.maximum(passed - 1, 0)], 0.0)
        return tension

    @property
    def most_taken(self) -> float:
        """Largest part of its tension that wires clamped to it carry at one place [N]."""
        starts = np.array([part.start for part in self.taken])
        return self.tension - float(np.min(self.tension_at(starts), initial=self.tension))

    def radial_force(self, x: np.ndarray) -> np.ndarray:
        """Lateral force that holds the wire where its course in plan has a kink, > 0 to the left.

        Parameters
        ----------
        x : ndarray, shape (n,)
            Places along the track [m].

        Returns
        -------
        ndarray, shape (n,) [N]
            Zero where the course is straight, or no piece passes.
        """
        force = np.zeros(x.shape)
        for piece in self.pieces:
            at, y, _ = piece.course
            kink = np.pad(np.diff(np.diff(y) / np.diff(at)), 1)
            nearest = np.clip(np.searchsorted(at, x - SAME_PLACE), None, at.size - 1)
            here = np.abs(at[nearest] - x) < SAME_PLACE
            force[here] = -self.tension_at(x[here]) * kink[nearest[here]]
        return force

    def left_of(self, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Remaining shares of section and bending stiffness, (n,) [-], over ``ends`` (n, 2) [m].

        A stretch that is worn in part has the mean along its length.
        """
        section, bending = np.ones(len(ends)), np.ones(len(ends))
        for start, end, lost in self.worn:
            inside = np.minimum(ends[:, 1], end) - np.maximum(ends[:, 0], start)
            share = np.clip(inside / (ends[:, 1] - ends[:, 0]), 0.0, 1.0)
            section -= share * lost
            bending -= share * (1.0 - worn_round(lost).bending)
        return section, bending

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
        at, y, z = self._course
        points = np.column_stack([x, np.interp(x, at, y), np.interp(x, at, z)])
        if self.profile is not None:
            points[:, 2] = self.profile.level(x) - self.profile.pre_sag(x)
        return points

    @cached_property
    def _course(self) -> np.ndarray:
        """The points that all pieces pass, (3, n) [m]."""
        return np.concatenate([np.zeros((3, 0)), *(piece.course for piece in self.pieces)], axis=1)


class WornRound(NamedTuple):
    """What is left of a round wire that is worn flat from below.

    Attributes
    ----------
    bending : share left of the bending stiffness in the vertical plane [-]
    farthest : distance of the farthest surface, the top, from the axis of bending, over the
        radius [-]
    """

    bending: float
    farthest: float


def worn_round(lost: float) -> WornRound:
    """A round wire worn from below by the share ``lost`` of its section, 0 <= lost < 1.

    With the half angle a of the flat, seen from the axis, the segment lost has the area
    R^2 (a - sin a cos a), and about the axis of the circle the first moment 2/3 R^3 sin^3 a and the
    second one R^4/4 (a - sin a cos a (1 - 2 sin^2 a)); what is left bends about its own centroid.
    That lies above the axis, but below the middle between flat and top.
    """
    low, high = 0.0, np.pi
    for _ in range(60):  # halvings, down to round-off
        a = 0.5 * (low + high)
        low, high = (a, high) if a - np.sin(a) * np.cos(a) < np.pi * lost else (low, a)
    segment = a - np.sin(a) * np.cos(a)
    second = 0.25 * (a - np.sin(a) * np.cos(a) * (1.0 - 2.0 * np.sin(a) ** 2))
    first = 2.0 / 3.0 * np.sin(a) ** 3
    left = np.pi / 4 - second - first**2 / (np.pi - segment)
    raised = first / (np.pi - segment)
    return WornRound(float(left / (np.pi / 4)), float(1.0 - raised))
