"""The equations of motion of a line in the vertical plane, written out once more."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.model.beam import shape_values
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Observer, StepView

_NEVER_LESS = 1e-9  # [N]


class Residual(Observer):
    """Observer of a march without incidents: the largest of what is left of

        M a + C v + K u + sum of s L - sum of f N,    s = T - T' + (1 - r) max(0, -T)

    in terms of the largest sum of the terms' sizes. T is a dropper's tension as if it could push,
    by its curve and with that of its damping which goes with the spring, T' that by its slope at
    rest; f are the recorded contact forces. ``shown_off`` is what droppers' forces are off by
    [N], and ``n_slack`` how often one was slack.
    """

    def __init__(self, rest: LineAtRest) -> None:
        model = rest.model
        self.largest = self.shown_off = 0.0
        self.n_slack = 0
        self._wires = ContactWires(model, rest.form, distribute(model, 1, 0))
        self._matrices = tuple(
            whole_matrix(model, **{name: 1.0}) for name in ("stiffness", "damping", "mass")
        )
        self._ends = model.dofs(model.mesh.droppers)
        self._tension = rest.form.dropper_force
        self._stiffness, self._damping = model.dropper_stiffness, model.dropper_damping
        if rest.problem.slack_dampers_act:
            # Of their damping only what was added for the numbers' sake goes with the spring.
            added = model.released_damping if model.simulated.added_alpha else 0.0
            self._damping = np.broadcast_to(added, self._stiffness.shape)
        slackens = "dropper_slackening" in rest.problem.effects
        self._released = 1.0 - model.simulated.kept_ratio if slackens else 0.0
        self._curves = model.dropper_slopes if slackens and model.droppers_bend else None
        self._held = model.constrained

    def next_state(self, step: int) -> int:
        """Every state."""
        return step + 1

    def observe(self, view: StepView) -> None:
        """Put the state after a step into the equations; rest comes before a step."""
        if view.step == 0:
            return
        state = view.line_state()
        motion = [state[name] for name in ("displacement", "velocity", "acceleration")]
        pairs = list(zip(self._matrices, motion, strict=True))
        left = sum(matrix @ x for matrix, x in pairs)
        size = sum(abs(matrix) @ abs(x) for matrix, x in pairs).max()
        spread, rate = (x[self._ends[:, 0]] - x[self._ends[:, 1]] for x in motion[:2])
        tension = self._tension + self._stiffness * spread + self._damping * rate
        slack = self._released * np.maximum(0.0, -tension)
        if self._curves is not None:
            at = self._curves.stretch_under(self._tension) + spread
            own = self._curves.force_at(at + self._damping / self._stiffness * rate)
            slack = own - tension + self._released * np.maximum(0.0, -own)
        off = np.abs(tension + slack - view.dropper_force).max(initial=0.0)
        self.shown_off = max(self.shown_off, off)
        self.n_slack += np.count_nonzero(tension + slack <= 0.0)
        np.add.at(left, self._ends[:, 0], slack)
        np.subtract.at(left, self._ends[:, 1], slack)
        n = self._wires.n_wires
        force = view.contact_wire_force if n > 1 else view.contact_force
        place = np.repeat(view.contact_position, n)
        touches = self._wires.touches(place, np.arange(place.size) % n)
        dofs = self._wires.dofs[touches["element"][:, None] + np.array([0, 1])]
        pushed = np.reshape(force, (-1, 1)) * touches["whole_value"]
        np.subtract.at(left, dofs.reshape(place.size, -1), pushed)
        left[self._held] = 0.0
        self.largest = max(self.largest, np.abs(left).max() / max(size, _NEVER_LESS))


def residual_of(rest: LineAtRest) -> float:
    """The largest `Residual` of a march on this rank alone."""
    seen = Residual(rest)
    with March(MPI.COMM_SELF, *rest) as march:
        march.run([seen])
    return seen.largest


def press(residual: np.ndarray, model: Model, x: float, force: float) -> None:
    """Take a contact force [N] off a residual, and what holds the anchors."""
    nodes = model.mesh.wires[CONTACT_WIRE]
    places = model.mesh.x(nodes)
    e = int(np.searchsorted(places, x)) - 1
    length = places[e + 1] - places[e]
    own = nodes[e : e + 2]
    unknowns = np.stack([model.dofs(own), model.dofs(own, "theta_y")], axis=1).ravel()
    residual[unknowns] -= force * shape_values((x - places[e]) / length, length)
    residual[model.constrained] = 0.0
