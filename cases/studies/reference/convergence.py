"""Runs of the reference solutions at their levels, and the error bars that follow from them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from catenary.cases.scene.line.line_data import span_lengths
from catenary.cases.studies.accuracy.analysis import extrapolated_error
from catenary.cases.studies.reference.configurations import Configuration, table
from catenary.cases.studies.sweep.jobs import (
    OF_PANTOGRAPH,
    STATISTICS,
    Ended,
    Job,
    statistics_of,
)
from catenary.cases.studies.sweep.variants import Variant
from catenary.postproc.report.study_table import Column

# Levels as places in a configuration's lists of steps and meshes, and the chains of three that have
# one of the two alike.
FINEST = (0, 0)
STEP_CHAIN, MESH_CHAIN = (FINEST, (1, 0), (2, 0)), (FINEST, (0, 1), (0, 2))
_LEVELS = (*STEP_CHAIN, *MESH_CHAIN[1:])
LINE, UPLIFT, HISTORY = "line", "max_uplift_mm", "force_history_N"
# Figures of a solution: of each pantograph, and of the line.
OF_FORCE = tuple(column for column in OF_PANTOGRAPH if column.name != "arcing_percent")
OF_LINE = (
    STATISTICS[UPLIFT],
    Column("elasticity_max_mm_per_N", meaning="largest elasticity in a span [mm/N]"),
    Column("elasticity_min_mm_per_N", meaning="smallest elasticity in a span [mm/N]"),
)
QUANTITIES = {
    column.name: column
    for column in (
        *OF_FORCE,
        *OF_LINE,
        Column(HISTORY, meaning="rms difference of the force, 0-20 Hz [N]"),
    )
}


def jobs_of(chosen: Sequence[Configuration]) -> list[Job]:
    """All runs of the configurations; their result files are not kept. Not collective."""
    return [job for one in chosen for job in _jobs(one)]


def run_name(one: Configuration, level: tuple[int, int], further: bool = False) -> str:
    """Name of the run of a configuration, ``one``, at a ``level``, the numbers of its step and
    mesh; ``further`` on along a longer line. Its folder has the same name."""
    name = f"{one.name}__{one.steps[level[0]]:g}ms_{one.elements[level[1]]}"
    return f"{name}_further_on" if further else name


def _jobs(one: Configuration) -> Iterator[Job]:
    scene, spans = one.scene(), table()["levels"]["further_spans"]
    way = spans * span_lengths(scene.line)[0]
    moved = (
        f"line.n_spans={scene.line.n_spans + spans}",
        f"evaluation.from_m={scene.evaluation.from_m + way:g}",
        f"evaluation.to_m={scene.evaluation.to_m + way:g}",
    )
    for level, further in (*((level, False) for level in _LEVELS), (MESH_CHAIN[2], True)):
        words = (
            f"numerics.dt_s={1e-3 * one.steps[level[0]]:g}",
            f"mesh.elements_per_gap={one.elements[level[1]]}",
            f"mesh.grading={one.grading:g}",
            *(moved if further else ()),
        )
        variant = Variant(run_name(one, level, further), words)
        yield Job(variant, one.scene(*words), keep_results=False)


def figures_of(summary: Mapping[str, Any]) -> dict[tuple[str, str], float]:
    """Figures of a run by place of the pantograph, or ``LINE``, and name of the quantity.

    Parameters
    ----------
    summary : content of ``summary.json``
    """
    rows = statistics_of(summary)
    found = {
        (row["pantograph"], column.name): float(row[column.name])
        for row in rows
        for column in OF_FORCE
    }
    found[LINE, UPLIFT] = float(rows[0][UPLIFT])
    for which in ("max", "min"):
        elasticity = summary["static"]["elasticity_mm_per_N"][which]
        found[LINE, f"elasticity_{which}_mm_per_N"] = float(elasticity)
    return found


def statistics(one: Configuration, ended: Mapping[str, Ended]) -> list[dict[str, Any]]:
    """Rows of the finest run's figures with their error bars.

    ``error_bar`` is the sum of those of step and mesh, grid convergence indices of three runs each
    (``accuracy.analysis.extrapolated_error``). ``change_further_on`` is no error: by how much the
    figure changes where the train has run ``further_spans`` further from its start.

    Parameters
    ----------
    ended : runs by name, all done
    """
    runs = {level: ended[run_name(one, level)] for level in _LEVELS}
    of = {level: figures_of(run.summary) for level, run in runs.items()}
    moved = figures_of(ended[run_name(one, MESH_CHAIN[2], further=True)].summary)
    rows = []
    for (place, quantity), value in of[FINEST].items():
        bars = _bars({level: np.array([own[place, quantity]]) for level, own in of.items()})
        start = moved[place, quantity] - of[MESH_CHAIN[2]][place, quantity]
        rows.append(_row(one, place, quantity, value, bars, start))
    for number, pantograph in enumerate(runs[FINEST].summary["pantographs"]):
        bars = _bars(
            {level: np.array(run.measured["histories"][number]) for level, run in runs.items()}
        )
        rows.append(_row(one, pantograph["name"], HISTORY, 0.0, bars, None))
    return rows


def _bars(values: Mapping[tuple[int, int], np.ndarray]) -> list[float]:
    """Errors of step and mesh of (n,) values of the finest level, as their rms."""
    found = []
    for fine, middle, coarse in (STEP_CHAIN, MESH_CHAIN):
        near, far = rms(values[middle] - values[fine]), rms(values[coarse] - values[middle])
        found.append(extrapolated_error(near, far))
    return found


def rms(values: np.ndarray) -> float:
    """Root of the mean square of (n,) values, in their unit."""
    return float(np.sqrt(np.mean(values**2)))


def _row(
    one: Configuration,
    place: str,
    quantity: str,
    value: float,
    bars: Sequence[float],
    start: float | None,
) -> dict[str, Any]:
    found: dict[str, Any] = {
        "value": value,
        "error_bar": sum(bars),
        "error_of_step": bars[0],
        "error_of_mesh": bars[1],
        "change_further_on": start,
    }
    rounded = {name: None if number is None else round(number, 6) for name, number in found.items()}
    return {"configuration": one.name, "of": place, "quantity": quantity, **rounded}
