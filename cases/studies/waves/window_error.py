"""Error in the contact force that a window of moving spans makes, over its size.

The line is marched once whole and once with each window; forces are compared below 20 Hz within the
evaluated stretch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from catenary.base.errors import InputError, RunBroken
from catenary.base.mpi import MPI
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.scene import Scene, problem_of
from catenary.cases.studies.ensemble import Keeper
from catenary.postproc.evaluate.filters import low_pass
from catenary.postproc.record.run_watch import RunWatch
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Column, Content, StudyTable, remark_lines
from catenary.solver.problem.problem import WindowChoice
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.window.choice import estimated_error, spans_of_window

TABLE, PICTURE = "window_error.csv", "window_error.png"
OPTION = "--window-error"
# The least size of a window, and the largest [spans].
LEAST, MOST = 2, 100_000
# Share of a window that is ahead of the train, as in the one that the program chooses.
_AHEAD = 0.55


class Error(NamedTuple):
    """Error that a window makes; worst of all pantographs.

    Attributes
    ----------
    ahead, behind : spans of the window ahead of and behind the train
    history : rms difference of the force from that on the whole line [% of its standard deviation]
    sigma : relative difference of the standard deviation, signed [%]
    estimated : the program's estimate of ``history`` [%]
    is_default : whether the program chooses this window
    remarks : sentences of the march in this window
    """

    ahead: float
    behind: float
    history: float
    sigma: float
    estimated: float
    is_default: bool
    remarks: tuple[str, ...]

    @property
    def spans(self) -> float:
        """Size of the window."""
        return self.ahead + self.behind


class Curve(NamedTuple):
    """Errors by ascending size, of a line called ``name``, empty if there is no other.

    ``remarks`` are those of the march of the whole line.
    """

    name: str
    errors: tuple[Error, ...]
    remarks: tuple[str, ...]


def curve_of(name: str, scene: Scene, sizes: Sequence[int]) -> Curve:
    """March a scene whole and with windows of several sizes, which ascend. Serial.

    The window that the program chooses is one of them if the line is longer.

    Raises
    ------
    InputError
        If one is no smaller than the line, or there can be none.
    RunBroken
        If a march breaks.
    """
    problem = problem_of(scene)
    n_spans = len(problem.line.support_positions) - 1
    if sizes[-1] >= n_spans:
        raise InputError(
            f"{OPTION} has a window of {sizes[-1]} spans, but the line has {n_spans} "
            f"(line.n_spans {scene.origin.of('line.n_spans')})"
        )
    usual = spans_of_window(problem)
    windows = set()
    if usual.spans_ahead + usual.spans_behind < n_spans:
        windows.add((usual.spans_ahead, usual.spans_behind))
    for size in sizes:
        ahead = float(min(size - 1, math.ceil(_AHEAD * size)))
        windows.add((ahead, size - ahead))
    rest = line_at_rest(replace(problem, window=WindowChoice()), mesh_of(scene))
    whole, of_whole = _forces(rest, WindowChoice())
    errors = []
    for ahead, behind in sorted(windows, key=sum):
        found, remarks = _forces(rest, spans_of_window(problem, ahead, behind))
        history, sigma = _worst(found, whole)
        estimated = estimated_error(problem, ahead, behind)
        chosen = (ahead, behind) == (usual.spans_ahead, usual.spans_behind)
        errors.append(Error(ahead, behind, history, sigma, estimated, chosen, tuple(remarks)))
    return Curve(name, tuple(errors), tuple(of_whole))


def table_of(curves: Sequence[Curve]) -> StudyTable:
    """A row for each window."""
    columns = [
        Column("with", "with" if any(curve.name for curve in curves) else ""),
        Column("spans_ahead", "spans ahead", "g"),
        Column("spans_behind", "behind", "g"),
        Column("history_percent_of_std", "history [% of sigma]", ".2g"),
        Column("std_percent", "sigma [%]", "+.2g"),
        Column("estimated_percent", "history, estimated [% of sigma]", ".2g"),
        Column("default"),
        Column("chosen", " ", in_files=False),
        Column("remarks"),
    ]
    rows = []
    for curve in curves:
        of_whole = [f"whole line: {text}" for text in curve.remarks]
        for one in curve.errors:
            chosen = "chosen by the program" if one.is_default else ""
            cells = (*one[:5], int(one.is_default), chosen, [*of_whole, *one.remarks])
            names = (column.name for column in columns)
            rows.append(dict(zip(names, (curve.name, *cells), strict=True)))
    return StudyTable(columns, rows)


def files_of(curves: Sequence[Curve]) -> dict[str, Content]:
    """Table and picture. Not collective."""
    return {TABLE: table_of(curves), PICTURE: lambda: draw(curves)}


@figures.own_style()
def draw(curves: Sequence[Curve]) -> Figure:
    """Errors over size; the window that the program chooses is a star, its estimates are dotted."""
    figure, axes = figures.panels(4.6)
    for number, curve in enumerate(curves):
        spans = [one.spans for one in curve.errors]
        history = [one.history for one in curve.errors]
        sigma = [one.sigma for one in curve.errors]
        figures.curve(axes, spans, history, number, f"history {curve.name}".strip(), "o-")
        label = f"sigma {curve.name}".strip()
        figures.curve(axes, spans, np.abs(sigma), number, label, "s--", 0.8)
        figures.curve(axes, spans, [one.estimated for one in curve.errors], number, None, ":", 1.0)
        for one in curve.errors:
            if one.is_default:
                figures.curve(axes, one.spans, one.history, number, None, "*", ms=13.0)
    axes.set_yscale("log")
    label = "spans that move (star: chosen by the program, dotted: its estimate)"
    figures.tidy(axes, label, "error of the force [% of sigma]")
    figures.legend_above(axes, 2)
    return figure


def as_text(curves: Sequence[Curve]) -> str:
    """The table for a terminal, and the remarks on all marches."""
    remarks = [
        (f"{curve.name} {name}".strip(), remarks)
        for curve in curves
        for name, remarks in (
            ("whole line", curve.remarks),
            *((f"{one.spans:g} spans", one.remarks) for one in curve.errors),
        )
    ]
    return "\n".join([table_of(curves).text(), *remark_lines(remarks)])


def _forces(rest: LineAtRest, window: WindowChoice) -> tuple[list[np.ndarray], list[str]]:
    """Filtered force (n,) of each pantograph in the stretch [N], and remarks of the march."""
    problem, seen = replace(rest.problem, window=window), Keeper()
    at_rest = rest._replace(problem=problem)
    watch = RunWatch(MPI.COMM_SELF, at_rest)
    with March(MPI.COMM_SELF, *at_rest) as run:
        outcome = run.run([seen, watch])
    if outcome.outcome != "done":
        raise RunBroken(outcome.outcome)
    tables = seen.tables()
    first, last = problem.evaluation
    filtered = low_pass(tables["channels/contact_force"], problem.numerics.dt).T
    both = zip(filtered, tables["channels/contact_position"].T, strict=True)
    return [own[(at >= first) & (at <= last)] for own, at in both], watch.remarks


def _worst(found: list[np.ndarray], whole: list[np.ndarray]) -> tuple[float, float]:
    """Errors of history and sigma, each of the pantograph where it is largest [%]."""
    history, sigma = 0.0, 0.0
    for own, expected in zip(found, whole, strict=True):
        deviation = float(expected.std())
        history = max(history, 100.0 * float(np.sqrt(((own - expected) ** 2).mean())) / deviation)
        sigma = max(sigma, 100.0 * (float(own.std()) / deviation - 1.0), key=abs)
    return history, sigma
