"""How long after the leading pantograph the trailing one comes, in periods of the ringing spans.

A span that has been passed rings in the line's first modes; their frequencies lie close together,
one for each span, so that the ringing stays where it is and meets the trailing pantograph there.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.sparse import linalg as sparse_linalg

from catenary.cases.ambrosio2012.statements import DAMPINGS, SINGLE, Run, Runs
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.postproc.report.study_report import StudyTable
from catenary.solver.model.matrices import stiffness_matrix, whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.statics.form_finding.equilibrium import find_form


class Band(NamedTuple):
    """Lowest and highest frequency of the first modes [Hz]."""

    lowest: float
    highest: float


def first_band(model: Model, n_modes: int) -> Band:
    """Frequencies of the lowest ``n_modes`` modes of a line, undamped and with all droppers taut.

    Not collective. From K x = omega^2 M x on the unknowns that are not held.
    """
    free = np.setdiff1d(np.arange(model.n_dofs), model.constrained)
    mass = whole_matrix(model, mass=1.0)
    stiffness = stiffness_matrix(model)
    squares = sparse_linalg.eigsh(
        stiffness[free][:, free].tocsc(),
        n_modes,
        mass[free][:, free].tocsc(),
        sigma=0.0,
        return_eigenvectors=False,
    )
    frequencies = np.sqrt(squares) / (2.0 * np.pi)
    return Band(float(frequencies.min()), float(frequencies.max()))


def band_of(scene: Scene) -> Band:
    """The band of a scene's running spans, one mode each; shorter transition spans lie above."""
    problem = problem_of(scene)
    model, _ = find_form(problem, mesh_of(scene))
    line = problem.line
    return first_band(model, line.n_spans - sum(line.n_transition))


def table(readings: Mapping[str, tuple[Band, Runs]]) -> StudyTable:
    """Delay of the trailing pantograph in periods, and its deviation beside the single one's."""
    rows = []
    for title, (band, runs) in readings.items():
        trains = {
            name: run.separation
            for damping in DAMPINGS
            for name, run in runs[damping].items()
            if run is not None and run.separation is not None
        }
        for name, separation in trains.items():
            some = next(run for d in DAMPINGS if (run := runs[d].get(name)) is not None)
            delay = separation / some.train_speed
            rows.append([
                title, f"{band.lowest:.2f} to {band.highest:.2f}", name, f"{delay:.2f}",
                f"{delay * band.lowest:.2f} to {delay * band.highest:.2f}",
                *(_ratio(runs[damping].get(name), runs[damping].get(SINGLE))
                  for damping in DAMPINGS),
            ])  # fmt: skip
    return StudyTable(
        "Which separation is critical",
        "A span rings in the first modes after the leading pantograph has passed. The trailing one "
        "comes after so many periods; its standard deviation is so many times the single one's.",
        ["reading", "first modes [Hz]", "train", "delay [s]", "delay [periods]",
         "deviation / single, light", "average"],
        rows,
    )  # fmt: skip


def _ratio(pair: Run | None, single: Run | None) -> str:
    if pair is None or single is None:
        return "-"
    return f"{pair.forces[-1].std / single.forces[0].std:.2f}"
