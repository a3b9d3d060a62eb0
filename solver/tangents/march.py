"""A march with its derivatives by parameters.

A tangent is a motion of the same line by the same factors, with arrays of its own; see
`kernels/tangents/tangents.hpp` for its equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from catenary.base.errors import RunBroken
from catenary.mbs.head.pantograph import SteppedHead
from catenary.solver.contact.pantographs import Pantographs
from catenary.solver.kernels import native
from catenary.solver.kernels.flush_to_zero import flushed
from catenary.solver.model.partition import Ownership
from catenary.solver.schemes.scheme import OneSolve
from catenary.solver.statics.after_incidents import divided_by_mass
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.tangents.lanes import groups_of, lanes_of
from catenary.solver.tangents.set_up import Change, set_up_of
from catenary.solver.time_loop.compiled_steps import CompiledSteps
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.prepared_line import make_room
from catenary.solver.time_loop.views.step_views import Showing


class TangentSteps(CompiledSteps):
    """Takes steps of a scheme, and their derivatives. One rank only.

    Attributes
    ----------
    results : (n_changes, n_steps, 2 n_pantographs + n_arms) derivatives after each step of contact
        forces [N], uplifts [m] and heights of heads [m], per unit of each parameter
    switches : as in `MarchTangents` of `kernels/tangents/tangents.hpp`

    Parameters
    ----------
    changes : of the set-up by each parameter
    others : heads of two further set-ups of the same march
    starts : derivatives of the line's acceleration at the start, (n_local,) each [m/s2 per unit]
    arms : (n_arms,) numbers of the steady arms whose uplift is differentiated
    n_steps : of the march
    """

    def __init__(
        self,
        scheme: OneSolve,
        showing: Showing,
        dt: float,
        changes: Sequence[Change],
        others: Sequence[Sequence[native.LinearStep | SteppedHead]],
        starts: Sequence[np.ndarray],
        arms: np.ndarray,
        n_steps: int,
    ) -> None:
        super().__init__(scheme, showing, dt, shows=True)
        make_room(scheme)
        line, pantographs = scheme.interaction.line, scheme.pantographs
        self.results = np.zeros((len(changes), n_steps, 2 * pantographs.n + arms.size))
        n, first = pantographs.n_contacts, np.zeros(1, dtype=np.int64)
        self.switches = np.zeros(3, dtype=np.int64)

        groups = groups_of(line, changes)
        lanes = lanes_of(
            line,
            [[changes[k] for k in group] for group in groups],
            [[starts[k] for k in group] for group in groups],
        )
        self._tangents = native.MarchTangents(
            [
                native.TangentGroup(own, [_tangent(changes[k], n, self.results[k]) for k in group])
                for own, group in zip(lanes, groups, strict=True)
            ],
            [
                # A linear chain has none.
                [head.stepped for head in heads if isinstance(head, SteppedHead)]
                for heads in zip(*others, strict=True)
            ],
            scheme.interaction.links.local,
            showing.shown.arms[arms],
            first,
            self.switches,
        )

    @property
    def block(self) -> slice:
        """Steps of the latest block in ``rows``."""
        return self._block

    def _prepare(self, step: int, left: int) -> None:
        super()._prepare(step, left)
        self._tangents.first[0] = step

    def _finish(self) -> bool:
        raise RunBroken(
            "the forces of a step are not found by the compiled loop, which its derivatives need"
        )

    def _made(self, parts: native.StepParts, block: native.Block) -> Any:
        return native.TangentSteps(parts, block, self._tangents)


def _tangent(change: Change, n: int, results: np.ndarray) -> native.Tangent:
    """A tangent at the start of a march with n contacts."""
    # Derivatives of the speeds of impact that a Hertzian law starts with [m/s].
    least_speeds = np.full(n, change.hertz[3] if change.hertz.size else 0.0)
    return native.Tangent(
        change.rest,
        native.LinkChange(change.links, change.weights),
        [head._replace(state=head.state.copy()) for head in change.heads],
        change.drives,
        native.LawChange(change.law, change.hertz, least_speeds, np.zeros(n)),
        change.start,
        change.speed,
        results,
    )


_CHANNELS = ("contact_position", "contact_force", "arm_uplift", "head_height")


@dataclass(frozen=True)
class Tangents:
    """A march of n steps, and its derivatives by m parameters.

    Attributes
    ----------
    dt : time step [s]
    position : (n, n_pantographs) along the track [m]
    force : (n, n_pantographs) contact forces [N]
    uplift : (n, n_arms) at the steady arms in the evaluated stretch [m]
    speed : of the train [m/s]
    by_force : (n, m, n_pantographs) derivatives of contact forces per unit of each parameter
    by_uplift : (n, m, n_arms) those of uplifts
    by_position : (n, m, n_pantographs) those of positions [m]
    head_height : (n, n_pantographs) heights of the pan heads above top of rail [m]
    by_head_height : (n, m, n_pantographs) those of these
    open_steps : steps in which a contact carried nothing
    contact_switches : steps in which contacts opened or closed
    link_switches : steps in which droppers slackened or tightened, or other links switched
    """

    dt: float
    position: np.ndarray
    force: np.ndarray
    uplift: np.ndarray
    speed: float
    by_force: np.ndarray
    by_uplift: np.ndarray
    by_position: np.ndarray
    head_height: np.ndarray
    by_head_height: np.ndarray
    open_steps: int
    contact_switches: int
    link_switches: int


def march_with_tangents(comm: Any, at_rest: LineAtRest, changes: Sequence[Change]) -> Tangents:
    """March a line, and differentiate each step. Not collective: one process.

    Parameters
    ----------
    comm : mpi4py communicator
        Communicator of this process alone.
    at_rest : LineAtRest
        Line at rest.
    changes : sequence of Change
        Derivatives of its set-up by each parameter.

    Raises
    ------
    InputError
        If steps of the line need more than the compiled loop.
    RunBroken
        If the march breaks.
    """
    one = set_up_of(comm, at_rest, n_steps=1)
    others = [one.heads, set_up_of(comm, at_rest, n_steps=1, same_line=one).heads]
    with March(comm, *at_rest) as march:
        scheme, showing, dt = march.in_loop()
        line = scheme.interaction.line
        still = line.acceleration.copy()
        starts = [_start_of(comm, at_rest, change, still, line.ownership) for change in changes]
        arms = at_rest.mesh.x(at_rest.mesh.steady_arms)
        first, last = at_rest.problem.evaluation
        evaluated = np.flatnonzero((first <= arms) & (arms <= last))
        steps = TangentSteps(scheme, showing, dt, changes, others, starts, evaluated, march.n_steps)
        columns = [showing.layout.columns[name] for name in _CHANNELS]
        rows: list[list[np.ndarray]] = [[] for _ in columns]
        step = 0
        n = scheme.pantographs.n
        moved = np.array([_moved(change, scheme.pantographs) for change in changes])
        moved = moved.reshape(len(changes), n)
        with flushed():
            while step < march.n_steps:
                left = march.n_steps - step
                steps.take(step, min(steps.most, left), left)
                for kept, part in zip(rows, columns, strict=True):
                    kept.append(steps.rows[steps.block, part].copy())
                step += steps.taken
    position, force, uplift, height = (np.concatenate(kept) for kept in rows)
    found = steps.results.transpose(1, 0, 2)
    time = dt * np.arange(1, len(force) + 1)
    return Tangents(
        dt=dt,
        position=position,
        force=force,
        uplift=uplift[:, evaluated],
        speed=float(at_rest.problem.train.speed),
        by_force=found[..., :n],
        by_uplift=found[..., n:-n],
        by_position=moved + np.outer(time, [change.speed for change in changes])[..., None],
        head_height=height,
        by_head_height=found[..., -n:],
        open_steps=int(steps.switches[0]),
        contact_switches=int(steps.switches[1]),
        link_switches=int(steps.switches[2]),
    )


def _moved(change: Change, pantographs: Pantographs) -> list[float]:
    """Derivatives of the places at which pantographs start [m]."""
    if not change.start.size:
        return [0.0] * pantographs.n
    of_strip, of_pantograph = pantographs.ends
    return [float(change.start[of_strip[first]]) for first in of_pantograph[:-1]]


def _start_of(
    comm: Any, at_rest: LineAtRest, change: Change, acceleration: np.ndarray, ownership: Ownership
) -> np.ndarray:
    """Derivative of the acceleration (n,) of a line at rest by loads: M a' = -M' a."""
    force = np.zeros_like(acceleration)
    if not acceleration.any():
        return force
    for term in change.matrices:
        products = term.weights[2] * term.values * acceleration[term.columns]
        force[term.rows] -= np.add.reduceat(products, term.begin[:-1])
    return divided_by_mass(comm, ownership, at_rest.model, force)
