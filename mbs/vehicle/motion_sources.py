"""What moves the bases of a train's pantographs, as data; `base_motion` makes it run.

Up and to the left are positive.
"""

from __future__ import annotations

from dataclasses import dataclass

from catenary.mbs.vehicle.irregularity import Irregularity
from catenary.mbs.vehicle.suspension import Vehicle


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
    """Sums of sources that move the bases of a train's pantographs, up and to the left.

    What depends on the place is the track, which reaches the bases through a ``suspension``;
    without one they follow it as it is. What depends on time is their own motion in either case.
    """

    vertical: tuple[Source, ...] = ()
    lateral: tuple[Source, ...] = ()
    suspension: Vehicle | None = None
