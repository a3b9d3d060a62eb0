"""The train's pantographs: models on rank 0, their contacts' places and results on all ranks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import integrate

from catenary.mbs.build import Operation, make_pantograph
from catenary.mbs.interface import HeadState, Pantograph
from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.contact import ContactWire, Touches
from catenary.solver.equilibrium import Elasticity, Equilibrium
from catenary.solver.model import Model
from catenary.solver.problem import Placement, Problem


class Pantographs:
    """All pantographs of a train.

    Attributes
    ----------
    models : the models on rank 0, empty elsewhere
    contact_force, head_height, wire_height : (n,) after the latest step, rank 0 only
    position : (n,) along the track [m], all ranks
    """

    def __init__(
        self,
        problem: Problem,
        wire: ContactWire,
        nominal_height: Callable[[Placement], float],
        on_this_rank: bool,
    ) -> None:
        train, numerics = problem.train, problem.numerics
        self._wire = wire
        self._start = np.array([train.start - p.behind for p in train.placements])
        self._speed = train.speed
        self._touches = Touches(self.n)
        self.position = self._touches.x
        self.position[:] = self._start
        self.contact_force = np.zeros(self.n)
        self.head_height = np.zeros(self.n)
        self.wire_height = wire.rest_height(self._start)
        self.models: list[Pantograph] = []
        if on_this_rank:
            for placement, height in zip(train.placements, self.wire_height, strict=True):
                operation = Operation(
                    placement.static_force,
                    nominal_height(placement),
                    train.raise_time,
                    numerics.dt,
                    numerics.beta,
                    numerics.gamma,
                )
                model = make_pantograph(placement.data, operation)
                model.place(float(height))
                self.models.append(model)
            self.head_height[:] = self.wire_height

    @property
    def n(self) -> int:
        return int(self._start.size)

    def move_to(self, time: float) -> Touches:
        """Move the contacts to where they are at ``time`` [s]; their places on the wire."""
        np.multiply(self._speed, time, out=self.position)
        self.position += self._start
        self._wire.locate(self._touches)
        return self._touches

    def predict(self, time: float) -> list[HeadState]:
        """Heads at ``time`` as functions of the contact forces. Rank 0 only."""
        return [model.predict(time) for model in self.models]

    def advance(
        self, contact_force: np.ndarray, heads: list[HeadState], wire_height: np.ndarray
    ) -> None:
        """Take the step with these forces and heights. Rank 0 only."""
        self.contact_force[:] = contact_force
        self.wire_height[:] = wire_height
        for i, (model, head) in enumerate(zip(self.models, heads, strict=True)):
            model.advance(float(contact_force[i]))
            self.head_height[i] = head.height - head.height_compliance * contact_force[i]


def nominal_height_rule(
    model: Model, form: Equilibrium, elasticity: Elasticity
) -> Callable[[Placement], float]:
    """Head height at which the static force is defined.

    That of the placement, or else the mean height of the contact wire in the stretch of
    ``elasticity`` when the static force lifts it, so that the base spring neither adds to the
    mean force nor takes from it.
    """
    nodes = model.mesh.wires[CONTACT_WIRE]
    x = elasticity.x
    at_rest = np.interp(x, model.mesh.x(nodes), form.height[nodes])

    def height(placement: Placement) -> float:
        if placement.nominal_height is not None:
            return placement.nominal_height
        lifted = at_rest + placement.static_force * elasticity.lift
        return float(integrate.trapezoid(lifted, x) / (x[-1] - x[0]))

    return height
