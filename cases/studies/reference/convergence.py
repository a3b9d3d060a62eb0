"""Runs of the reference solutions at their levels, and the error bars that follow from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from catenary.cases.scene.line.line_data import span_lengths
from catenary.cases.studies.accuracy.analysis import extrapolated_error
from catenary.cases.studies.reference.configurations import Configuration, table
from catenary.cases.studies.sweep.jobs import OF_PANTOGRAPH, STATISTICS, Ended, Job
from catenary.cases.studies.sweep.variants import Variant
from catenary.postproc.report.study_table import Column

FINEST, FURTHER = "finest", "further_on"
# By name of a level, how much coarser step and mesh are than the finest ones: places in the lists
# of models.toml.
_LEVELS = {FINEST: (0, 0), "step_2": (1, 0), "step_4": (2, 0), "mesh_2": (0, 1), "mesh_4": (0, 2)}
STEP_CHAIN, MESH_CHAIN = (FINEST, "step_2", "step_4"), (FINEST, "mesh_2", "mesh_4")
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


def run_name(configuration: Configuration, level: str) -> str:
    """The name of the run of a level, and of its folder."""
    return f"{configuration.name}__{level}"


def _jobs(one: Configuration) -> list[Job]:
    levels = table()["levels"]
    own: dict[str, list[str]] = {}
    for name, (step, mesh) in _LEVELS.items():
        dt, elements = levels["dt_ms"][step], levels["elements_per_gap"][mesh]
        own[name] = [f"numerics.dt_s={1e-3 * dt:g}", f"mesh.elements_per_gap={elements}"]
    scene, spans = one.scene(), levels["further_spans"]
    further = spans * span_lengths(scene.line)[0]
    own[FURTHER] = [
        *own[MESH_CHAIN[2]],
        f"line.n_spans={scene.line.n_spans + spans}",
        f"evaluation.from_m={scene.evaluation.from_m + further:g}",
        f"evaluation.to_m={scene.evaluation.to_m + further:g}",
    ]
    return [
        Job(Variant(run_name(one, name), tuple(words)), one.scene(*words), keep_results=False)
        for name, words in own.items()
    ]


def figures_of(summary: Mapping[str, Any]) -> dict[tuple[str, str], float]:
    """Figures of a run by place of the pantograph, or ``LINE``, and name of the quantity.

    Parameters
    ----------
    summary : content of ``summary.json``
    """
    found = {
        (one["name"], column.name): float(one[column.name])
        for one in summary["pantographs"]
        for column in OF_FORCE
    }
    found[LINE, UPLIFT] = float(summary["supports"][UPLIFT])
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
    runs = {name: ended[run_name(one, name)] for name in (*_LEVELS, FURTHER)}
    of = {name: figures_of(run.summary) for name, run in runs.items()}
    rows = []
    for (place, quantity), value in of[FINEST].items():
        bars = []
        for chain in (STEP_CHAIN, MESH_CHAIN):
            fine, middle, coarse = (of[name][place, quantity] for name in chain)
            bars.append(extrapolated_error(abs(middle - fine), abs(coarse - middle)))
        start = of[FURTHER][place, quantity] - of[MESH_CHAIN[2]][place, quantity]
        rows.append(_row(one, place, quantity, value, bars, start))
    for number, pantograph in enumerate(runs[FINEST].summary["pantographs"]):
        bars = []
        for chain in (STEP_CHAIN, MESH_CHAIN):
            fine, middle, coarse = (
                np.array(runs[name].measured["histories"][number]) for name in chain
            )
            near, far = rms(middle - fine), rms(coarse - middle)
            bars.append(extrapolated_error(near, far))
        rows.append(_row(one, pantograph["name"], HISTORY, 0.0, bars, None))
    return rows


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
