"""The worst span, steady arm and dropper of a run, with candidates for why; close views."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catenary.cases.studies.full_report.scene_of_run import SceneOfRun
from catenary.cases.studies.questions.causes import Causes
from catenary.cases.studies.questions.worst import Passage, Spot, WorstPlaces, worst_places
from catenary.cases.studies.questions.worst_output import worst_of_each
from catenary.postproc.channels.places_on_train import in_sentence
from catenary.postproc.evaluate import filters
from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures.figures import (
    COLOURS,
    LIMIT,
    WORST,
    colour,
    legend_above,
    own_style,
    stacked,
    tidy,
)
from catenary.postproc.report.pictures.marks import mark_line
from catenary.postproc.report.sections.section import EvaluatedRun, Picture, Section, Text, number
from catenary.postproc.report.study_table import StudyTable, texts_table

# Length that is shown beside a dropper and its extreme [m], and number of places in tables.
_BESIDE, _MOST = 30.0, 5


def section(scene: SceneOfRun | None, run: EvaluatedRun) -> Section:
    """The worst places of the evaluated stretch.

    Parameters
    ----------
    scene : of the run, for the elasticity of its line and its gusts; None if it is not known
    """
    results, places = run.results, worst_places(run.results)
    causes = Causes(results, places.passages, None if scene is None else scene.at_rest)
    return Section("Worst places", _blocks(results, places, causes), _pictures(results, places))


def _blocks(results: Results, places: WorstPlaces, causes: Causes) -> Iterator[Text | StudyTable]:
    names = results.pantograph_names()
    for (noun, by), found in worst_of_each(places, causes, names, 1).items():
        for sentence, candidates in found:
            yield Text(f"{sentence}.", "note", f"Worst {noun} by {by}:", candidates)
    everywhere = causes.of_line()
    if everywhere:
        yield Text("acts on all spans alike:", "note", "The line as a whole", everywhere)
    yield Text(
        "A candidate for the cause is near in place or frequency; none is proved. `catenary worst "
        "FOLDER` prints them all."
    )
    rows = [
        [p.span + 1, f"{p.start:.6g} to {p.end:.6g}", names[p.pantograph], number(p.std),
         number(p.maximum), number(p.minimum), number(p.loss, 3)]
        for p in places.passages[:_MOST]
    ]  # fmt: skip
    heads = ["span", "from, to [m]", "pantograph", "sigma [N]", "max [N]", "min [N]", "loss [%]"]
    if rows:
        yield texts_table(heads, rows, {0, 3, 4, 5, 6}, "Spans by standard deviation")


def _pictures(results: Results, places: WorstPlaces) -> Iterator[Picture]:
    if places.passages:
        passage = places.passages[0]
        who = results.pantograph_names()[passage.pantograph]
        text = (
            f"Contact force of {in_sentence(who)} in the worst span and the two beside it, and "
            "height of the contact wire above the rail."
        )
        yield Picture("worst_span", text, lambda: _span(results, passage))
    for name, spots, what in (
        ("worst_dropper", places.forces, "Force of the dropper with the largest force"),
        ("longest_slack", places.slack, "Force of the dropper that is slack the longest"),
    ):
        for spot in spots[:1]:
            caption = f"{what}, {spot.place}, as the train passes."
            yield Picture(name, caption, partial(_passage, results, spot))


@own_style()
def _span(results: Results, passage: Passage) -> Figure:
    """Contact force, and height of the contact point, in a span with those beside it."""
    length = passage.end - passage.start
    low, high = passage.start - length, passage.end + length
    p = passage.pantograph
    position = results.column("contact_position", p)
    rows = slice(*np.searchsorted(position, (low, high)).tolist())
    figure, (force, height) = stacked(4.8, 2)
    raw = results.column("contact_force", p)
    filtered = filters.contact_force(results, p)[rows]
    for axes in (force, height):
        mark_line(axes, results, low, high, named=axes is force)
        label = "worst span" if axes is force else None
        axes.axvspan(passage.start, passage.end, color=WORST, zorder=0.5, label=label)
    x = position[rows]
    light: dict[str, Any] = {"color": colour(p), "alpha": 0.35, "linewidth": 0.7}
    force.plot(x, raw[rows], label="unfiltered", **light)
    force.plot(x, filtered, color=colour(p), linewidth=1.6, label="20 Hz low-pass")
    for which, word, offset in ((np.argmax, "largest", (6, 4)), (np.argmin, "smallest", (6, -12))):
        within = np.flatnonzero((x >= passage.start) & (x <= passage.end))
        at = int(within[which(filtered[within])])
        force.annotate(
            f"{word} {filtered[at]:.0f} N at {x[at]:.1f} m", (x[at], filtered[at]),
            xytext=offset, textcoords="offset points", fontsize=8,
            bbox={"facecolor": "white", "alpha": 0.7, "edgecolor": "none", "pad": 1.0},
        )  # fmt: skip
        force.plot(x[at], filtered[at], "o", color=LIMIT, ms=4)
    force.axhline(0.0, color=LIMIT, linewidth=0.9)
    force.margins(y=0.25)  # for what is written at the extremes
    tidy(force, "", "contact force [N]")
    legend_above(force)
    line = results.column("wire_height", p)[rows]
    height.plot(x, line, color=COLOURS[2], linewidth=1.3, label="contact wire at the pantograph")
    tidy(height, "position of the pantograph along the track [m]", "height [m]")
    legend_above(height)
    return figure


@own_style()
def _passage(results: Results, spot: Spot) -> Figure:
    """Force of a dropper over the place of the leading pantograph."""
    leader = int(np.argmax(results.first_position))
    place = results.column("contact_position", leader)[:: results.line_record.every]
    behind = results.first_position[leader] - results.first_position
    most = place[int(np.nanargmax(results.column("dropper_force", spot.number)))]
    reach = min(spot.x, most) - _BESIDE, max(spot.x + float(behind.max()), most) + _BESIDE
    n_rows = results.n_rows("dropper_force")
    rows = slice(*np.clip(np.searchsorted(place, reach), 0, n_rows).tolist())
    force, x = results.column("dropper_force", spot.number, rows), place[rows] - spot.x
    figure, (axes,) = stacked(3.0, 1)
    axes.plot(x, force, color="#222222", linewidth=1.4, label="force")
    for p, name in enumerate(results.pantograph_names()):
        label = f"{name} passes"
        axes.axvline(behind[p], color=colour(p), linestyle="--", linewidth=1.1, label=label)
    slack = force <= 0.0
    if slack.any():
        axes.plot(x[slack], force[slack], ".", color=LIMIT, ms=3, label="slack")
    axes.axhline(0.0, color="#6b6b6b", linewidth=0.7)
    axes.margins(x=0.0)
    who = "leading pantograph" if results.n_pantographs > 1 else "pantograph"
    tidy(axes, f"position of the {who} relative to the dropper [m]", "dropper force [N]")
    legend_above(axes)
    return figure
