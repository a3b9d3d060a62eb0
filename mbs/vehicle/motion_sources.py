"""What moves the bases of a train's pantographs, as data; `base_motion` makes it run.

Up and to the left are positive.
"""

from __future__ import annotations

from dataclasses import dataclass

from catenary.mbs.vehicle.irregularity import Irregularity


@dataclass(frozen=True)
class Table:
    """A cubic spline through ``values`` [m] at ``points``, which grow.

    ``points`` are times [s], or with ``along_track`` places [m]. It is not bent at
    its ends, where it must not be left.
    """

    points: tuple[float, ...]
    values: tuple[float, ...]
    along_track: bool = False


@dataclass(frozen=True)
class Harmonic:
    """``amplitude`` sin(2 pi ``frequency`` t + ``phase``) [m], [Hz], [rad]."""

    amplitude: float
    frequency: float
    phase: float = 0.0


Source = Table | Harmonic | Irregularity


@dataclass(frozen=True)
class VehicleMotion:
    """Sums of sources that move the bases of a train's pantographs, up and to the left."""

    vertical: tuple[Source, ...] = ()
    lateral: tuple[Source, ...] = ()
