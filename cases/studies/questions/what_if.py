"""What a change of a scene changes: a run as it is, one with the change, and tables of both."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.cases.process.interrupts import Interrupted
from catenary.cases.scene.input.toml_input import parse_assignment
from catenary.cases.studies.sweep.jobs import Ended, Job, RunOptions, interrupted, make_jobs
from catenary.cases.studies.sweep.run_jobs import run_jobs
from catenary.cases.studies.sweep.variants import Variant, check_keys
from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate.slack_times import slack_times
from catenary.postproc.evaluate.statistics import RunStatistics
from catenary.postproc.read.results import Results
from catenary.postproc.report.study_table import Column, StudyTable

AS_IT_IS, CHANGED = "as_it_is", "changed"
# Arms and droppers are the same ones in both runs where they stand so close [m].
_SAME_PLACE = 1e-6
_OF_FORCE = (
    ("mean", "mean force [N]", 1.0),
    ("std", "standard deviation, 0-20 Hz [N]", 1.0),
    ("std_0_5", "standard deviation, 0-5 Hz [N]", 1.0),
    ("std_5_20", "standard deviation, 5-20 Hz [N]", 1.0),
    ("maximum", "maximum force [N]", 1.0),
    ("minimum", "minimum force [N]", 1.0),
    ("loss_percent", "loss of contact [%]", 1.0),
    ("contact_height_range", "contact point, vertical range [mm]", 1e3),
)


class Differences(NamedTuple):
    """What a change changes, as tables with the columns ``as_it_is``, ``changed``, ``difference``.

    Attributes
    ----------
    case : name of the case
    changes : the assignments
    statistics : of each pantograph, and of the line
    supports : largest uplift at each steady arm that both runs have
    droppers : largest and smallest force, and time slack, of each dropper that both runs have
    criteria : values, limits and verdicts
    remarks : what decides the results, by the name of the run
    """

    case: str
    changes: tuple[str, ...]
    statistics: StudyTable
    supports: StudyTable
    droppers: StudyTable
    criteria: StudyTable
    remarks: dict[str, list[str]]


def jobs_of(case: str, changes: Sequence[str], shortened: bool) -> list[Job]:
    """The two runs, checked.

    Raises
    ------
    InputError
        If nothing is changed, or if a scene is wrong.
    """
    if not changes:
        raise InputError("nothing is changed: give at least one --set key=value")
    for text in changes:
        parse_assignment(text)
    variants = [Variant(AS_IT_IS, ()), Variant(CHANGED, tuple(changes))]
    check_keys(variants, "on the command line (--set)")
    return make_jobs(case, variants, (), shortened)


def run(jobs: Sequence[Job], out: Path, comm: Any, options: RunOptions) -> list[Ended]:
    """Both runs, in folders of their names below ``out``. Collective.

    Raises
    ------
    RunBroken
        If one breaks; ``Interrupted`` if a signal came.
    """
    ended = run_jobs(jobs, out, comm, options)
    if interrupted(ended):
        raise Interrupted("the runs were interrupted; the same command continues them")
    for one in ended:
        if not one.done:
            raise RunBroken(f"the run {one.variant.name} broke: {one.outcome}")
    return ended


def differences(changes: Sequence[str], ended: Sequence[Ended], out: Path) -> Differences:
    """The tables of two runs that are done. Not collective."""
    before, after = ended
    folders = out / before.variant.name, out / after.variant.name
    with Results(folders[0]) as a, Results(folders[1]) as b:
        of_a, of_b = stats.evaluate(a), stats.evaluate(b)
        return Differences(
            str(a.attributes["case"]),
            tuple(changes),
            _statistics(of_a, of_b),
            _supports(of_a, of_b),
            _droppers(a, b, of_a, of_b),
            _criteria(before.summary, after.summary),
            {one.variant.name: one.remarks for one in ended},
        )


def _figures(name: str, first: float, second: float) -> dict[str, Any]:
    """Two values and their difference as columns; None for what is not known."""
    values = {AS_IT_IS: first, CHANGED: second, "difference": second - first}
    return {
        (f"{name}_{key}" if name else key): float(value) if np.isfinite(value) else None
        for key, value in values.items()
    }


def _columns(name: str, head: str, form: str) -> list[Column]:
    begin = f"{name}_" if name else ""
    heads = (f"{head} as it is", "changed", "difference")
    forms = (form, form, f"+{form}")
    keys = (AS_IT_IS, CHANGED, "difference")
    return [Column(begin + key, h.strip(), f) for key, h, f in zip(keys, heads, forms, strict=True)]


def _statistics(a: RunStatistics, b: RunStatistics) -> StudyTable:
    rows: list[dict[str, Any]] = [
        {"of": p.name, "statistic": label}
        | _figures("", factor * getattr(p, name), factor * getattr(q, name))
        for p, q in zip(a.pantographs, b.pantographs, strict=False)
        for name, label, factor in _OF_FORCE
    ]
    of_line = (
        ("largest uplift at arms [mm]", 1e3 * a.supports.maximum, 1e3 * b.supports.maximum),
        ("droppers slackened", a.droppers.n_slackened, b.droppers.n_slackened),
        ("maximum dropper force [N]", a.droppers.maximum, b.droppers.maximum),
        ("minimum dropper force [N]", a.droppers.minimum, b.droppers.minimum),
    )
    rows += [{"of": "line", "statistic": name} | _figures("", *both) for name, *both in of_line]
    columns = [Column("of", "of"), Column("statistic", "statistic"), *_columns("", "", ".2f")]
    return StudyTable(columns, rows, "Statistics")


def _supports(a: RunStatistics, b: RunStatistics) -> StudyTable:
    rows = [
        {"x_m": float(a.supports.x[i]), "evaluated": bool(a.supports.evaluated[i])}
        | _figures("uplift_mm", 1e3 * a.supports.uplift[i], 1e3 * b.supports.uplift[j])
        for i, j in _pairs(a.supports.x, b.supports.x)
    ]
    columns = [Column("x_m", "arm at [m]", ".1f"), *_columns("uplift_mm", "uplift [mm]", ".1f")]
    return StudyTable([*columns, Column("evaluated", "evaluated")], rows, "Uplift by support")


def _droppers(a: Results, b: Results, of_a: RunStatistics, of_b: RunStatistics) -> StudyTable:
    first, second = of_a.droppers, of_b.droppers
    slack = slack_times(a), slack_times(b)
    rows = [
        {"x_m": float(first.x[i]), "evaluated": bool(first.evaluated[i])}
        | _figures("max_N", first.highest[i], second.highest[j])
        | _figures("min_N", first.lowest[i], second.lowest[j])
        | _figures("slack_s", slack[0][i], slack[1][j])
        for i, j in _pairs(first.x, second.x)
    ]
    columns = [
        Column("x_m", "dropper at [m]", ".1f"),
        *_columns("max_N", "largest [N]", ".1f"),
        *_columns("min_N", "least [N]", ".1f"),
        *_columns("slack_s", "slack [s]", ".3f"),
        Column("evaluated", "evaluated"),
    ]
    return StudyTable(columns, rows, "Droppers")


def _pairs(first: np.ndarray, second: np.ndarray) -> list[tuple[int, int]]:
    """Numbers of places that two runs share; of several at one place the n-th ones belong together.

    Parameters
    ----------
    first, second : places along the track [m]
    """
    pairs, taken = [], np.zeros(second.size, dtype=bool)
    for i, x in enumerate(first.tolist()):
        (there,) = np.nonzero((np.abs(second - x) <= _SAME_PLACE) & ~taken)
        if there.size:
            taken[there[0]] = True
            pairs.append((i, int(there[0])))
    return pairs


def _criteria(before: dict[str, Any], after: dict[str, Any]) -> StudyTable:
    second = {row["criterion"]: row for row in after["acceptance"]}
    rows = [
        {
            "criterion": row["criterion"],
            "unit": row["unit"],
            "value_as_it_is": row["value"],
            "limit_as_it_is": row["limit"],
            "verdict_as_it_is": _word(row["passed"]),
            "value_changed": other["value"],
            "limit_changed": other["limit"],
            "verdict_changed": _word(other["passed"]),
        }
        for row in before["acceptance"]
        if (other := second.get(row["criterion"])) is not None
    ]
    columns = [Column("criterion", "criterion")]
    for run_name, words in ((AS_IT_IS, "as it is"), (CHANGED, "changed")):
        columns += [
            Column(f"value_{run_name}", words, ".4g"),
            Column(f"limit_{run_name}", "limit", ".4g"),
            Column(f"verdict_{run_name}", "verdict"),
        ]
    return StudyTable([*columns, Column("unit", "unit")], rows, "Verdicts")


def _word(passed: bool | None) -> str:
    return "not judged" if passed is None else "passed" if passed else "failed"
