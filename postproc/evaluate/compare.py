"""Compares two runs: statistics side by side, and the force histories where their times agree."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate.acceptance import criteria_of, judged_by
from catenary.postproc.evaluate.error_indicators import indicate
from catenary.postproc.evaluate.remarks import all_remarks
from catenary.postproc.evaluate.verdict import Criterion, labels
from catenary.postproc.evaluate.wording import UNCOMPARED, UNCOMPARED_SAYS, counted, fixed
from catenary.postproc.read.records import Records
from catenary.postproc.read.results import Results

_FORCES = (
    ("mean [N]", "mean", 1.0),
    ("standard deviation [N]", "std", 1.0),
    ("  0-5 Hz [N]", "std_0_5", 1.0),
    ("  5-20 Hz [N]", "std_5_20", 1.0),
    ("maximum [N]", "maximum", 1.0),
    ("minimum [N]", "minimum", 1.0),
    ("loss of contact [%]", "loss_percent", 1.0),
    ("contact height range [mm]", "contact_height_range", 1e3),
)


def compare(
    first: Path | str,
    second: Path | str,
    records: tuple[Records | None, Records | None] = (None, None),
) -> str:
    """A table of the differences of two runs, as text. Not collective.

    Parameters
    ----------
    first, second : result folders or files
    records : what ``evaluate.guard`` found in each, None to check it here

    Raises
    ------
    InputError
        If one of them is no result.
    """
    with Results(first, records[0]) as a, Results(second, records[1]) as b:
        return "\n".join([*_heads(a, b), "", *_statistics(a, b), "", _histories(a, b)]) + "\n"


def _heads(a: Results, b: Results) -> list[str]:
    lines = []
    for letter, run in (("A", a), ("B", b)):
        about = run.attributes
        lines.append(
            f"{letter}: {run.path} ({about['case']}, {3.6 * run.fact('speed'):.0f} km/h, "
            f"dt {run.dt:g} s, {counted(about['n_ranks'], 'rank')}, "
            f"{counted(run.n_steps, 'step')}, {run.outcome})"
        )
    for letter, run, other in (("A", a, b), ("B", b, a)):
        alone = _simulated(run) - _simulated(other)
        if alone:
            lines.append(f"only {letter} simulates {', '.join(sorted(alone))}")
    return lines


def _simulated(run: Results) -> set[str]:
    return {name for name, *_ in run.attributes["effects_on"]}


def _statistics(a: Results, b: Results) -> list[str]:
    of_a, of_b = stats.evaluate(a), stats.evaluate(b)
    lines = [f"{'':34}{'A':>14}{'B':>14}{'B - A':>14}"]
    for p, q in zip(of_a.pantographs, of_b.pantographs, strict=False):
        lines.append(p.name if p.name == q.name else f"{p.name} / {q.name}")
        for label, name, factor in _FORCES:
            lines.append(_row("  " + label, factor * getattr(p, name), factor * getattr(q, name)))
    if len(of_a.pantographs) != len(of_b.pantographs):
        lines.append(
            f"A has {counted(len(of_a.pantographs), 'pantograph')}, B has "
            f"{len(of_b.pantographs)}: "
            "only the first are compared."
        )
    lines += [
        "line",
        _row("  max uplift at arms [mm]", 1e3 * of_a.supports.maximum, 1e3 * of_b.supports.maximum),
        _row("  droppers slackened", of_a.droppers.n_slackened, of_b.droppers.n_slackened),
        _row("  max dropper force [N]", of_a.droppers.maximum, of_b.droppers.maximum),
        _row("  min dropper force [N]", of_a.droppers.minimum, of_b.droppers.minimum),
    ]
    lines += _acceptance((a, of_a), (b, of_b))
    said = [
        f"{letter}: {text}"
        for letter, run in (("A", a), ("B", b))
        for text in all_remarks(run, indicate(run))
    ]
    return lines + of_a.complaints + of_b.complaints + a.damage + b.damage + said


_Evaluated = tuple[Results, stats.RunStatistics]
_WORDS = {True: "passed", False: "FAILED", None: "not judged"}


def _acceptance(*runs: _Evaluated) -> list[str]:
    """Every criterion of either run with its value and verdict in both."""
    found = [criteria_of(run, statistics) for run, statistics in runs]
    lines = ["acceptance"]
    for letter, (run, _), criteria in zip("AB", runs, found, strict=True):
        lines.append(f"  {letter} by {judged_by(run, criteria)}")
    columns = [dict(zip(labels(criteria), criteria, strict=True)) for criteria in found]
    every = list(dict.fromkeys(label for column in columns for label in column))
    width = max(map(len, every), default=0)
    for label in every:
        cells = [_judged(column.get(label)) for column in columns]
        lines.append(f"  {label:{width}}{cells[0]:>26}{cells[1]:>26}")
    return [*lines, f"  {UNCOMPARED_SAYS}"]


def _judged(one: Criterion | None) -> str:
    if one is None:
        return "-"
    if one.absent:
        return _WORDS[None]
    mark = "" if one.compared else f" {UNCOMPARED}"
    return f"{fixed(one.value, 2)} {one.unit} {_WORDS[one.passed]}{mark}"


def _row(label: str, first: float, second: float) -> str:
    difference = second - first + 0.0  # which makes no negative zero
    return f"{label:34}{fixed(first, 4):>14}{fixed(second, 4):>14}{difference:14.3e}"


def _histories(a: Results, b: Results) -> str:
    """The largest difference of the unfiltered contact forces, if both have the same times."""
    tolerance = 1e-6 * min(a.dt, b.dt)
    same = a.n_pantographs == b.n_pantographs and a.n_rows("time") == b.n_rows("time")
    if not same or not np.allclose(a.time, b.time, rtol=0, atol=tolerance):
        return "The runs differ in their times or pantographs: force histories are not compared."
    if not a.n_rows("time"):
        return "The runs hold no steps: force histories are not compared."
    largest, at, whose = -1.0, 0, 0
    for p in range(a.n_pantographs):
        difference = np.abs(a.column("contact_force", p) - b.column("contact_force", p))
        step = int(difference.argmax())
        # A difference that is no number is the largest, as ``argmax`` has it.
        if not difference[step] <= largest:
            largest, at, whose = float(difference[step]), step, p
        if np.isnan(largest):
            break
    return (
        f"Largest difference of the contact force histories: {largest:.3e} N "
        f"at t = {a.time_at(at):.4f} s ({a.pantograph_names()[whose]})."
    )
