"""What a search for the highest speed leaves: tables, a picture, and text for a terminal."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catenary.cases.studies.questions.highest_speed import KEY, Holds, SpeedStudy, Stretch
from catenary.cases.studies.sweep.jobs import STATISTICS
from catenary.cases.studies.sweep.output import remarks_of, table_of
from catenary.postproc.files.disk import plain, write_all
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Column, StudyTable

TABLE, RUNS, RECORD, PICTURE = "speed.csv", "speeds.csv", "speed.json", "speed.png"
# Statistic of a panel, and the criteria whose limits stand in it.
_PANELS = (
    ("std_N", "standard deviation"),
    ("max_N", "maximum contact force"),
    ("min_N", "minimum contact force"),
    ("max_uplift_mm", "contact-wire uplift"),
)


def table_of_criteria(study: SpeedStudy) -> StudyTable:
    """A row for each criterion: from where it holds to the highest speed, and what ends it."""
    columns = [
        Column("criterion", "criterion"),
        Column("holds_from_km_h", "holds from", ".1f"),
        Column("highest_km_h", "to [km/h]", ".1f"),
        Column("fails_at_km_h", "fails at", ".1f"),
        Column("value", "with", ".4g"),
        Column("limit", "limit", ".4g"),
        Column("unit", "unit"),
        Column("more_stretches_km_h", "holds again"),
        Column("stopped_by"),
    ]
    rows = [_row(one, study.speeds.slowest) for one in study.holds]
    return StudyTable(columns, rows)


def _row(one: Holds, slowest: float) -> dict[str, Any]:
    first: Stretch | None = one.stretches[0] if one.stretches else None
    value, limit = one.fails_by or (None, None)
    return {
        "criterion": one.criterion,
        "holds_from_km_h": None if first is None else first.slowest,
        "highest_km_h": None if first is None else first.fastest,
        "fails_at_km_h": slowest if first is None else first.fails_at,
        "value": value,
        "limit": limit,
        "unit": one.unit,
        "more_stretches_km_h": [f"{own.slowest:g}-{own.fastest:g}" for own in one.stretches[1:]],
        "stopped_by": list(one.stopped_by),
    }


def as_text(study: SpeedStudy) -> str:
    """The answer in a sentence, and the table of criteria."""
    speeds, whole = study.speeds, study.holds[0]
    counted = f"{len(study.holds) - 1} criteria judged here"
    where = f"from {speeds.slowest:g} to {speeds.fastest:g} km/h"
    if not study.holds[1:]:
        answer = f"No criterion is judged {where}."
    elif not whole.stretches:
        answer = f"At no speed {where} all {counted} hold."
    else:
        first = whole.stretches[0]
        answer = f"All {counted} hold from {first.slowest:.1f} to {first.fastest:.1f} km/h"
        if first.fails_at is None:
            answer += ", the end of the range."
        else:
            answer += f"; at {first.fails_at:.1f} km/h fails: {'; '.join(whole.stopped_by)}."
    lines = [f"{study.case}, {len(study.ended)} speeds {where}. {answer}", ""]
    lines += [table_of_criteria(study).text(), ""]
    if study.not_judged:
        lines.append(f"Not judged: {'; '.join(study.not_judged)}.")
    refused = [one for one in study.ended if not one.done]
    if refused:
        slowest, fastest = refused[0].variant.varied[KEY], refused[-1].variant.varied[KEY]
        lines.append(
            f"{len(refused)} speeds from {slowest} to {fastest} km/h could not be run and count as "
            f"failed; the first: {refused[0].outcome}"
        )
    lines.append(
        "Trains run in the direction of the scene alone. Stretches narrower than "
        f"{speeds.step:g} km/h may be missed."
    )
    return "\n".join([*lines, *remarks_of(study.ended)])


def write(folder: Path, study: SpeedStudy) -> list[Path]:
    """Write tables, record and picture; returns the files. Not collective."""
    criteria, runs = table_of_criteria(study), table_of(study.ended)
    record = {
        "case": study.case,
        **{f"{name}_km_h": value for name, value in study.speeds._asdict().items()},
        "criteria": criteria.records(),
        "not_judged": study.not_judged,
        "runs": runs.records(),
    }
    content: dict[str, bytes | str] = {
        TABLE: criteria.csv(),
        RUNS: runs.csv(),
        RECORD: json.dumps(plain(record), indent=1, ensure_ascii=False) + "\n",
    }
    content |= figures.painted(PICTURE, lambda: draw(study))
    return write_all(folder, content)


@figures.own_style()
def draw(study: SpeedStudy) -> Figure | None:
    """Deviation, extremes and uplift over speed with their limits; speeds at which all criteria
    hold are shaded. None if fewer than two speeds could be run."""
    rows = [row for row in table_of(study.ended).rows if row["outcome"] == "done"]
    if len({row[KEY] for row in rows}) < 2:
        return None
    figure = figures.new_figure(0.6 + 2.0 * len(_PANELS))
    panels = figure.subplots(len(_PANELS), 1, sharex=True)
    names = list(dict.fromkeys(row["pantograph"] for row in rows))
    for (statistic, criterion), axes in zip(_PANELS, panels, strict=True):
        for stretch in study.holds[0].stretches:
            axes.axvspan(stretch.slowest, stretch.fastest, color=figures.SHADE, zorder=0)
        of_line = statistic == "max_uplift_mm"
        for number, name in enumerate(names[:1] if of_line else names):
            own = [row for row in rows if row["pantograph"] == name]
            y = [np.nan if row[statistic] is None else row[statistic] for row in own]
            label = None if of_line else name
            figures.curve(axes, [row[KEY] for row in own], y, number, label, "o-")
        _draw_limits(axes, study, criterion)
        figures.tidy(axes, "", STATISTICS[statistic].meaning)
    figures.legend_above(panels[0], columns=min(len(names) + 1, 4))
    panels[-1].set_xlabel("train speed [km/h]")
    return figure


def _draw_limits(axes: Any, study: SpeedStudy, criterion: str) -> None:
    """Limits of all criteria whose names begin so, as one look of dashed lines."""
    limits: dict[str, list[tuple[float, float]]] = {}
    for one in study.ended:
        for row in one.summary.get("acceptance", []):
            if row["criterion"].startswith(criterion) and row["limit"] is not None:
                place = (float(one.variant.varied[KEY]), float(row["limit"]))
                limits.setdefault(row["criterion"], []).append(place)
    label: str | None = "limit"
    for places in limits.values():
        x, y = np.transpose(places)
        axes.plot(x, y, "--", color=figures.LIMIT, linewidth=1.0, label=label)
        label = None
