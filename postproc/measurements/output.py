"""A measured passage beside a run as text, page, tables and JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from catenary.postproc.evaluate.wording import UNCOMPARED
from catenary.postproc.files.disk import plain, write_all
from catenary.postproc.measurements.compared import LINE_TEST, Comparison
from catenary.postproc.report.page import page
from catenary.postproc.report.sections.section import Picture, Section, Text
from catenary.postproc.report.study_table import Column, StudyTable, file_table

PAGE, SUMMARY, FIGURES = "measurement.html", "measurement.json", "figures.csv"
FORCES, UPLIFTS = "forces.csv", "uplifts.csv"
_FORCE, _UPLIFT = "measured_force", "measured_uplift"
NO_ERRORS = "No error is seen: the measurement is that of this run, but for noise."
WHOSE = "An error is one of the measurement, of its description, or of the scene that was run."
_SOURCES = (
    f"Tolerances marked {UNCOMPARED} are from memory of the {LINE_TEST}, and were not compared "
    "with its text."
)


def figures_table(found: Comparison) -> StudyTable:
    """A row for each figure of run and measurement, with its tolerance and verdict."""
    columns = [
        Column("figure", "figure"),
        Column("pantograph", "pantograph"),
        Column("unit", "unit"),
        Column("run", "run", ".2f"),
        Column("measured", "measured", ".2f"),
        Column("difference", "run - measured", ".2f"),
        Column("tolerance", "tolerance", ".2f"),
        Column("verdict", "verdict"),
        Column("because", "because"),
        Column("source"),
    ]
    words = {True: "passed", False: "FAILED", None: "not judged"}
    return StudyTable(
        columns,
        [
            {
                "figure": one.name,
                "pantograph": one.pantograph,
                "unit": one.unit,
                "run": one.run,
                "measured": one.measured,
                "difference": one.run - one.measured,
                "tolerance": None if np.isnan(one.tolerance) else one.tolerance,
                "verdict": words[one.passed]
                + (f" {UNCOMPARED}" if one.source == LINE_TEST and one.passed is not None else ""),
                "because": one.because,
                "source": one.source if not np.isnan(one.tolerance) else "",
            }
            for one in found.figures
        ],
        "Figures",
        _SOURCES,
    )


def as_text(found: Comparison) -> str:
    """Text for the terminal: errors found, remarks, and the table of figures."""
    lines = [found.lead, ""]
    lines += [f"ERROR       {one.text}" for one in found.findings] or [NO_ERRORS]
    lines += [WHOSE] if found.findings else []
    lines += [*(f"REMARK      {text}" for text in found.remarks), ""]
    return "\n".join([*lines, figures_table(found).text(), _SOURCES])


def summary_of(found: Comparison) -> dict[str, Any]:
    """Findings, alignments, figures and remarks, for programs."""
    content: dict[str, Any] = plain(
        {
            "measured": found.measured,
            "run": found.run,
            "passed": found.passed,
            "errors": [asdict(one) for one in found.findings],
            "alignments": {
                one.pantograph: None if one.alignment is None else asdict(one.alignment)
                for one in found.overlays
            },
            "figures": figures_table(found).records(),
            "remarks": list(found.remarks),
        }
    )
    return content


def forces_table(found: Comparison) -> StudyTable:
    """Places on the run's line, and forces and head heights there, of all pantographs."""
    names = ["pantograph", "place_m", "measured_N", "run_N", "measured_height_m", "run_height_m"]
    rows = []
    for one in found.overlays:
        histories = [one.place, one.measured, one.run]
        for heights in (one.measured_height, one.run_height):
            histories.append(np.full(one.place.size, np.nan) if heights is None else heights)
        rows += [[one.pantograph, *plain(row)] for row in np.stack(histories, axis=1).tolist()]
    return file_table(names, rows)


def uplifts_table(found: Comparison) -> StudyTable:
    """Supports with their largest uplifts; empty if these were not measured."""
    names = ["place_m", "measured_mm", "run_mm"]
    own, rows = found.uplift, []
    if own is not None:
        values = np.stack([own.place, 1e3 * own.measured, 1e3 * own.run], axis=1)
        rows = [dict(zip(names, row, strict=True)) for row in values.tolist()]
    heads = ("support at [m]", "measured [mm]", "run [mm]")
    columns = [Column(name, head, ".1f") for name, head in zip(names, heads, strict=True)]
    return StudyTable(columns, rows, "Largest uplifts at supports")


def write(folder: Path, found: Comparison) -> list[Path]:
    """Write page, tables, JSON and pictures into a folder; returns the files. Not collective.

    Parameters
    ----------
    folder : Path
        Folder, which is made if it is not there.
    found : Comparison
        Comparison of a run with a measured passage.
    """
    # A text does without Matplotlib.
    from catenary.postproc.report.pictures import overlays
    from catenary.postproc.report.pictures.figures import painted

    panels = [
        (one.pantograph, [("run", one.place, one.run), ("measured", one.place, one.measured)])
        for one in found.overlays
    ]
    own = found.uplift
    uplifts = own and [("run", own.place, own.run), ("measured", own.place, own.measured)]
    pictures = painted(_FORCE, lambda: overlays.forces(panels))
    pictures |= painted(_UPLIFT, lambda: overlays.uplifts(uplifts or ()))
    content: dict[str, bytes | str] = {f"{name}.png": data for name, data in pictures.items()}
    content[FIGURES], content[FORCES] = figures_table(found).csv(), forces_table(found).csv()
    if found.uplift is not None:
        content[UPLIFTS] = uplifts_table(found).csv()
    content[SUMMARY] = json.dumps(summary_of(found), indent=2) + "\n"
    title = f"{found.measured} beside {Path(found.run).parent.name}"
    content[PAGE] = page(title, f"{found.lead}.", _sections(found), pictures)
    return write_all(folder, content)


def _sections(found: Comparison) -> Iterator[Section]:
    errors = [Text(one.text, "bad", "Error: ") for one in found.findings]
    yield Section("Errors", [*errors, Text(WHOSE)] if errors else [Text(NO_ERRORS, "good")])
    force = Picture(_FORCE, "Contact forces below the cut-off, at the run's positions")
    table = replace(figures_table(found), title="")
    yield Section("Figures", [table], [force] if found.overlays else [])
    if found.uplift is not None:
        uplift = Picture(_UPLIFT, "Largest uplifts at supports")
        yield Section("Uplift", [replace(uplifts_table(found), title="")], [uplift])
    yield Section("Remarks", [Text(text, "remark") for text in found.remarks])
