"""Where the pan heads touch the contact wire: location, interpolation, owned parts."""

from __future__ import annotations

import numpy as np

from catenary.solver.contact import contact_kernels
from catenary.solver.contact.contact_kernels import NODE, TOUCH
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.statics.equilibrium import Equilibrium

# Far more than the round-off of a position, far less than an element [m].
_SLIP = 1e-6


class ContactWire:
    """The contact wire as a train sees it. Not collective.

    Attributes
    ----------
    x : (n_nodes,) positions of its nodes [m], ascending
    dofs : (n_nodes, 2) unknowns (w, theta_y) of its nodes
    nodes : (n_nodes,) records of ``NODE``, of no columns until an ``ForcesOnLine`` has some
    """

    def __init__(self, model: Model, form: Equilibrium, ownership: Ownership) -> None:
        nodes = model.contact_nodes
        self.x = model.mesh.x(nodes)
        self.dofs = np.stack([model.dofs(nodes), model.dofs(nodes, "theta_y")], axis=1)
        mine = ownership.owned(self.dofs)
        self.nodes = np.zeros(self.x.size, dtype=NODE)
        self.nodes["x"] = self.x
        self.nodes["local"] = np.where(mine, self.dofs - ownership.first, 0)
        self.nodes["owned"] = mine
        self.nodes["rest"] = np.stack([form.height[nodes], form.slope[nodes]], axis=1)

    def touches(self, x: np.ndarray) -> np.ndarray:
        """Places on the wire at positions ``x`` (n,) [m], records of ``TOUCH`` (n,)."""
        touches = np.zeros(x.size, dtype=TOUCH)
        contact_kernels.locate(x, self.nodes, touches)
        return touches

    def rest_height(self, x: np.ndarray) -> np.ndarray:
        """Height of the line at rest at positions ``x`` (n,) [m], shape as ``x``."""
        touches = self.touches(x)
        return np.asarray((touches["whole_value"] * touches["rest"]).sum(axis=1))

    def rest_slope(self, x: np.ndarray) -> np.ndarray:
        """Slope dw/dx of the line at rest at positions ``x`` (n,) [m], shape as ``x`` [-]."""
        touches = self.touches(x)
        return np.asarray((touches["whole_slope"] * touches["rest"]).sum(axis=1))

    def nodes_between(self, low: float, high: float) -> tuple[int, int]:
        """Range of the wire's nodes whose elements cover [low, high] [m], ends included."""
        # A position that is start + V t may miss an end by round-off and fall in the next element.
        first = int(np.searchsorted(self.x, low - _SLIP, side="right")) - 1
        last = int(np.searchsorted(self.x, high + _SLIP)) + 1
        return max(first, 0), min(last, self.x.size)
