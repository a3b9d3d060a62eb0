"""Which reading of the open inputs meets most of the paper's statements."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from catenary.cases.ambrosio2012 import statements
from catenary.cases.ambrosio2012.statements import AVERAGE, LIGHT, STD_RATIO, Run, Runs
from catenary.postproc.report.study_report import REPRODUCED, StudyTable


class Judged(NamedTuple):
    """A reading with the statements that it meets and what its runs gave."""

    title: str
    met: Sequence[int]
    parted: int
    of: int
    runs: Runs


def judge(title: str, runs: Runs) -> Judged:
    """What a reading's runs meet; ``parted`` counts the pantographs, each at both dampings,
    whose deviation is on the paper's side of 30 % of the mean."""
    met = [one.number for one in statements.judge(runs) if one.verdict == REPRODUCED]
    light, average = (_ratios(runs, damping) for damping in (LIGHT, AVERAGE))
    parted = sum(ratio > STD_RATIO for ratio in light) + sum(r < STD_RATIO for r in average)
    return Judged(title, met, parted, len(light) + len(average), runs)


def rank(judged: Sequence[Judged]) -> list[Judged]:
    """The best first: by statements met, then by pantographs on the paper's side of 30 %."""
    return sorted(judged, key=lambda one: (len(one.met), one.parted), reverse=True)


def table(ranked: Sequence[Judged]) -> StudyTable:
    """The readings for the report; ``ranked`` as ``rank`` gives them."""
    counts = {n: sum(len(one.met) == n for one in ranked) for n in range(9, -1, -1)}
    spread = ", ".join(f"{many} meet {n}" for n, many in counts.items() if many)
    note = "The reading searched around, and each option of an input in its place ([search] in "
    note += f"study.toml): of {len(ranked)}, {spread}." if ranked else "study.toml): none was run."
    return StudyTable(
        "Search: which reading of the open inputs meets most statements",
        note,
        ["reading", "met", "statements", "on the paper's side of 30 %", "std light [N]",
         "std average [N]", "mean [N]", "loss [%]", "arm uplift [mm]"],
        [_row(one) for one in ranked],
    )  # fmt: skip


def _row(one: Judged) -> list[str]:
    runs = [run for damping in (LIGHT, AVERAGE) for run in _done(one.runs, damping)]
    forces = [force for run in runs for force in run.forces]
    if not forces:
        return [one.title, "0", "", "", "", "", "", "", ""]
    return [
        one.title,
        f"{len(one.met)}",
        ", ".join(map(str, one.met)),
        f"{one.parted} of {one.of}",
        _range([f.std for run in _done(one.runs, LIGHT) for f in run.forces]),
        _range([f.std for run in _done(one.runs, AVERAGE) for f in run.forces]),
        _range([force.mean for force in forces]),
        f"{max(force.loss_percent for force in forces):.1f}",
        f"{1e3 * max(run.uplift for run in runs):.0f}",
    ]


def _range(values: Sequence[float]) -> str:
    return f"{min(values):.0f} to {max(values):.0f}" if values else ""


def _done(runs: Runs, damping: str) -> list[Run]:
    return [run for run in runs.get(damping, {}).values() if run is not None]


def _ratios(runs: Runs, damping: str) -> list[float]:
    return [force.std / force.mean for run in _done(runs, damping) for force in run.forces]
