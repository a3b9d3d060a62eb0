"""Twin experiments: a march in the place of a measurement, with noise of a known deviation."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from mpi4py import MPI
from scenes import Scene, mesh_of, problem_of

from catenary.postproc.evaluate import filters
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.tangents.march import march_with_tangents


def passage(scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Places [m], forces [N] and heights of the head [m] of the first pantograph in all steps
    (n,), and the time step [s]."""
    rest = line_at_rest(problem_of(scene), mesh_of(scene))
    marched = march_with_tangents(MPI.COMM_SELF, rest, [])
    return (
        marched.position[:, 0], marched.force[:, 0], marched.head_height[:, 0], marched.dt
    )  # fmt: skip


def filtered_noise(rng: np.random.Generator, n: int, deviation: float, dt: float) -> np.ndarray:
    """Noise (n,) below 20 Hz of this deviation, from white noise through the filter."""
    margin = int(0.5 / dt)  # what the filter remembers, at both ends
    white = rng.normal(size=n + 2 * margin)
    return deviation / _left_of_one(dt) * filters.low_pass(white, dt)[margin : margin + n]


@cache
def _left_of_one(dt: float) -> float:
    """What the filter leaves of a deviation of one: the norm of its impulse response."""
    impulse = np.zeros(2 * int(0.5 / dt) + 1)
    impulse[impulse.size // 2] = 1.0
    return float(np.linalg.norm(filters.low_pass(impulse, dt)))


def write_measurement(
    path: Path,
    scene: Scene,
    rng: np.random.Generator,
    force_noise: float,
    height_noise: float,
    *,
    is_filtered: bool = True,
) -> None:
    """The passage of a scene as a CSV file, every 5 steps: x_m, force_N, height_mm.

    Values and noise [N] and [m] are below 20 Hz, or, if they are not filtered, the noise of samples
    is independent.
    """
    position, force, height, dt = passage(scene)
    n = len(position)

    def measured(values: np.ndarray, noise: float) -> np.ndarray:
        if is_filtered:
            return filters.low_pass(values, dt) + filtered_noise(rng, n, noise, dt)
        return values + noise * rng.normal(size=n)

    columns = [position, measured(force, force_noise), 1e3 * measured(height, height_noise)]
    rows = np.stack(columns, axis=1)[::5]
    lines = [",".join(f"{value:.9g}" for value in row) for row in rows]
    path.write_text("\n".join(["x_m,force_N,height_mm", *lines]) + "\n", encoding="utf-8")
