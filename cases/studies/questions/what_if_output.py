"""What a question of a change leaves: one page, its tables as CSV, pictures, and a text."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from catenary.base.errors import InputError
from catenary.cases.studies.questions.what_if import AS_IT_IS, CHANGED, Differences
from catenary.postproc.evaluate import filters
from catenary.postproc.files.disk import write_all
from catenary.postproc.read.results import Results
from catenary.postproc.report.page import page
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.pictures.envelope import thinned
from catenary.postproc.report.sections.section import Picture, Section, Text
from catenary.postproc.report.study_table import StudyTable, remark_lines

PAGE = "what_if.html"
WORDS = {AS_IT_IS: "as it is", CHANGED: "changed"}
_FORCE, _UPLIFT = "force", "uplift"
_MOST_CHANGED = 3  # arms and droppers named on a terminal


def as_text(found: Differences) -> str:
    """Statistics, verdicts that change, and what changes most of the line."""
    lines = [f"{found.case} with {', '.join(found.changes)}", "", found.statistics.text(), ""]
    rows = found.criteria.rows
    turned = [row for row in rows if row["verdict_as_it_is"] != row["verdict_changed"]]
    lines += [
        f"{row['criterion']}: {row['verdict_as_it_is']} as it is, {row['verdict_changed']} with "
        "the change"
        for row in turned
    ] or ["No verdict changes."]
    for table, name, what in (
        (found.supports, "uplift_mm", "Uplift at {x:g} m: {a:.1f} -> {b:.1f} mm"),
        (found.droppers, "max_N", "Largest force of the dropper at {x:g} m: {a:.1f} -> {b:.1f} N"),
    ):
        lines += _most_changed(table, name, what)
    named = [(WORDS[name], said) for name, said in found.remarks.items()]
    return "\n".join([*lines, *remark_lines(named)])


def _most_changed(table: StudyTable, name: str, words: str) -> list[str]:
    """Evaluated places whose figure changes most."""
    key = f"{name}_difference"
    rows = [row for row in table.rows if row["evaluated"] and row[key] is not None]
    rows = sorted(rows, key=lambda row: -abs(row[key]))[:_MOST_CHANGED]
    return [
        words.format(x=row["x_m"], a=row[f"{name}_{AS_IT_IS}"], b=row[f"{name}_{CHANGED}"])
        for row in rows
    ]


def write(folder: Path, found: Differences) -> list[Path]:
    """Write the page, its tables and pictures; returns the files. Not collective."""
    paths = [folder / AS_IT_IS, folder / CHANGED]
    pictures: dict[str, bytes] = {}
    for name, draw in ((_FORCE, draw_forces), (_UPLIFT, draw_uplift)):
        pictures |= figures.painted(name, _opened(draw, paths))
    content: dict[str, bytes | str] = {f"{name}.png": data for name, data in pictures.items()}
    tables = {
        "statistics.csv": found.statistics,
        "supports.csv": found.supports,
        "droppers.csv": found.droppers,
        "verdicts.csv": found.criteria,
    }
    content |= {name: table.csv() for name, table in tables.items()}
    title = f"{found.case}: what if {', '.join(found.changes)}"
    lead = "Differences are those of the changed run minus those of the case as it is."
    content[PAGE] = page(title, lead, _sections(found), pictures)
    return write_all(folder, content)


def _sections(found: Differences) -> Iterator[Section]:
    shown = [
        Picture(_FORCE, "Contact force, 20 Hz low-pass, along the track", _nothing),
        Picture(_UPLIFT, "Largest uplift at each steady arm", _nothing),
    ]
    for table in (found.statistics, found.criteria, found.supports, found.droppers):
        pictures = shown if table is found.statistics else []
        yield Section(table.title, [replace(table, title="")], pictures)
    remarks = [
        Text(text, "remark", f"{WORDS[name]}: ")
        for name, said in found.remarks.items()
        for text in said
    ]
    if remarks:
        yield Section("Remarks", remarks)


def _nothing() -> None:
    """Pictures are made before the page."""


def _opened(draw: Callable[[Results, Results], Figure], paths: list[Path]) -> Callable[[], Figure]:
    def drawn() -> Figure:
        with Results(paths[0]) as a, Results(paths[1]) as b:
            return draw(a, b)

    return drawn


@figures.own_style()
def draw_forces(a: Results, b: Results) -> Figure:
    """Contact forces of both runs along the track, a panel for each pantograph that both have."""
    n = min(a.n_pantographs, b.n_pantographs)
    figure, panels = figures.stacked(0.7 + 2.7 * n, n, shared=True)
    for p, axes in enumerate(panels):
        for number, (run, words) in enumerate(zip((a, b), WORDS.values(), strict=True)):
            force = run.column("contact_force", p)
            with contextlib.suppress(InputError):  # sampled too slowly; statistics say so
                force = filters.low_pass(force, run.dt)
            chosen = thinned(force)
            x = run.column("contact_position", p)[chosen]
            figures.curve(axes, x, force[chosen], number, words)
        axes.axvspan(*a.evaluation, color=figures.SHADE, zorder=0)
        figures.tidy(axes, "", "contact force [N]", a.pantograph_names()[p].capitalize())
        figures.legend_above(axes)
    panels[-1].set_xlabel("position along the track [m]")
    return figure


@figures.own_style()
def draw_uplift(a: Results, b: Results) -> Figure:
    """Largest uplift at each steady arm of both runs."""
    figure, (axes,) = figures.stacked(3.2, 1)
    for number, (run, words) in enumerate(zip((a, b), WORDS.values(), strict=True)):
        uplift = 1e3 * run.extremes("arm_uplift")[1]
        order = np.argsort(run.line("arm_x"), kind="stable")
        figures.curve(axes, run.line("arm_x")[order], uplift[order], number, words, "o-")
    axes.axvspan(*a.evaluation, color=figures.SHADE, zorder=0)
    figures.tidy(axes, "position along the track [m]", "largest uplift [mm]")
    figures.legend_above(axes)
    return figure
