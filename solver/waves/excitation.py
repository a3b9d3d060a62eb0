"""What sets a contact wire into motion in place of a train: a force that moves, a pulse, a hammer.

Each is a load in time on the wire's elements, whose shape functions share a force at a point among
the unknowns of its two nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from catenary.solver.base.compiled import compiled
from catenary.solver.model.elements.shape_functions import shape_values
from catenary.solver.model.loads import FieldLoad, Load, ShapeLoad, table
from catenary.solver.model.model import Model

# Points in time by which half a sine or a whole cosine is drawn.
_POINTS = 41


@dataclass(frozen=True)
class MovingForce:
    """A force that moves along the contact wire, and may vary as a cosine.

    Attributes
    ----------
    force : its value, or the amplitude of what varies [N], upwards
    frequency : of the cosine [Hz], zero for a force that stays as it is
    start, speed : where it begins [m], and how fast it moves [m/s]
    rise : time in which it grows from zero, as half a cosine [s]
    """

    force: float
    frequency: float
    start: float
    speed: float
    rise: float

    def value(self, time: np.ndarray) -> np.ndarray:
        """Its value at times (n,) [s], shape (n,) [N]."""
        share = np.clip(time / self.rise, 0.0, 1.0) if self.rise > 0.0 else np.ones_like(time)
        grown = 0.5 * (1.0 - np.cos(np.pi * share))
        return self.force * grown * np.cos(2.0 * np.pi * self.frequency * time)


@dataclass(frozen=True)
class Blow:
    """A force on one place of the contact wire over a short time.

    Attributes
    ----------
    at : place along the track [m]
    duration : [s]
    peak : largest force [N]
    hammer : half a sine, as of a hammer that rebounds; otherwise a whole (1 - cosine) / 2, which
        has less of the high frequencies
    """

    at: float
    duration: float
    peak: float
    hammer: bool

    @property
    def impulse(self) -> float:
        """Integral of the force over time [N s]."""
        return self.peak * self.duration * (2.0 / np.pi if self.hammer else 0.5)


Excitation = MovingForce | Blow


def hammer(at: float, impulse: float, duration: float) -> Blow:
    """Half a sine of an impulse [N s]."""
    return Blow(at, duration, 0.5 * np.pi * impulse / duration, True)


def load_of(excitation: Excitation, model: Model, interval: float) -> Load:
    """The load that an excitation is on the first contact wire. Not collective.

    Parameters
    ----------
    interval : between times at which a force that moves is found; linear between them. Time steps
        are best [s]
    """
    nodes = model.contact_nodes
    x = model.mesh.x(nodes)
    unknowns = np.stack([model.dofs(nodes), model.dofs(nodes, "theta_y")], axis=1).ravel()
    if isinstance(excitation, Blow):
        values = np.zeros((1, unknowns.size))
        spread(x, np.array([excitation.at]), np.array([excitation.peak]), 0, values)
        acts = np.flatnonzero(values[0])
        share = np.linspace(0.0, 1.0, _POINTS)
        shape = np.sin(np.pi * share) if excitation.hammer else np.sin(np.pi * share) ** 2
        course = table(list(excitation.duration * share), list(shape))
        return ShapeLoad(unknowns[acts], values[0, acts], course)

    def fill(first: int, part: slice, slices: np.ndarray) -> None:
        times = interval * (first + np.arange(slices.shape[0]))
        places = excitation.start + excitation.speed * times
        slices[:] = 0.0
        spread(x, places, excitation.value(times), part.start, slices)

    return FieldLoad(unknowns, sparse.identity(unknowns.size, format="csr"), interval, fill)


@compiled
def spread(x, places, forces, first, loads):  # type: ignore[no-untyped-def]
    """Add forces at single places to loads on deflections and slopes of nodes.

    Parameters
    ----------
    x : (n,) nodes of a wire, ascending [m]
    places, forces : (m,) [m], [N]; what lies beyond the ends is left out
    first : number of the unknown that the first column stands for: w and theta of each node in turn
    loads : (m, k) a row for each force [N], [N m]
    """
    for i in range(places.size):
        if places[i] < x[0] or places[i] > x[-1]:
            continue
        e = min(max(np.searchsorted(x, places[i], side="right") - 1, 0), x.size - 2)
        length = x[e + 1] - x[e]
        shares = shape_values((places[i] - x[e]) / length, length)
        for j in range(4):
            column = 2 * e + j - first
            if 0 <= column < loads.shape[1]:
                loads[i, column] += forces[i] * shares[j]
