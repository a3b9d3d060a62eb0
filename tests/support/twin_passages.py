"""Twin experiments: a march in the place of a measurement, with noise of a known deviation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from mpi4py import MPI

from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
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
    # Longer at both ends by what the filter remembers, and scaled by the spread of a long record.
    margin, spread = int(0.5 / dt), filters.low_pass(rng.normal(size=400_000), dt).std()
    white = rng.normal(size=n + 2 * margin)
    return deviation / spread * filters.low_pass(white, dt)[margin : margin + n]


def write_measurement(
    path: Path,
    scene: Scene,
    rng: np.random.Generator,
    force_noise: float,
    height_noise: float,
    every: int = 5,
) -> None:
    """The passage of a scene as a CSV file: x_m, force_N below 20 Hz and height_mm below 20 Hz,
    with filtered noise [N] and [m]; every so many steps."""
    position, force, height, dt = passage(scene)
    n = len(position)
    rows = np.stack(
        [
            position,
            filters.low_pass(force, dt) + filtered_noise(rng, n, force_noise, dt),
            1e3 * (filters.low_pass(height, dt) + filtered_noise(rng, n, height_noise, dt)),
        ],
        axis=1,
    )[::every]
    lines = [",".join(f"{value:.9g}" for value in row) for row in rows]
    path.write_text("\n".join(["x_m,force_N,height_mm", *lines]) + "\n", encoding="utf-8")
