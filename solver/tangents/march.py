"""A march with its derivatives by parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from catenary.solver.kernels.flush_to_zero import flushed
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.tangents.set_up import Change
from catenary.solver.tangents.tangent_steps import TangentSteps
from catenary.solver.time_loop.march import March

_CHANNELS = ("contact_position", "contact_force", "arm_uplift")


@dataclass(frozen=True)
class Tangents:
    """A march of n steps, and its derivatives by m parameters.

    Attributes
    ----------
    dt : time step [s]
    position : (n, n_pantographs) along the track [m]
    force : (n, n_pantographs) contact forces [N]
    uplift : (n, n_arms) at steady arms [m]
    arm_x : (n_arms,) places of these [m]
    by_force : (n, m, n_pantographs) derivatives of contact forces per unit of each parameter
    by_uplift : (n, m, n_arms) those of uplifts
    open_steps : steps in which a contact carried nothing
    contact_switches : steps in which contacts opened or closed
    link_switches : steps in which droppers slackened or tightened, or other links switched
    """

    dt: float
    position: np.ndarray
    force: np.ndarray
    uplift: np.ndarray
    arm_x: np.ndarray
    by_force: np.ndarray
    by_uplift: np.ndarray
    open_steps: int
    contact_switches: int
    link_switches: int


def march_with_tangents(comm: Any, at_rest: LineAtRest, changes: Sequence[Change]) -> Tangents:
    """March a line, and differentiate each step. Not collective: one process.

    Parameters
    ----------
    comm : mpi4py communicator of this process alone
    at_rest : the line
    changes : derivatives of its set-up by each parameter

    Raises
    ------
    InputError
        If steps of the line need more than the compiled loop.
    RunBroken
        If the march breaks.
    """
    with March(comm, *at_rest) as march:
        scheme, showing, dt = march.in_loop()
        steps = TangentSteps(scheme, showing, dt, changes)
        columns = [showing.layout.columns[name] for name in _CHANNELS]
        rows: list[list[np.ndarray]] = [[] for _ in columns]
        results, step = [], 0
        with flushed():
            while step < march.n_steps:
                left = march.n_steps - step
                steps.take(step, min(steps.most, left), left)
                for kept, part in zip(rows, columns, strict=True):
                    kept.append(steps.rows[steps.block, part].copy())
                results.append(steps.results[steps.block].copy())
                step += steps.taken
        arms = at_rest.mesh.x(at_rest.mesh.steady_arms)
    position, force, uplift = (np.concatenate(kept) for kept in rows)
    found, n = np.concatenate(results), force.shape[1]
    switches = steps.switches.tolist()
    return Tangents(dt, position, force, uplift, arms, found[..., :n], found[..., n:], *switches)
