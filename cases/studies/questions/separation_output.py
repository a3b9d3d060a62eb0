"""What a study of pantographs' distances leaves: a table, a picture, text for a terminal."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catenary.cases.studies.questions.separation import DISTANCE, Pair, SeparationStudy
from catenary.postproc.files.disk import plain, write_all
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Column, StudyTable, remark_lines

TABLE, RECORD, PICTURE = "separation.csv", "separation.json", "separation.png"
PLACES = ("leading", "trailing")
_MOST_ROWS, _MOST_REMARKS = 40, 4  # on a terminal; files have all


def table_of(study: SeparationStudy) -> StudyTable:
    """A row for each distance, and one of a single pantograph, whose distance is None."""
    columns = [
        Column(DISTANCE, "distance [m]", "g"),
        Column("outcome"),
        *(Column(f"std_{place}_N", f"std {place} [N]", ".1f") for place in PLACES),
        *(Column(f"min_{place}_N", f"min {place} [N]", ".1f") for place in PLACES),
        *(Column(f"loss_{place}_percent", f"loss {place} [%]", ".2f") for place in PLACES),
        Column("max_uplift_mm", "uplift [mm]", ".1f"),
        Column("failed", "failed"),
        Column("remarks"),
    ]
    return StudyTable(columns, [_row(pair) for pair in (study.alone, *study.pairs)])


def _row(pair: Pair) -> dict[str, Any]:
    row: dict[str, Any] = {DISTANCE: pair.separation, "outcome": pair.outcome}
    for number, place in enumerate(PLACES):
        for name, values in (("std_{}_N", pair.std), ("min_{}_N", pair.least),
                             ("loss_{}_percent", pair.loss)):  # fmt: skip
            row[name.format(place)] = values[number] if number < len(values) else None
    return row | {
        "max_uplift_mm": pair.uplift,
        "failed": list(pair.failed),
        "remarks": list(pair.remarks),
    }


def as_text(study: SeparationStudy) -> str:
    """Best and worst distance in sentences, the table where it is short, and what fails."""
    lines = [f"{study.case}: two pantographs {study.kind} at {study.speed:g} km/h."]
    best, worst = study.best(), study.worst()
    if best is None or worst is None:
        lines.append(f"At no distance there are statistics of both: {study.pairs[0].outcome}")
        return "\n".join(lines)
    if study.alone.std:
        lines.append(f"One alone: {_deviations(study.alone)}.")
    for word, pair in (("Least", best), ("Largest", worst)):
        lines.append(f"{word} deviation at {pair.separation:g} m: {_deviations(pair)}.")
    lines += _failing(study)
    refused = [pair for pair in study.pairs if pair.outcome != "done"]
    if refused:
        lines.append(
            f"{len(refused)} of {len(study.pairs)} distances could not be run, the first is "
            f"{refused[0].separation:g} m: {refused[0].outcome}"
        )
    lines.append("")
    if len(study.pairs) <= _MOST_ROWS:
        lines += [table_of(study).text(), ""]
    remarks = remark_lines((f"{pair.separation:g} m", pair.remarks) for pair in study.pairs)
    lines += remarks[:_MOST_REMARKS]
    if len(remarks) > _MOST_REMARKS:
        lines.append(f"{len(remarks) - _MOST_REMARKS} more remarks; {RECORD} has all of them.")
    return "\n".join(lines)


def _deviations(pair: Pair) -> str:
    told = ["not known" if value is None else f"{value:.1f} N" for value in pair.std]
    uplift = "" if pair.uplift is None else f", uplift {pair.uplift:.1f} mm"
    if len(told) == 1:
        return f"deviation {told[0]}{uplift}"
    both = (f"{place} {value}" for place, value in zip(PLACES, told, strict=True))
    return f"{' and '.join(both)}{uplift}"


def _failing(study: SeparationStudy) -> list[str]:
    """A sentence for each criterion that fails somewhere, with the distances at which it does."""
    done = study.done
    names = dict.fromkeys(name for pair in done for name in pair.failed)
    if not names:
        return ["All criteria that are judged hold at all distances."]
    return [f"FAILED      {name}: {_stretches(done, name)}" for name in names]


def _stretches(pairs: list[Pair], name: str) -> str:
    """Where a criterion fails, neighbouring distances joined: ``31-40, 75 m``."""
    runs: list[list[float]] = []
    fails_before = False
    for pair in pairs:
        fails = name in pair.failed
        assert pair.separation is not None
        if fails and fails_before:
            runs[-1].append(pair.separation)
        elif fails:
            runs.append([pair.separation])
        fails_before = fails
    told = [f"{run[0]:g}-{run[-1]:g}" if len(run) > 1 else f"{run[0]:g}" for run in runs]
    return f"at {', '.join(told)} m"


def write(folder: Path, study: SeparationStudy) -> list[Path]:
    """Write table, record and picture; returns the files. Not collective."""
    table = table_of(study)
    best, worst = study.best(), study.worst()
    record = {
        "case": study.case,
        "pantograph": study.kind,
        "speed_km_h": study.speed,
        "best_separation_m": None if best is None else best.separation,
        "worst_separation_m": None if worst is None else worst.separation,
        "rows": table.records(),
    }
    content: dict[str, bytes | str] = {
        TABLE: table.csv(),
        RECORD: json.dumps(plain(record), indent=1, ensure_ascii=False) + "\n",
    }
    content |= figures.painted(PICTURE, lambda: draw(study))
    return write_all(folder, content)


@figures.own_style()
def draw(study: SeparationStudy) -> Figure | None:
    """Deviation, least force and uplift over the distance, and as a line those of one pantograph
    alone. None if fewer than two distances could be run."""
    done = study.done
    if len(done) < 2:
        return None
    figure, panels = figures.stacked(7.5, 3, shared=False)
    x = [pair.separation for pair in done]
    shown = (
        ("standard deviation [N]", [pair.std for pair in done], study.alone.std),
        ("minimum force [N]", [pair.least for pair in done], study.alone.least),
        ("largest uplift at arms [mm]", [(p.uplift,) for p in done], (study.alone.uplift,)),
    )
    for axes, (label, values, alone) in zip(panels, shown, strict=True):
        columns = np.array(values, dtype=float).T
        for number, y in enumerate(columns):
            name = PLACES[number] if len(columns) > 1 else "both"
            figures.curve(axes, x, y, number if len(columns) > 1 else 2, name, ".-")
        if alone and alone[0] is not None:
            axes.axhline(alone[0], color=figures.GREY, linestyle="--", label="one alone")
        figures.tidy(axes, "distance of the pantographs [m]", label)
        figures.legend_above(axes)
    return figure
