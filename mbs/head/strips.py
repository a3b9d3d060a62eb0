"""Collector strips and the head that carries them: masses on springs above what raises them.

Coordinates of a head, in this order: the heights of strips on springs of their own, the head's
height, its roll about the track, its pitch across it, the bending of its strips. A
strip touches the wire at a height z + l phi + p theta: l [m] is the lateral position of the wire on
it, p [m] the strip's place ahead of the head's centre, phi and theta roll and pitch [rad], which
lift what is left of and ahead of the
centre. Angles are small: 0.1 rad would be an error of 0.5 %.

A strip is a beam of constant section. Its height and, with the head, its roll are those of a rigid
one; bending adds q_1 f_1(y) + q_2 f_2(y) + .. with the modes of a beam whose ends are free. These
are orthogonal to both rigid motions and to each other. The strip stands on two springs, each half
of its suspension, which resist what the modes move them by: with modes enough the beam on its
springs is exact (Ritz). f_k is normalised to the strip's whole mass.

Source: any book on vibrations: cosh(b) cos(b) = 1, f = cosh + cos - s (sinh + sin).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from catenary.mbs.interface import spline_tables
from catenary.solver.kernels import native

# Points of the tables of modes along half a wave of the highest one.
_POINTS_A_WAVE = 100


@dataclass(frozen=True)
class Flexure:
    """Bending of a strip.

    ``stiffness`` EI [N m2]; ``spring_distance`` [m] across the track between the two springs below;
    ``n_modes`` that are followed; ``damping_ratio`` of each as a free beam.
    """

    stiffness: float
    spring_distance: float
    n_modes: int
    damping_ratio: float = 0.0

    def rates(self, mass: float, length: float) -> np.ndarray:
        """Natural frequencies of a free strip with a ``mass`` [kg] and a ``length`` [m], (n_modes,)
        [rad/s]."""
        roots = np.array([_root(number) for number in range(self.n_modes)])
        return np.asarray(roots**2 * np.sqrt(self.stiffness / (mass * length**3)))


def shapes(n_modes: int, length: float, places: np.ndarray) -> np.ndarray:
    """Shapes of the first ``n_modes`` modes of a free strip of a ``length`` [m] at ``places`` from
    its middle [m], (n_modes, len(places))."""
    x = places / length + 0.5
    found = []
    for number in range(n_modes):
        root = _root(number)
        ratio = (np.cosh(root) - np.cos(root)) / (np.sinh(root) - np.sin(root))
        argument = root * x
        # cosh - s sinh, with s close to 1: by exponentials, which do not cancel.
        grown = 0.5 * (1.0 - ratio) * np.exp(argument) + 0.5 * (1.0 + ratio) * np.exp(-argument)
        found.append(grown + np.cos(argument) - ratio * np.sin(argument))
    return np.array(found)


def mode_tables(n_modes: int, length: float) -> native.SplineTables:
    """The shapes of ``shapes`` as tables over the whole strip."""
    from scipy.interpolate import CubicSpline  # not loaded for strips that are rigid

    places = np.linspace(-0.5 * length, 0.5 * length, _POINTS_A_WAVE * (n_modes + 1) + 1)
    spline = CubicSpline(places, shapes(n_modes, length, places).T)
    return spline_tables(places, spline.c)


@lru_cache(maxsize=32)
def _root(number: int) -> float:
    """Root of cosh(b) cos(b) = 1, the first being 4.73."""
    from scipy.optimize import brentq  # not loaded for strips that are rigid

    near = (number + 1.5) * np.pi
    return float(brentq(lambda b: np.cos(b) - 1.0 / np.cosh(b), near - 0.2, near + 0.2, xtol=1e-13))


@dataclass(frozen=True)
class Turning:
    """A head that turns: ``inertia`` [kg m2] about its centre, ``stiffness`` [N m/rad] and
    ``damping`` [N m s/rad] between it and what carries it."""

    inertia: float
    stiffness: float
    damping: float


@dataclass(frozen=True)
class Suspension:
    """Suspension of a strip: ``mass`` [kg] of the strip, ``stiffness`` [N/m] and ``damping``
    [N s/m] between it and the head."""

    mass: float
    stiffness: float
    damping: float


@dataclass(frozen=True)
class Strips:
    """One or two collector strips.

    Attributes
    ----------
    number : 1 or 2
    spacing : between two strips along the track [m]
    length : of a strip across the track [m], None if it is not known
    suspension : of each strip, whose mass is part of the head's; None if it is fixed to the head
    pitch : how the head turns across the track, None if it does not
    wires : contact wires side by side, each of which may touch each strip
    flexure : how strips on springs of their own bend, None if they are rigid
    rake : angle between a strip and the cross-section [rad], > 0 if its left end is ahead
    """

    number: int = 1
    spacing: float = 0.0
    length: float | None = None
    suspension: Suspension | None = None
    pitch: Turning | None = None
    wires: int = 1
    flexure: Flexure | None = None
    rake: float = 0.0

    @property
    def offsets(self) -> tuple[float, ...]:
        """Places ahead of the head's centre [m], the leading strip first."""
        if self.number == 1:
            return (0.0,)
        return (0.5 * self.spacing, -0.5 * self.spacing)

    @property
    def half_length(self) -> float:
        """Half length of a strip [m], infinite if it is not known."""
        return float("inf") if self.length is None else 0.5 * self.length

    @property
    def contact_offsets(self) -> tuple[float, ...]:
        """Offset of the strip of each possible contact [m]: strip by strip, all wires together."""
        return tuple(x for x in self.offsets for _ in range(self.wires))

    def compression(self, force: float) -> float:
        """Compression of the strips' springs under a force shared by all strips [m]."""
        if self.suspension is None:
            return 0.0
        return force / (self.number * self.suspension.stiffness)


ONE_STRIP = Strips()


@dataclass(frozen=True)
class HeadParts:
    """A head as matrices over its n coordinates, and one more for the height of its carrier.

    Attributes
    ----------
    masses : (n,) [kg] or [kg m2]
    stiffness, damping : (n + 1, n + 1)
    touch : (s, n) by how much each coordinate raises each contact, the lateral position left out;
        wires that touch one strip have a row each
    level : (n,) 1 for heights, 0 for angles
    roll : number of the roll's coordinate, -1 without it
    offsets : (s,) places of the contacts ahead of the head's centre [m]
    bending : of its strips, None if they are rigid
    """

    masses: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    touch: np.ndarray
    level: np.ndarray
    roll: int
    offsets: tuple[float, ...]
    bending: native.Bending | None = None

    @cached_property
    def n(self) -> int:
        """Number of coordinates."""
        return int(self.masses.size)


def head_parts(
    mass: float,
    stiffness: float,
    damping: float,
    strips: Strips = ONE_STRIP,
    roll: Turning | None = None,
) -> HeadParts:
    """A head on strips, with its coordinates.

    Parameters
    ----------
    mass : float
        Mass of the whole head, its strips included [kg].
    stiffness : float
        Stiffness of its spring [N/m].
    damping : float
        Damping of its damper [N s/m].
    strips : Strips, optional
        Collector strips, a single one by default.
    roll : Turning, optional
        Inertia, spring and damper of its roll; without it the head does not roll.

    Raises
    ------
    ValueError
        The strips weigh as much as the whole head or more.
    """
    sprung = strips.suspension
    n_own = strips.number if sprung is not None else 0
    own_mass = n_own * sprung.mass if sprung is not None else 0.0
    if own_mass >= mass:
        raise ValueError(f"strips of {own_mass:g} kg are part of a head of {mass:g} kg")
    turns = [turning for turning in (roll, strips.pitch) if turning is not None]
    n_modes = 0 if strips.flexure is None or sprung is None else strips.flexure.n_modes
    head, n_rigid = n_own, n_own + 1 + len(turns)
    n = n_rigid + n_own * n_modes
    pitch = n_rigid - 1 if strips.pitch is not None else -1
    masses = np.zeros(n)
    springs, dampers = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    masses[head] = mass - own_mass
    _join(springs, _difference(n, head, n), stiffness)
    _join(dampers, _difference(n, head, n), damping)
    for number, turning in enumerate(turns, start=head + 1):
        masses[number] = turning.inertia
        springs[number, number] += turning.stiffness
        dampers[number, number] += turning.damping
    touch = np.zeros((strips.number, n))
    for i, ahead in enumerate(strips.offsets):
        place = np.zeros(n + 1)
        place[head] = 1.0
        if pitch >= 0:
            place[pitch] = ahead
        if sprung is None:
            touch[i] = place[:n]
            continue
        masses[i] = sprung.mass
        touch[i, i] = 1.0
        stretch = -place
        stretch[i] = 1.0
        own = slice(n_rigid + i * n_modes, n_rigid + (i + 1) * n_modes)
        ways = _stretches(stretch, own, strips)
        for way in ways:
            _join(springs, way, sprung.stiffness / len(ways))
            _join(dampers, way, sprung.damping / len(ways))
        if strips.flexure is not None and strips.length is not None:
            rates, diagonal = strips.flexure.rates(sprung.mass, strips.length), np.arange(n)[own]
            masses[own] = sprung.mass
            touch[i, own] = shapes(n_modes, strips.length, np.zeros(1))[:, 0]
            springs[diagonal, diagonal] += sprung.mass * rates**2
            dampers[diagonal, diagonal] += 2.0 * strips.flexure.damping_ratio * sprung.mass * rates
    level = np.zeros(n)
    level[: head + 1] = 1.0
    number = head + 1 if roll is not None else -1
    touch = np.repeat(touch, strips.wires, axis=0)
    offsets = strips.contact_offsets
    bending = None
    if n_modes and strips.length is not None:
        bending = native.Bending(mode_tables(n_modes, strips.length), n_rigid, strips.wires)
    return HeadParts(masses, springs, dampers, touch, level, number, offsets, bending)


def _stretches(rigid: np.ndarray, own: slice, strips: Strips) -> list[np.ndarray]:
    """Stretch of a strip's suspension; of its two halves if it bends, with modes at ``own``."""
    if strips.flexure is None or strips.length is None:
        return [rigid]
    half = 0.5 * strips.flexure.spring_distance
    found = []
    for column in shapes(strips.flexure.n_modes, strips.length, np.array([half, -half])).T:
        stretch = rigid.copy()
        stretch[own] = column
        found.append(stretch)
    return found


def _difference(n: int, upper: int, lower: int) -> np.ndarray:
    """Stretch of a spring between two of n + 1 coordinates."""
    stretch = np.zeros(n + 1)
    stretch[upper], stretch[lower] = 1.0, -1.0
    return stretch


def _join(matrix: np.ndarray, stretch: np.ndarray, value: float) -> None:
    """Add a spring (or damper) whose stretch is ``stretch`` @ coordinates."""
    matrix += value * np.outer(stretch, stretch)
