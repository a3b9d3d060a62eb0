"""Differences by a change of a scene: a run as it is, one with the change, and tables of both."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import parse_assignment
from catenary.cases.studies.sweep.jobs import (
    OF_LINE,
    OF_PANTOGRAPH,
    Ended,
    Job,
    RunOptions,
    all_done,
    all_ended,
    make_jobs,
    statistics_of,
)
from catenary.cases.studies.sweep.run_jobs import run_jobs
from catenary.cases.studies.sweep.variants import Variant, check_keys
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate.statistics import slack_times
from catenary.postproc.files.disk import plain
from catenary.postproc.read.results import Results
from catenary.postproc.report.page import Picture, Section, Text, page
from catenary.postproc.report.pictures import along_track, figures
from catenary.postproc.report.study_table import Column, Content, StudyTable, remark_lines

AS_IT_IS, CHANGED, DIFFERENCE = "as_it_is", "changed", "difference"
WORDS = {AS_IT_IS: "as it is", CHANGED: "changed"}
PAGE = "what_if.html"
_FORCE, _UPLIFT = "force", "uplift"
_MOST_CHANGED = 3  # arms and droppers named on a terminal
_VERDICTS = {None: "not judged", True: "passed", False: "failed"}
_ABSENT = "no such criterion"  # such as of a second pantograph
# Arms and droppers are the same ones in both runs where they stand so close [m].
_SAME_PLACE = 1e-6


class Differences(NamedTuple):
    """Differences by a change.

    Attributes
    ----------
    case : name of the case
    changes : the assignments
    tables : by name, with the columns ``as_it_is``, ``changed`` and ``difference``: statistics,
        verdicts, and of each steady arm and dropper that both runs have
    remarks : sentences on each run that bear on its results, by its name
    """

    case: str
    changes: tuple[str, ...]
    tables: dict[str, StudyTable]
    remarks: dict[str, list[str]]


def jobs_of(case: str, changes: Sequence[str], shortened: bool) -> list[Job]:
    """The two runs of a case, checked: as it is, and with ``changes``, assignments ``key=value``.

    Both are ``shortened`` by the case's ``[test]`` table if that is asked for.

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
    """Make both runs of ``jobs``, in folders of their names below ``out``. Collective.

    Raises
    ------
    RunBroken
        If one breaks; ``Interrupted`` if a signal came.
    """
    return list(all_done(all_ended(run_jobs(jobs, out, comm, options))).values())


def differences(changes: Sequence[str], ended: Sequence[Ended], out: Path) -> Differences:
    """Tables of the differences of two runs, before and after ``changes``. Not collective.

    ``ended`` says how both ended, which must be done; their folders lie in ``out``.
    """
    before, after = ended
    folders = out / before.variant.name, out / after.variant.name
    with Results(folders[0]) as a, Results(folders[1]) as b:
        of_a, of_b = stats.evaluate(a), stats.evaluate(b)
        arms, droppers = (of_a.supports, of_b.supports), (of_a.droppers, of_b.droppers)
        of_arms = [(Column("uplift_mm", "uplift [mm]", ".1f"), [1e3 * one.uplift for one in arms])]
        of_droppers = [
            (Column("max_N", "largest [N]", ".1f"), [one.highest for one in droppers]),
            (Column("min_N", "least [N]", ".1f"), [one.lowest for one in droppers]),
            (Column("slack_s", "slack [s]", ".3f"), [slack_times(a), slack_times(b)]),
        ]
        return Differences(
            str(a.attributes["case"]),
            tuple(changes),
            {
                "statistics": _statistics(before.summary, after.summary),
                "verdicts": _criteria(before.summary, after.summary),
                "supports": _by_place("Uplift by support", "arm", *arms, of_arms),
                "droppers": _by_place("Droppers", "dropper", *droppers, of_droppers),
            },
            {one.variant.name: one.remarks for one in ended},
        )


def _columns(name: str, head: str, form: str) -> list[Column]:
    """The columns of a figure as it is, changed, and of the difference."""
    heads = (f"{head} as it is".strip(), "changed", "difference")
    forms = (form, form, f"+{form}")
    keys = (_key(name, one) for one in (AS_IT_IS, CHANGED, DIFFERENCE))
    return [Column(*one) for one in zip(keys, heads, forms, strict=True)]


def _figures(name: str, first: float | None, second: float | None) -> dict[str, Any]:
    """Two values and their difference as cells; None for what is not known."""
    difference = None if first is None or second is None else second - first
    values = {AS_IT_IS: first, CHANGED: second, DIFFERENCE: difference}
    return {_key(name, key): plain(value) for key, value in values.items()}


def _key(name: str, of: str) -> str:
    return f"{name}_{of}" if name else of


def _statistics(before: dict[str, Any], after: dict[str, Any]) -> StudyTable:
    absent: dict[str, Any] = {}
    pairs = list(zip_longest(statistics_of(before), statistics_of(after), fillvalue=absent))
    of_all = [((own or other)["pantograph"], own, other, OF_PANTOGRAPH) for own, other in pairs]
    rows = [
        {"of": name, "statistic": column.meaning}
        | _figures("", own.get(column.name), other.get(column.name))
        for name, own, other, columns in [*of_all, ("line", *pairs[0], OF_LINE)]
        for column in columns
    ]
    columns = [Column("of", "of"), Column("statistic", "statistic"), *_columns("", "", ".2f")]
    return StudyTable(columns, rows, "Statistics")


def _by_place(
    title: str, head: str, first: Any, second: Any, of_each: Sequence[tuple[Column, Any]]
) -> StudyTable:
    """Figures of arms or droppers that both runs have, by their places.

    Parameters
    ----------
    first, second : statistics of both runs, with places ``x`` (n,) and what is ``evaluated``
    of_each : a column, and its values (n,) in each run
    """
    rows = []
    for i, j in _pairs(first.x, second.x):
        inside = bool(first.evaluated[i])
        stretch = "evaluated" if inside else ""
        row: dict[str, Any] = {"x_m": float(first.x[i]), "evaluated": inside, "stretch": stretch}
        for column, (own, other) in of_each:
            row |= _figures(column.name, own[i], other[j])
        rows.append(row)
    columns = [Column("x_m", f"{head} at [m]", ".1f")]
    for column, _ in of_each:
        columns += _columns(column.name, column.head, column.format)
    columns += [Column("evaluated"), Column("stretch", "stretch", in_files=False)]
    return StudyTable(columns, rows, title)


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
    runs = [{row["criterion"]: row for row in one["acceptance"]} for one in (before, after)]
    rows, columns = [], [Column("criterion", "criterion")]
    for criterion in dict.fromkeys([*runs[0], *runs[1]]):
        row: dict[str, Any] = {"criterion": criterion}
        for name, run in zip(WORDS, runs, strict=True):
            own = run.get(criterion)
            row[f"value_{name}"], row[f"limit_{name}"] = own and own["value"], own and own["limit"]
            row[f"verdict_{name}"] = _VERDICTS[own["passed"]] if own else _ABSENT
        rows.append(row | {"unit": runs[criterion not in runs[0]][criterion]["unit"]})
    for name, words in WORDS.items():
        columns += [
            Column(f"value_{name}", words, ".4g"),
            Column(f"limit_{name}", "limit", ".4g"),
            Column(f"verdict_{name}", "verdict"),
        ]
    return StudyTable([*columns, Column("unit", "unit")], rows, "Verdicts")


def as_text(found: Differences) -> str:
    """Statistics, verdicts that change, and what changes most of the line."""
    lines = [f"{found.case} with {', '.join(found.changes)}", ""]
    lines += [found.tables["statistics"].text(), ""]
    rows = found.tables["verdicts"].rows
    verdicts = [(row["criterion"], row["verdict_as_it_is"], row["verdict_changed"]) for row in rows]
    lines += [
        f"{criterion}: {first} as it is, {second} with the change"
        for criterion, first, second in verdicts
        if first != second and (_ABSENT not in (first, second) or "failed" in (first, second))
    ] or ["No verdict changes."]
    for places, name, what in (
        ("supports", "uplift_mm", "Uplift at {x:g} m: {a:.1f} -> {b:.1f} mm"),
        ("droppers", "max_N", "Largest force of the dropper at {x:g} m: {a:.1f} -> {b:.1f} N"),
    ):
        key = f"{name}_{DIFFERENCE}"
        of_table = found.tables[places].rows
        changed = [row for row in of_table if row["evaluated"] and row[key] is not None]
        lines += [
            what.format(x=row["x_m"], a=row[f"{name}_{AS_IT_IS}"], b=row[f"{name}_{CHANGED}"])
            for row in sorted(changed, key=lambda row: -abs(row[key]))[:_MOST_CHANGED]
        ]
    named = [(WORDS[name], texts) for name, texts in found.remarks.items()]
    return "\n".join([*lines, *remark_lines(named)])


def files_of(folder: Path, found: Differences) -> dict[str, Content]:
    """The page, its tables and pictures, of runs in a folder. Not collective."""
    pictures: dict[str, bytes] = {}
    with Results(folder / AS_IT_IS) as a, Results(folder / CHANGED) as b:
        for name, draw in ((_FORCE, draw_forces), (_UPLIFT, draw_uplift)):
            pictures |= figures.painted(name, partial(draw, a, b))
    title = f"{found.case}: what if {', '.join(found.changes)}"
    lead = "Differences are those of the changed run minus those of the case as it is."
    return {
        **{f"{name}.png": data for name, data in pictures.items()},
        **{f"{name}.csv": table for name, table in found.tables.items()},
        PAGE: page(title, lead, _sections(found), pictures),
    }


def _sections(found: Differences) -> Iterator[Section]:
    shown = [
        Picture(_FORCE, "Contact force, 20 Hz low-pass, along the track"),
        Picture(_UPLIFT, "Largest uplift at each steady arm"),
    ]
    for name, table in found.tables.items():
        pictures = shown if name == "statistics" else []
        yield Section(table.title, [replace(table, title="")], pictures)
    remarks = [
        Text(text, "remark", f"{WORDS[name]}: ")
        for name, texts in found.remarks.items()
        for text in texts
    ]
    if remarks:
        yield Section("Remarks", remarks)


def draw_forces(a: Results, b: Results) -> Figure | None:
    """Contact forces of both runs along the track, a panel for each pantograph that both have."""
    names = a.pantograph_names()[: min(a.n_pantographs, b.n_pantographs)]
    runs = dict(zip(WORDS.values(), (a, b), strict=True))

    def curves(p: int) -> list[along_track.Curve]:
        return [
            (words, run.column("contact_position", p), _force(run, p))
            for words, run in runs.items()
        ]

    panels = [(name, curves(p)) for p, name in enumerate(names)]
    return along_track.overlaid_forces(panels, a.evaluation, f"{filters.CUT_OFF:g} Hz")


def _force(run: Results, pantograph: int) -> np.ndarray:
    """The contact force below 20 Hz (n,) [N]; all of it if it is sampled too slowly."""
    try:
        return filters.contact_force(run, pantograph)
    except InputError:  # statistics say so
        return run.column("contact_force", pantograph)


def draw_uplift(a: Results, b: Results) -> Figure | None:
    """Largest uplift at each steady arm of both runs."""
    curves = [
        (words, run.line("arm_x"), run.extremes("arm_uplift")[1])
        for run, words in zip((a, b), WORDS.values(), strict=True)
    ]
    return along_track.overlaid_uplifts(curves, a.evaluation)
