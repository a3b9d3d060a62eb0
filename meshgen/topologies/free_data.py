"""Wires and links of a free line, in SI units: what the topology ``free`` makes its line from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from catenary.meshgen.hardware import Clamps, Droppers, SteadyArms, Supports
from catenary.meshgen.wires import Conductor, Role


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
    heights : above the rail at its supports and ends; None if it hangs straight between clamps
    lateral : None if it is that of the wire that it is clamped to
    drawn : whether ``heights`` are its whole course, to which no sag is added
    clamped_to : names of the wires that its pieces are clamped to where they start and where they
        end, "" where they are held
    tensioned : whether held ends have a tensioner, None as the ends of the line have
    clamp_mass, clamp_stiffness : of each of its clamps [kg], [N/m]
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
