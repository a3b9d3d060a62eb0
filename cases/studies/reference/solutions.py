"""The reference solutions: configurations, runs at their levels, error bars, and their files.

A configuration is a model at a speed under one or two pantographs. Error bars follow from its runs
at several steps and meshes. The files hold statistics with error bars, forces along the track, and
inputs.
"""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from catenary.base.errors import InputError
from catenary.cases.scene.input.plain_text import plain
from catenary.cases.scene.keys.keys import meant
from catenary.cases.scene.line.line_data import span_lengths
from catenary.cases.scene.load import load_scene
from catenary.cases.scene.scene import Scene, resolved
from catenary.cases.studies.accuracy.analysis import extrapolated_error
from catenary.cases.studies.sweep.jobs import (
    OF_PANTOGRAPH,
    STATISTICS,
    Ended,
    Job,
    all_done,
    statistics_of,
)
from catenary.cases.studies.sweep.variants import Variant
from catenary.postproc.files.csv_text import csv_text
from catenary.postproc.report.study_table import Column, Content

ONE, TWO = "one", "two"
# Nothing but channels of the train is recorded; extremes of the line are kept of every step.
RECORDED = ("output.field_every_s=0", "output.energy_every_s=0", "output.line_channels=[]")
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
DATA = Path(__file__).parent / "data"
STATISTICS_FILE, METADATA_FILE = "statistics.csv", "metadata.json"
PLACE = "place_m"


@dataclass(frozen=True)
class Configuration:
    """A model, a speed and a train.

    Attributes
    ----------
    name : of its files, such as ``ac_simple_275_one``
    model, title : name of the model, and what people call it
    case : the shipped case that has its inputs
    speed : of the train [km/h]
    train : ONE pantograph, or TWO 200 m apart
    assignments : ``key=value`` each, that make it of the case
    data : where the inputs come from, and which of them are ours
    steps : time steps [ms], finest first
    elements : elements between neighbouring droppers, finest first
    grading : how many times longer elements are midway between droppers than beside them
    """

    name: str
    model: str
    title: str
    case: str
    speed: float
    train: str
    assignments: tuple[str, ...]
    data: str
    steps: tuple[float, ...]
    elements: tuple[int, ...]
    grading: float

    @property
    def words(self) -> str:
        """Model, speed and train in words."""
        pantographs = "one pantograph" if self.train == ONE else "two pantographs"
        return f"{self.title}, {self.speed:g} km/h, {pantographs}"

    def scene(self, *further: str) -> Scene:
        """The scene, with further assignments. Not collective."""
        return load_scene(self.case, [*self.assignments, *RECORDED, *further])


@functools.cache
def model_table() -> dict[str, Any]:
    """Models and levels as ``models.toml`` has them. Not collective."""
    return tomllib.loads(Path(__file__).with_name("models.toml").read_text(encoding="utf-8"))


def configurations(names: Sequence[str] = ()) -> list[Configuration]:
    """All configurations, or those of the given names of models or configurations.

    Raises
    ------
    InputError
        If there is none of a name.
    """
    every = list(_every())
    known = [*(one.name for one in every), *dict.fromkeys(one.model for one in every)]
    for name in names:
        if name not in known:
            raise InputError(f"{name} is no reference model or configuration: {meant(name, known)}")
    return [one for one in every if not names or {one.name, one.model} & set(names)]


def _every() -> Iterator[Configuration]:
    levels, meshes = model_table()["levels"], model_table()["meshes"]
    for model in model_table()["models"]:
        for speed in model["speeds_km_h"]:
            for train in (ONE, TWO):
                name = f"{model['name']}_{speed:g}_{train}"
                mesh = {"grading": 1.0, **levels, **meshes.get(name, {})}
                yield Configuration(
                    name,
                    model["name"],
                    model["title"],
                    model["case"],
                    float(speed),
                    train,
                    (f"train.speed_km_h={speed:g}", *(model["pair"] if train == TWO else ())),
                    model["data"],
                    tuple(levels["dt_ms"]),
                    tuple(mesh["elements_per_gap"]),
                    float(mesh["grading"]),
                )


def jobs_of(chosen: Sequence[Configuration]) -> list[Job]:
    """All runs of the configurations; their result files are not kept. Not collective."""
    return [job for one in chosen for job in _jobs(one)]


def run_name(one: Configuration, level: tuple[int, int], further: bool = False) -> str:
    """Name of the run of a configuration, ``one``, at a ``level``, the numbers of its step and
    mesh; ``further`` on along a longer line. Its folder has the same name."""
    name = f"{one.name}__{one.steps[level[0]]:g}ms_{one.elements[level[1]]}"
    return f"{name}_further_on" if further else name


def _jobs(one: Configuration) -> Iterator[Job]:
    scene, spans = one.scene(), model_table()["levels"]["further_spans"]
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


def statistics_of_solution(one: Configuration, ended: Mapping[str, Ended]) -> list[dict[str, Any]]:
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


def files_of(chosen: Sequence[Configuration], ended: Sequence[Ended]) -> dict[str, Content]:
    """The solutions of some configurations. Not collective.

    Parameters
    ----------
    chosen : configurations
    ended : all runs of ``jobs_of``

    Raises
    ------
    RunBroken
        If a run broke.
    """
    runs = all_done(ended)
    rows = [row for one in chosen for row in statistics_of_solution(one, runs)]
    content: dict[str, Content] = {STATISTICS_FILE: rows, METADATA_FILE: _metadata(chosen)}
    for one in chosen:
        content[f"{one.name}.csv"] = _forces(one, runs[run_name(one, FINEST)])
    return content


def _metadata(chosen: Sequence[Configuration]) -> dict[str, Any]:
    """Licence, filter, and inputs of configurations, all keys of their scenes."""
    described = {
        one.name: {
            "title": one.words,
            "data": one.data,
            "case": one.case,
            "assignments": list(one.assignments),
            "dt_ms": one.steps[0],
            "elements_per_gap": one.elements[0],
            "grading": one.grading,
            "scene": resolved(one.scene()),
        }
        for one in chosen
    }
    return {
        "licence": "CC-BY-4.0",
        "catenary": version("catenary"),
        "further_spans": model_table()["levels"]["further_spans"],
        "filter": "low-pass of EN 50317: Butterworth of order 6, 20 Hz, zero phase",
        "configurations": described,
    }


def _forces(one: Configuration, run: Ended) -> str:
    """Force below 20 Hz of each pantograph at places of the evaluated stretch, as CSV."""
    evaluation = one.scene().evaluation
    histories = np.array(run.measured["histories"]).T
    places = np.linspace(evaluation.from_m, evaluation.to_m, len(histories))
    names = [pantograph["name"] for pantograph in run.summary["pantographs"]]
    heads = [PLACE, *(f"{name}_N" for name in names)]
    rows: list[list[Any]] = [
        [f"{place:.2f}", *(f"{value:.3f}" for value in values)]
        for place, values in zip(places, histories, strict=True)
    ]
    return csv_text(heads, rows)


@dataclass(frozen=True)
class Solution:
    """A reference solution.

    Attributes
    ----------
    configuration : of line and train
    figures : value and error bar by place of the pantograph, or LINE, and quantity, in its unit
    place : (n,) equidistant along the evaluated stretch [m]
    forces : (n,) below 20 Hz by place of the pantograph [N]
    """

    configuration: Configuration
    figures: Mapping[tuple[str, str], tuple[float, float]]
    place: np.ndarray
    forces: Mapping[str, np.ndarray]

    @property
    def stretch(self) -> tuple[float, float]:
        """Begin and end of the evaluated stretch [m]."""
        return float(self.place[0]), float(self.place[-1])


def read_solution(name: str) -> Solution:
    """The shipped solution of a configuration. Not collective.

    Raises
    ------
    InputError
        If there is no configuration of that name.
    """
    one = next((own for own in configurations() if own.name == name), None)
    if one is None:
        hint = meant(name, [own.name for own in configurations()])
        raise InputError(f"{plain(name, 100)} is no reference configuration: {hint}")
    rows = pd.read_csv(DATA / STATISTICS_FILE)
    rows = rows[rows["configuration"] == name]
    figures = {
        (row.of, row.quantity): (float(row.value), float(row.error_bar))
        for row in rows.itertuples()
    }
    table = pd.read_csv(DATA / f"{name}.csv")
    forces = {
        head.removesuffix("_N"): table[head].to_numpy() for head in table.columns if head != PLACE
    }
    return Solution(one, figures, table[PLACE].to_numpy(), forces)
