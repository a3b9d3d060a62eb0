"""Where the pan heads touch the contact wire: location, interpolation, owned parts."""

from __future__ import annotations

import numpy as np

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver import kernels
from catenary.solver.distribution import Ownership
from catenary.solver.equilibrium import Equilibrium
from catenary.solver.model import Model

# Far more than the round-off of a position, far less than an element [m].
_SLIP = 1e-6


class Touches:
    """Places of n contacts on the contact wire; the arrays are overwritten at every step.

    Attributes
    ----------
    x : (n,) along the track [m]
    element : (n,) numbers of the touched elements along the wire
    local : (n, 4) local numbers of their unknowns, 0 where another rank owns them
    value, slope : (n, 4) Hermite functions N and dN/dx of the unknowns, 0 where not owned here
    whole_value, whole_slope : (n, 4) the same without regard to ownership
    rest : (n, 4) the unknowns of the line at rest: heights [m] and slopes [-]
    """

    def __init__(self, n: int) -> None:
        self.x = np.zeros(n)
        self.element = np.zeros(n, dtype=np.int64)
        self.local = np.zeros((n, 4), dtype=np.int64)
        self.value, self.slope = np.zeros((n, 4)), np.zeros((n, 4))
        self.whole_value, self.whole_slope = np.zeros((n, 4)), np.zeros((n, 4))
        self.rest = np.zeros((n, 4))

    @property
    def n(self) -> int:
        return int(self.x.size)


class ContactWire:
    """The contact wire as a train sees it. Not collective.

    Attributes
    ----------
    x : (n_nodes,) positions of its nodes [m], ascending
    dofs : (n_nodes, 2) unknowns (w, theta_y) of its nodes
    """

    def __init__(self, model: Model, form: Equilibrium, ownership: Ownership) -> None:
        nodes = model.mesh.wires[CONTACT_WIRE]
        self.x = model.mesh.x(nodes)
        self.dofs = np.stack([model.dofs(nodes), model.dofs(nodes, "theta_y")], axis=1)
        self._rest = np.stack([form.height[nodes], form.slope[nodes]], axis=1)
        mine = ownership.owned(self.dofs)
        self._owned = mine.astype(float)
        self._local = np.where(mine, self.dofs - ownership.first, 0)

    def locate(self, start: np.ndarray, way: float, touches: Touches) -> None:
        """Fill ``touches`` for a ``way`` [m] ahead of each ``start`` (n,) [m].

        A node belongs to the element that it ends.
        """
        kernels.locate(
            start,
            way,
            touches.x,
            self.x,
            self._local,
            self._owned,
            self._rest,
            touches.element,
            touches.local,
            touches.value,
            touches.slope,
            touches.whole_value,
            touches.whole_slope,
            touches.rest,
        )

    def rest_height(self, x: np.ndarray) -> np.ndarray:
        """Height of the line at rest at positions ``x`` [m], shape as ``x``."""
        touches = Touches(x.size)
        self.locate(x, 0.0, touches)
        return np.asarray((touches.whole_value * touches.rest).sum(axis=1))

    def rest_slope(self, x: np.ndarray) -> np.ndarray:
        """Slope dw/dx of the line at rest at positions ``x`` [m], shape as ``x`` [-]."""
        touches = Touches(x.size)
        self.locate(x, 0.0, touches)
        return np.asarray((touches.whole_slope * touches.rest).sum(axis=1))

    def nodes_between(self, low: float, high: float) -> tuple[int, int]:
        """Range of the wire's nodes whose elements cover [low, high] [m], ends included."""
        # A position that is start + V t may miss an end by round-off and fall in the next element.
        first = int(np.searchsorted(self.x, low - _SLIP, side="right")) - 1
        last = int(np.searchsorted(self.x, high + _SLIP)) + 1
        return max(first, 0), min(last, self.x.size)
