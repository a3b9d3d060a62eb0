"""Integration of a multibody system with variable step, by SciPy: the reference for faster ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from body_mechanics import from_vector
from constraint_handling import ConstraintHandling, project
from scipy.integrate import solve_ivp

from catenary import RunBroken
from catenary.mbs.rigid.bodies import Motion
from catenary.mbs.rigid.system import System


class Trajectory(NamedTuple):
    """Motions at ``times`` (n_t,) [s], and how well the constraints were kept on the way.

    ``position_error`` [m, cosine] and ``velocity_error`` (n_t,): largest errors of a joint's rows
    before a correction at that time; ``norm_error`` (n_t,): of the Euler parameters' norms.
    """

    times: np.ndarray
    motions: tuple[Motion, ...]
    position_error: np.ndarray
    velocity_error: np.ndarray
    norm_error: np.ndarray
    n_evaluations: int


def integrate(
    system: System,
    handling: ConstraintHandling,
    start: Motion,
    times: Sequence[float] | np.ndarray,
    method: str = "DOP853",
    rtol: float = 1e-9,
    atol: float = 1e-10,
    correct: bool = True,
) -> Trajectory:
    """Integrate from ``start`` at ``times[0]`` and keep the motions at all ``times``.

    Not collective. At each of the times Euler parameters are normalised and the integration starts
    anew, which costs a multistep method its order for a moment.

    Parameters
    ----------
    times : ndarray, shape (n_t,) [s], growing
    method : a method of ``scipy.integrate.solve_ivp``
    rtol, atol : its tolerances for positions [m], Euler parameters, velocities [m/s, rad/s]
    correct : project positions and velocities on the joints at each of the times

    Raises
    ------
    InputError
        The start does not satisfy the joints and cannot be assembled.
    RunBroken
        The integration cannot go on.
    """
    at = np.asarray(times, dtype=float)
    motion = project(system, start, at[0]) if correct else start
    motions, errors, n_evaluations = [motion], [(0.0, 0.0, 0.0)], 0
    # A run without correction starts from the given state.
    errors[0] = _errors(system, motion, motion.to_vector(), at[0])
    first_step: float | None = None
    for begin, end in zip(at[:-1], at[1:], strict=True):
        handling.begin(system, motion, begin)
        pattern = motion

        def rates(time: float, state: np.ndarray, pattern: Motion = pattern) -> np.ndarray:
            return handling.rates(system, from_vector(pattern, state), time)

        span = end - begin
        result = solve_ivp(
            rates,
            (begin, end),
            motion.to_vector(),
            method=method,
            rtol=rtol,
            atol=atol,
            first_step=None if first_step is None else min(first_step, span),
        )
        n_evaluations += int(result.nfev)
        if not result.success:
            raise RunBroken(
                f"The multibody integration ends at {result.t[-1]:g} s: {result.message}"
            )
        # The last step was cut off at the end of the interval.
        first_step = float(np.diff(result.t).max())
        state = result.y[:, -1]
        motion = from_vector(motion, state)
        errors.append(_errors(system, motion, state, end))
        if correct:
            motion = project(system, motion, end)
        motions.append(motion)
    position_error, velocity_error, norm_error = np.array(errors).T
    return Trajectory(at, tuple(motions), position_error, velocity_error, norm_error, n_evaluations)


def _errors(
    system: System, motion: Motion, state: np.ndarray, time: float
) -> tuple[float, float, float]:
    """Largest errors of positions, velocities and norms of Euler parameters."""
    parameters = state[: 7 * motion.n_bodies].reshape(-1, 7)[:, 3:]
    norm_error = float(np.abs(np.linalg.norm(parameters, axis=1) - 1.0).max())
    if not system.joints:
        return 0.0, 0.0, norm_error
    rows = system.constraints(motion, time)
    return float(np.abs(rows.value).max()), float(np.abs(rows.rate).max()), norm_error
