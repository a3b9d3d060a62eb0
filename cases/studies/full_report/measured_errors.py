"""Errors of a run by step and mesh, from an accuracy study of its case."""

from __future__ import annotations

import json
from pathlib import Path

from catenary.base.errors import InputError
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.accuracy.output import RECORD

# Columns of the study's table by the quantities that rule books judge.
_COLUMNS = {
    "mean_force": "error_mean_N",
    "force_std": "error_std_N",
    "force_max": "error_max_N",
    "force_min": "error_min_N",
    "arm_uplift": "error_uplift_mm",
}


def measured_errors(scene: Scene, folder: Path) -> dict[str, float]:
    """Errors of quantities at the step and mesh of a scene, in their units. Not collective.

    Parameters
    ----------
    folder : of the study, which varied step and mesh together (axis ``grid``)

    Raises
    ------
    InputError
        If there is no such study, if it is of another case, or lacks the scene's step and mesh.
    """
    path = folder / RECORD
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        rows, case = record["rows"], record["case"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path} is no record of `catenary accuracy`: {error}") from error
    if case != scene.case.name:
        raise InputError(f"{path} is a study of {case}, the run is one of {scene.case.name}")
    dt, elements = scene.numerics.dt_s, scene.mesh.elements_per_gap
    own = [
        row
        for row in rows
        if row["outcome"] == "done"
        and row["elements_per_gap"] == elements
        and row["dt_s"] is not None
        and abs(row["dt_s"] / dt - 1.0) < 1e-9
    ]
    if not own:
        raise InputError(
            f"{path} has no run with a step of {1e3 * dt:g} ms and {elements} elements per gap, "
            "as this one has: vary both with --axes grid, without --quick"
        )
    known = {quantity: own[0][column] for quantity, column in _COLUMNS.items()}
    return {quantity: abs(error) for quantity, error in known.items() if error is not None}
