"""Where the pan heads touch the contact wire: location, interpolation, owned parts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.distribution import Ownership
from catenary.solver.elements import shape_slopes, shape_values
from catenary.solver.equilibrium import Equilibrium
from catenary.solver.model import Model


class Touch(NamedTuple):
    """A place on the contact wire.

    element : its number along the wire; xi : place in it, 0 to 1; length : of the element [m];
    value : (4,) Hermite functions N of the element's unknowns; rest : (4,) the unknowns of the
    line at rest, heights [m] and slopes.
    """

    element: int
    xi: float
    length: float
    value: np.ndarray
    rest: np.ndarray

    @property
    def slope(self) -> np.ndarray:
        """Derivatives N' of the Hermite functions along the track, shape (4,)."""
        return shape_slopes(self.xi, self.length)


class ContactWire:
    """The contact wire as a train sees it. The same on all ranks but for ``owned``.

    Attributes
    ----------
    dofs : (n_nodes, 2) unknowns (w, theta_y) of its nodes, in order of x
    local : (n_elements, 4) local numbers of an element's unknowns, 0 where not owned
    owned : (n_elements, 4) 1.0 where this rank owns the unknown, else 0.0
    """

    def __init__(self, model: Model, form: Equilibrium, ownership: Ownership) -> None:
        nodes = model.mesh.wires[CONTACT_WIRE]
        self._x = model.mesh.x(nodes)
        self._length = np.diff(self._x)
        self.dofs = np.stack([model.dofs(nodes), model.dofs(nodes, "theta_y")], axis=1)
        rest = np.stack([form.height[nodes], form.slope[nodes]], axis=1)
        self._rest = np.concatenate([rest[:-1], rest[1:]], axis=1)
        by_element = np.concatenate([self.dofs[:-1], self.dofs[1:]], axis=1)
        mask = ownership.owned(by_element)
        self.owned = mask.astype(float)
        self.local = np.where(mask, by_element - ownership.first, 0)

    def touch(self, x: float) -> Touch:
        """The place ``x`` [m] along the track; a node belongs to the element that it ends."""
        element = int(self._x.searchsorted(x)) - 1
        element = min(max(element, 0), self._length.size - 1)
        length = float(self._length[element])
        xi = (x - float(self._x[element])) / length
        return Touch(element, xi, length, shape_values(xi, length), self._rest[element])

    def rest_height(self, x: float) -> float:
        """Height of the line at rest [m]."""
        touch = self.touch(x)
        return float(touch.value @ touch.rest)

    def nodes_between(self, low: float, high: float) -> tuple[int, int]:
        """Range of the wire's nodes whose elements cover [low, high] [m]."""
        first = int(np.searchsorted(self._x, low, side="right")) - 1
        last = int(np.searchsorted(self._x, high)) + 1
        return max(first, 0), min(last, self._x.size)

    @property
    def x(self) -> np.ndarray:
        """Positions of the wire's nodes [m]."""
        return self._x
