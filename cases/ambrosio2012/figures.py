"""The paper's figures 8 to 14 from our runs, each with the numbers that it shows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from catenary.cases.ambrosio2012.passages import leading_position, mid_span
from catenary.cases.studies.paper_study import LEADING, SINGLE, TRAILING, Rows, name_of
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.statistics import histogram
from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_report import StudyFigure

# damping -> train -> folder of its result file
Folders = Mapping[str, Mapping[str, Path]]
Columns = dict[str, Any]

LIGHT, AVERAGE = "light", "average"
_PANELS = {LIGHT: "(a) alpha = 0.00275 s", AVERAGE: "(b) alpha = 0.0275 s"}
_SHOWN_PAIRS = ("31m", "200m")  # figures 11 and 12 show two separations; the text names these
_STATISTICS: tuple[tuple[str, Callable[[Columns], float]], ...] = (
    ("maximum", lambda f: float(f["max_N"])),
    ("minimum", lambda f: float(f["min_N"])),
    ("mean", lambda f: float(f["mean_N"])),
    ("deviation", lambda f: float(f["std_N"])),
    ("mean + 3 sigma", lambda f: float(f["mean_N"] + 3 * f["std_N"])),
    ("mean - 3 sigma", lambda f: float(f["mean_N"] - 3 * f["std_N"])),
)
_BIN = 20.0  # [N]


def draw(folders: Folders, rows: Rows) -> list[StudyFigure]:
    """Figures 8 to 14 of what is there; one whose runs are all missing is left out.

    Parameters
    ----------
    folders : result files of the runs that are done
    rows : their statistics
    """
    figures = []
    if any(folders.values()):
        figures = [_forces(folders), _overview(rows), _histograms(folders)]
        shown = {
            damping: {t: f for t, f in trains.items() if t in _SHOWN_PAIRS}
            for damping, trains in folders.items()
        }
        if any(shown.values()):
            figures += [_passages(shown, *one) for one in _PASSED]
        figures += [_by_separation(13, LIGHT, rows), _by_separation(14, AVERAGE, rows)]
    return figures


def _places(n: int) -> tuple[str, ...]:
    return (SINGLE,) if n == 1 else (LEADING, TRAILING)


def _label(train: str, place: str) -> str:
    return train if train == SINGLE else f"{train} {place}"


def _filtered(results: Results) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Place, position [m] and 20 Hz force [N] of each pantograph within the stretch."""
    start, end = results.evaluation
    found = []
    for p, place in enumerate(_places(results.n_pantographs)):
        position = results.column("contact_position", p)
        within = (position >= start) & (position <= end)
        filtered = filters.contact_force(results, p)
        found.append((place, position[within], filtered[within]))
    return found


@figures.own_style()
def _forces(folders: Folders) -> StudyFigure:
    trains = list(dict.fromkeys(train for own in folders.values() for train in own))
    n = len(trains)
    figure, grid = figures.panels(0.6 + 1.55 * n, n, 2, sharey=True, squeeze=False)
    columns: Columns = {}
    for column, (damping, own) in enumerate(folders.items()):
        for row, train in enumerate(trains):
            axes = grid[row, column]
            if train in own:
                _force_panel(axes, own[train], train, damping, columns)
            title = f"{_PANELS[damping]}: {train}" if row == 0 else train
            figures.tidy(axes, "", "force [N]" if column == 0 else "", title)
        grid[-1, column].set_xlabel("position of the pantograph [m]")
    figures.legend_above(grid[min(1, len(trains) - 1), 1], columns=2)
    return StudyFigure("figure_08", "Figure 8: contact force of each pantograph, 20 Hz low-pass.",
                       figure, columns)  # fmt: skip


def _force_panel(axes: Axes, folder: Path, train: str, damping: str, columns: Columns) -> None:
    with Results(folder) as results:
        for number, (place, position, force) in enumerate(_filtered(results)):
            figures.curve(axes, position, force, number, place, figures.line(number), 0.8)
            name = f"{damping} {_label(train, place)}"
            columns[f"{name} position [m]"] = position
            columns[f"{name} force [N]"] = force


@figures.own_style()
def _overview(rows: Rows) -> StudyFigure:
    """Figure 9: statistics of all pantographs, a panel for each damping."""
    figure, panels = figures.panels(6.4, 2, 1)
    columns: Columns = {"damping": [], "pantograph": []}
    columns |= {f"{name} [N]": [] for name, _ in _STATISTICS}
    for axes, damping in zip(panels, _PANELS, strict=True):
        forces = {name_of(row): row for row in rows.rows if row["damping"] == damping}
        for number, (name, value) in enumerate(_STATISTICS):
            at = np.arange(len(forces)) + 0.13 * (number - 2.5)
            values = [value(force) for force in forces.values()]
            axes.bar(at, values, 0.12, color=figures.colour(number), label=name)
            columns[f"{name} [N]"] += values
        columns["damping"] += [damping] * len(forces)
        columns["pantograph"] += list(forces)
        axes.axhline(0.0, color=figures.GREY, linewidth=0.8)
        axes.set_xticks(range(len(forces)), [label.replace(" ", "\n") for label in forces])
        figures.tidy(axes, "", "contact force [N]", _PANELS[damping])
        axes.grid(False, axis="x")
    figures.legend_above(panels[0], columns=6)
    return StudyFigure(
        "figure_09", "Figure 9: statistics of the contact force.", figure, columns
    )  # fmt: skip


@figures.own_style()
def _histograms(folders: Folders) -> StudyFigure:
    """Figure 10: share of time in bins of the contact force, a panel for each damping."""
    figure, panels = figures.panels(6.4, 2, 1, sharex=True, sharey=True)
    columns: Columns = {}
    for axes, (damping, trains) in zip(panels, folders.items(), strict=True):
        for number, (train, folder) in enumerate(trains.items()):
            with Results(folder) as results:
                records = _filtered(results)
            for place, _, force in records:
                edges, percent = histogram(force, _BIN)
                middle = 0.5 * (edges[1:] + edges[:-1])
                name = _label(train, place)
                style = "--" if place == TRAILING else "-"
                figures.curve(axes, middle, percent, number, name, f"o{style}", ms=2.5)
                columns[f"{damping} {name} force [N]"] = middle
                columns[f"{damping} {name} share [%]"] = percent
        figures.tidy(axes, "", "share of time [%]", _PANELS[damping])
    panels[-1].set_xlabel(f"contact force, 20 Hz, bins of {_BIN:g} N [N]")
    figures.legend_above(panels[0], columns=4)
    return StudyFigure("figure_10", "Figure 10: histograms of the contact force.", figure, columns)


def _arm(results: Results) -> tuple[float, np.ndarray]:
    """Place of the arm nearest to the middle of the stretch [m], and its uplift [mm]."""
    x = results.line("arm_x")
    arm = int(np.argmin(np.abs(x - np.mean(results.evaluation))))
    return float(x[arm]), 1e3 * results.column("arm_uplift", arm)


def _dropper(results: Results) -> tuple[float, np.ndarray]:
    """Place of a dropper next to the middle of the span in the stretch's middle [m], and its force
    [N]."""
    x, span = results.line("dropper_x"), results.line("dropper_span")
    chosen = int(np.flatnonzero(mid_span(results) & (span == results.reference_span))[0])
    return float(x[chosen]), results.column("dropper_force", chosen)


# Figures over the time since the head has passed: number, record, its quantity, and caption.
_PASSED = (
    (11, _arm, "uplift [mm]", "uplift at the steady arm in the middle of the stretch."),
    (12, _dropper, "dropper force [N]",
     "force of a mid-span dropper in the middle of the stretch; 0 is slack."),
)  # fmt: skip


@figures.own_style()
def _passages(
    shown: Folders,
    n: int,
    record: Callable[[Results], tuple[float, np.ndarray]],
    what: str,
    caption: str,
) -> StudyFigure:
    """A record at one place of the line over the time since the leading head passed it."""
    figure, panels = figures.panels(5.6, 2, 1, sharex=True, sharey=True)
    columns: Columns = {}
    for axes, (damping, trains) in zip(panels, shown.items(), strict=True):
        for number, (train, folder) in enumerate(trains.items()):
            with Results(folder) as results:
                x, values = record(results)
                position = leading_position(results)[:: results.line_record.every]
                first = results.first_position
                speed = results.fact("speed")
            since = (position - x) / speed
            behind = float(np.ptp(first)) / speed
            colour = figures.colour(number)
            axes.plot(since, values, color=colour, linewidth=1.1, label=train)
            axes.axvline(behind, color=colour, linestyle="--", linewidth=0.9)
            columns[f"{damping} {train} time since the leading head [s]"] = since
            columns[f"{damping} {train} {what}"] = values
        axes.axvline(0.0, color=figures.GREY, linestyle="--", linewidth=0.9)
        axes.axhline(0.0, color=figures.GREY, linewidth=0.6)
        axes.set_xlim(-2.0, 5.0)
        figures.tidy(axes, "", what, _PANELS[damping])
    panels[-1].set_xlabel("time since the leading head has passed [s]; dashed: heads pass")
    figures.legend_above(panels[0], columns=2)
    return StudyFigure(f"figure_{n}", f"Figure {n}: {caption}", figure, columns)


@figures.own_style()
def _by_separation(number: int, damping: str, rows: Rows) -> StudyFigure:
    """Figures 13 and 14: statistics over the separation beside the single pantograph's."""
    figure, panels = figures.panels(3.6, 1, 2, sharey=True)
    own = [row for row in rows.rows if row["damping"] == damping]
    columns: Columns = {"pantograph": [], "train": []}
    columns |= {f"{name} [N]": [] for name, _ in _STATISTICS}
    for panel, place in enumerate((LEADING, TRAILING)):
        axes = panels[panel]
        shown = {row["train"]: row for row in own if row["place"] in (place, SINGLE)}
        for index, (name, value) in enumerate(_STATISTICS):
            values = [value(force) for force in shown.values()]
            look = figures.mark(index) + figures.line(index)
            figures.curve(axes, range(len(shown)), values, index, name, look)
            columns[f"{name} [N]"] += values
        columns["pantograph"] += [place] * len(shown)
        columns["train"] += list(shown)
        axes.axhline(0.0, color=figures.GREY, linewidth=0.8)
        axes.set_xticks(range(len(shown)), list(shown))
        title = f"({'ab'[panel]}) {place}"
        figures.tidy(axes, "separation", "contact force [N]" if panel == 0 else "", title)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=6,
                  frameon=False, fontsize="small")  # fmt: skip
    return StudyFigure(
        f"figure_{number}",
        f"Figure {number}: statistics of the contact force over the separation, {damping} damping.",
        figure,
        columns,
    )
