"""The state of a tensioned end at rest: whether its wheel stands, turns, or is at a stop."""

from __future__ import annotations

import numpy as np

from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.wire_ends import WireEnd

# Forces that are one [N].
_TINY = 1e-6


class TensionedEnd:
    """A tensioned end: whether its wheel stands, turns at an edge of its band, or is at a stop.

    Attributes
    ----------
    end : WireEnd
    unknown : number of its place along the track
    pull : force that the tensioner has while it turns, None while the end is held [N]
    held_at : place outwards at which it is held otherwise [m]
    """

    def __init__(self, model: Model, end: WireEnd) -> None:
        tensioner, wire = model.simulated.tensioner, model.problem.line.wire(end.wire)
        assert tensioner is not None
        self.end, self._travel = end, tensioner.travel
        self.unknown = int(model.dofs(np.array([end.node]), "u")[0])
        self._low, self._high = tensioner.band(end.wire, wire, model.problem.gravity)
        pairs = model.mesh.elements(end.wire)
        self._element = int(np.flatnonzero((pairs == end.node).any(axis=1))[0])
        self._installed = float(wire.tension_at(model.mesh.x(pairs[self._element]).mean()))
        self.pull = wire.tension if tensioner.turns else None
        self.held_at = 0.0

    def changes(self, form: Equilibrium) -> bool:
        """Go over to the state that follows at this rest; returns whether it is another one."""
        before = self.pull, self.held_at
        outwards = self.end.outwards * float(form.along[self.end.node])
        tension = self._installed + form.gained_tension[self.end.wire][self._element]
        if self.pull is None:
            # A stop takes up what the weights pull more, and keeps what the wire pulls more.
            if tension < self._low - _TINY and self.held_at <= 0.0:
                self.pull = self._low
            elif tension > self._high + _TINY and self.held_at >= 0.0:
                self.pull = self._high
        elif self._travel is not None and abs(outwards) > self._travel:
            self.held_at = float(np.copysign(self._travel, outwards))
            self.pull = None
        return (self.pull, self.held_at) != before
