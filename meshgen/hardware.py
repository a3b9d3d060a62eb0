"""Hardware of the wires: droppers, clamps, steady arms, supports, fittings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from catenary.meshgen.wires import Wire


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
