"""The reference solutions as files: statistics with error bars, forces along the track, inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from catenary.base.errors import InputError
from catenary.cases.scene.input.plain_text import plain
from catenary.cases.scene.keys.keys import meant
from catenary.cases.scene.problem import resolved
from catenary.cases.studies.reference.configurations import Configuration, configurations, table
from catenary.cases.studies.reference.convergence import FINEST, run_name, statistics
from catenary.cases.studies.sweep.jobs import Ended, all_done
from catenary.postproc.files.csv_text import csv_text
from catenary.postproc.report.study_table import Content

DATA = Path(__file__).parent / "data"
STATISTICS, METADATA = "statistics.csv", "metadata.json"
PLACE = "place_m"


def files_of(chosen: Sequence[Configuration], ended: Sequence[Ended]) -> dict[str, Content]:
    """The solutions of some configurations. Not collective.

    Parameters
    ----------
    chosen : configurations
    ended : all runs of ``convergence.jobs_of``

    Raises
    ------
    RunBroken
        If a run broke.
    """
    runs = all_done(ended)
    rows = [row for one in chosen for row in statistics(one, runs)]
    content: dict[str, Content] = {STATISTICS: rows, METADATA: _metadata(chosen)}
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
        "further_spans": table()["levels"]["further_spans"],
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


def read(name: str) -> Solution:
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
    rows = pd.read_csv(DATA / STATISTICS)
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
