"""What is wrong with a line: irregularities and defects from the start, incidents in a run.

Data only. Irregularities are of the contact wire's height, its running surface and the lengths of
droppers. Random heights are sums of sines. Their one-sided spectrum over the wave number Omega
[rad/m] is S = C Omega^-n between two wavelengths and zero outside; its integral is the variance:
C = sigma^2 (1 - n) / (O2^(1 - n) - O1^(1 - n)), and sigma^2 / ln(O2 / O1) for n = 1. No published
spectrum of contact wires with its constants is known to us, so that all of them are data.

Defects are there once droppers are cut; these keep the lengths to which they were cut for the sound
line. Incidents happen on the way: `after_incidents` changes the line, and `march` decides when.
What may happen to a pantograph stands with its placement (`mbs.head.stepping`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from catenary.mbs.vehicle import sines
from catenary.meshgen.line import DropperPlace

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

# Distance from a bend at which the slopes of its two sides are taken [m].
_BESIDE = 1e-6


@dataclass(frozen=True)
class HeightSpectrum:
    """A power law between two wavelengths.

    Attributes
    ----------
    deviation : standard deviation of the heights, sigma [m]
    exponent : n, by which the spectrum falls with the wave number
    shortest, longest : wavelengths [m]
    seed : the same seed gives the same heights
    """

    deviation: float
    exponent: float
    shortest: float
    longest: float
    seed: int

    def variance(self, lowest: np.ndarray, highest: np.ndarray) -> np.ndarray:
        """Integral of the spectrum between wave numbers within its band [m^2]."""
        whole = self._primitive(2 * np.pi / self.shortest) - self._primitive(
            2 * np.pi / self.longest
        )
        part = self._primitive(highest) - self._primitive(lowest)
        return np.asarray(self.deviation**2 * part / whole)

    def waves(self, wire: str) -> Waves:
        """The sines of a wire; wires have phases of their own."""
        return Waves(*sines(self.variance, (self.shortest, self.longest), self.seed, wire))

    def _primitive(self, number: np.ndarray | float) -> np.ndarray:
        power = 1.0 - self.exponent
        if abs(power) < 1e-9:
            return np.asarray(np.log(number))
        return np.asarray(np.asarray(number) ** power / power)


class Waves(NamedTuple):
    """Sines: ``amplitude`` [m], wave ``number`` [rad/m] and ``phase`` [rad], (N_WAVES,)."""

    amplitude: np.ndarray
    number: np.ndarray
    phase: np.ndarray


@dataclass(frozen=True)
class Heights:
    """Heights of contact wires along the track, above what they would be.

    Attributes
    ----------
    stretch : from and to [m]; over one of the longest waves at both ends random heights fade in and
        out by a half cosine, and are zero outside
    spectrum : of random heights, each contact wire its own; None if there are none
    table : pairs (x, height) [m] of all contact wires, joined by a cubic spline that is level at
        its ends; beyond them the height stays. Empty if there are none
    """

    stretch: tuple[float, float]
    spectrum: HeightSpectrum | None = None
    table: tuple[tuple[float, float], ...] = ()

    @cached_property
    def _spline(self) -> CubicSpline:
        from scipy.interpolate import CubicSpline  # sound lines do not need it

        x, z = np.array(self.table).T
        return CubicSpline(x, z, bc_type="clamped")

    def at(self, wire: str, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Height [m] and its slope at places ``x`` (n,) of a wire, (n,) each."""
        height, slope = np.zeros(x.shape), np.zeros(x.shape)
        if self.spectrum is not None:
            window, steep = self._window(x)
            inside, waves = np.flatnonzero(window), self.spectrum.waves(wire)
            # In blocks, so that long lines take little memory.
            for part in np.array_split(inside, max(1, inside.size // 4096)):
                phase = np.outer(x[part], waves.number) + waves.phase
                own = np.sin(phase) @ waves.amplitude
                rise = np.cos(phase) @ (waves.amplitude * waves.number)
                height[part] = window[part] * own
                slope[part] = window[part] * rise + steep[part] * own
        if self.table:
            first, last = self.table[0][0], self.table[-1][0]
            height += self._spline(np.clip(x, first, last))
            within = (x > first) & (x < last)
            slope[within] += self._spline(x[within], 1)
        return height, slope

    def places(self, per_wave: int) -> np.ndarray:
        """Places that show them, ``per_wave`` to the shortest wave, ascending [m]."""
        found = [np.zeros(0)]
        if self.spectrum is not None:
            start, end = self.stretch
            n = max(2, int(np.ceil((end - start) / self.spectrum.shortest * per_wave)))
            found.append(np.linspace(start, end, n + 1))
        if self.table:
            x = np.array(self.table)[:, 0]
            found.append((x[:-1, None] + np.diff(x)[:, None] * np.arange(4) / 4).ravel())
            found.append(x[-1:])
        return np.unique(np.concatenate(found))

    def _window(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Factor of random heights, and its slope."""
        assert self.spectrum is not None
        start, end = self.stretch
        fade = min(self.spectrum.longest, 0.5 * (end - start))
        into = np.minimum(x - start, end - x) / fade
        inside = np.clip(into, 0.0, 1.0)
        value = 0.5 - 0.5 * np.cos(np.pi * inside)
        side = np.where(x - start < end - x, 1.0, -1.0)
        return value, side * 0.5 * np.pi / fade * np.sin(np.pi * inside)


@dataclass(frozen=True)
class BentWire:
    """The shape of a tensioned wire that was bent for good at a place.

    As an infinite beam on its tension it has z = -angle decay / 2 exp(-|x| / decay) around the
    bend, with decay = sqrt(EI / F): F z_xx = EI z_xxxx, and z_x
    jumps by the angle.

    Attributes
    ----------
    wire : its name
    x : place of the bend [m]
    angle : by which the slope jumps up there [rad]
    decay : length over which tension straightens it [m]
    """

    wire: str
    x: float
    angle: float
    decay: float

    def at(self, wire: str, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Height [m] and its slope at places ``x`` (n,) of a wire, (n,) each."""
        if wire != self.wire:
            return np.zeros(x.shape), np.zeros(x.shape)
        off = x - self.x
        height = -0.5 * self.angle * self.decay * np.exp(-np.abs(off) / self.decay)
        return height, -np.sign(off) * height / self.decay

    def places(self, per_wave: int) -> np.ndarray:
        """Places that show it, ``per_wave`` to a decay length, ascending [m]."""
        one_side = np.linspace(0.0, 16.0, 16 * per_wave + 1)[1:] * self.decay
        beside = np.array([_BESIDE])
        off = np.concatenate([-one_side[::-1], -beside, beside, one_side])
        return np.asarray(self.x + off)


Surface = Heights | BentWire


@dataclass(frozen=True)
class LengthErrors:
    """Errors of the droppers' lengths, of one that is cut too long positive.

    Attributes
    ----------
    deviation : standard deviation of the normal distribution before it is cut off [m]
    cut_off : at how many standard deviations
    seed : the same seed gives the same errors
    given : pairs of place and error [m] of single droppers, which come on top
    """

    deviation: float
    cut_off: float
    seed: int
    given: tuple[tuple[DropperPlace, float], ...] = ()

    def of(self, n: int) -> np.ndarray:
        """Random errors of ``n`` droppers in their order along the track, (n,) [m]."""
        from scipy.special import ndtr, ndtri  # sound lines do not need it

        low, high = ndtr(-self.cut_off), ndtr(self.cut_off)
        random = np.random.default_rng(self.seed).uniform(low, high, n)
        return np.asarray(self.deviation * ndtri(random))


@dataclass(frozen=True)
class Irregularities:
    """All irregularities of a line; None for what is as it should be.

    Attributes
    ----------
    heights : of the contact wires at their droppers: these are cut for them
    surface : of what the strips run on, above the contact wires' axes; no dropper sees them
    lengths : of droppers
    """

    heights: Heights | None = None
    surface: Heights | None = None
    lengths: LengthErrors | None = None


@dataclass(frozen=True)
class MissingDropper:
    """The dropper at a place is not there, nor are its clamps."""

    place: DropperPlace


@dataclass(frozen=True)
class LooseClamp:
    """A clamp of the dropper at a place slips: it carries nothing; all masses stay."""

    place: DropperPlace


@dataclass(frozen=True)
class WornWire:
    """A ``wire`` that has lost the share ``lost`` of its section from ``start`` to ``end`` [m].

    It is worn flat from below, and keeps its tension.
    """

    wire: str
    start: float
    end: float
    lost: float


@dataclass(frozen=True)
class WrongTension:
    """A ``wire`` that hangs with ``factor`` times the tension that its droppers were cut for."""

    wire: str
    factor: float


@dataclass(frozen=True)
class HardSpot:
    """A lumped ``mass`` [kg] on a ``wire`` at ``x`` [m], and a spring there to the ground.

    ``stiffness`` [N/m] of the spring, which carries nothing at rest.
    """

    wire: str
    x: float
    mass: float
    stiffness: float


@dataclass(frozen=True)
class Kink:
    """A ``wire`` that is bent for good at ``x`` [m] by ``angle`` [rad].

    A positive angle raises the slope dz/dx along the track: the bend points down.
    """

    wire: str
    x: float
    angle: float


Defect = MissingDropper | LooseClamp | WornWire | WrongTension | HardSpot | Kink


@dataclass(frozen=True)
class DropperBreak:
    """From ``time`` [s] on the dropper at a place carries nothing."""

    time: float
    place: DropperPlace


@dataclass(frozen=True)
class TensionLoss:
    """From ``time`` [s] on a ``wire`` has only the ``share`` of its first tension.

    ``wire`` is the name of a wire of the line.
    """

    time: float
    wire: str
    share: float


LineIncident = DropperBreak | TensionLoss


@dataclass(frozen=True)
class Happened:
    """Incidents of a line up to the end of step ``step``, in order of time."""

    step: int
    incidents: tuple[LineIncident, ...] = field(default=())


def in_steps(incidents: Sequence[LineIncident], dt: float) -> list[Happened]:
    """Incidents up to the end of each step in which one happens, by ascending step.

    Times are rounded to the nearest end of a step of ``dt`` [s].
    """
    ordered = sorted(incidents, key=lambda incident: incident.time)
    steps = [round(incident.time / dt) for incident in ordered]
    return [
        Happened(step, tuple(ordered[: len(ordered) - steps[::-1].index(step)]))
        for step in sorted(set(steps))
    ]
