"""First guesses of sag: of a wire between masts, or between any places that carry it.

Form finding gives the heights.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from catenary.meshgen.spans import Spans
from catenary.meshgen.topologies.free_data import FreeWire
from catenary.meshgen.wires import Conductor, Piece

# Only for the first guess of a sag; equilibrium uses the scene's value [m/s2].
GRAVITY = 9.81


def sagging(spans: Spans, x: np.ndarray, top: float, mass: float, tension: float) -> Piece:
    """A wire from anchor to anchor above the track, a parabola in each span.

    Parameters
    ----------
    x : places between the masts at which the course is to have points, ascending [m]
    top : height at the masts [m]
    mass : that it carries per length, its own included [kg/m]
    tension : of the wire [N]
    """
    masts = spans.support_positions
    x = np.unique(np.concatenate([masts, x]))
    span = np.clip(np.searchsorted(masts, x, side="right") - 1, 0, spans.n_spans - 1)
    along, length = x - masts[span], np.asarray(spans.span_lengths)[span]
    sag = np.where(np.isin(x, masts), 0.0, mass * GRAVITY * along * (length - along))
    z = top - sag / (2.0 * tension)
    return Piece(tuple(x.tolist()), (0.0,) * x.size, tuple(z.tolist()))


class Loads:
    """Masses that hang from a wire at places along the line."""

    def __init__(self) -> None:
        self._parts: list[tuple[np.ndarray, np.ndarray]] = []

    def add(self, x: Sequence[float] | np.ndarray, mass: Sequence[float] | np.ndarray) -> None:
        """Further masses [kg] at places ``x`` [m]."""
        self._parts.append((np.asarray(x, dtype=float), np.asarray(mass, dtype=float)))

    @property
    def sorted(self) -> tuple[np.ndarray, np.ndarray]:
        """Places, ascending, and masses there."""
        x = np.concatenate([np.zeros(0), *(part[0] for part in self._parts)])
        mass = np.concatenate([np.zeros(0), *(part[1] for part in self._parts)])
        order = np.argsort(x, kind="stable")
        return x[order], mass[order]

    @property
    def x(self) -> np.ndarray:
        """Places, ascending [m]."""
        return self.sorted[0]

    def between(self, start: float, end: float, mass_per_length: float) -> float:
        """Mass of a wire and of what hangs from it between two places [kg]."""
        x, mass = self.sorted
        inside = (x >= start) & (x < end)
        return float(mass_per_length * (end - start) + mass[inside].sum())

    def shared(self, carriers: np.ndarray, wire: FreeWire) -> np.ndarray:
        """Masses (n,) that hang on what carries a wire at ``carriers`` (n,), ascending: half of the
        wire up to each neighbour, and of what hangs from that [kg]."""
        ends = wire.stretches[0][0], wire.stretches[-1][1]
        between = 0.5 * (carriers[1:] + carriers[:-1])
        bounds = np.concatenate([ends[:1], between, ends[1:]])
        at, mass = self.sorted
        total = np.concatenate([[0.0], np.cumsum(mass)])[np.searchsorted(at, bounds)]
        return np.asarray(wire.conductor.mass_per_length * np.diff(bounds) + np.diff(total))


def sag_between(x: np.ndarray, held: np.ndarray, loads: Loads, wire: Conductor) -> np.ndarray:
    """How far a string hangs below the straight line between neighbouring places ``held`` (m,).

    Parameters
    ----------
    x : (n,) places between the first and the last of ``held`` [m]
    """
    at, mass = loads.sorted
    inside = (at > held[0]) & (at < held[-1])
    at, mass = at[inside], mass[inside]
    gap = np.clip(np.searchsorted(held, x, side="right") - 1, 0, held.size - 2)
    of_load = np.searchsorted(held, at, side="right") - 1
    length = np.diff(held)
    # Moments as of a beam on two supports: reaction on the left, own weight, loads passed.
    lever = mass * (held[of_load + 1] - at) / length[of_load]
    reaction = 0.5 * wire.mass_per_length * length
    reaction += np.bincount(of_load, lever, minlength=length.size)
    along = x - held[gap]
    sums = [np.concatenate([[0.0], np.cumsum(part)]) for part in (mass, mass * at)]
    first, passed = np.searchsorted(at, held[gap]), np.searchsorted(at, x)
    masses, moments = (part[passed] - part[first] for part in sums)
    moment = reaction[gap] * along - 0.5 * wire.mass_per_length * along**2
    return np.asarray(GRAVITY * (moment - masses * x + moments) / wire.tension)
