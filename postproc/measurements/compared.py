"""A measured passage beside a run, as data and as text, page, tables and JSON.

Data are the histories of both, figures, findings and remarks.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from catenary.postproc.evaluate.wording import UNCOMPARED, VERDICTS
from catenary.postproc.files.disk import plain, write_all
from catenary.postproc.measurements.alignment import Alignment
from catenary.postproc.report.page import Picture, Section, Text, page
from catenary.postproc.report.study_table import Column, StudyTable, file_table

# Source of the tolerances that a description may replace.
LINE_TEST = "comparison with a line test, EN 50318"
PAGE, SUMMARY, FIGURES = "measurement.html", "measurement.json", "figures.csv"
FORCES, UPLIFTS = "forces.csv", "uplifts.csv"
_FORCE, _UPLIFT = "measured_force", "measured_uplift"
NO_ERRORS = "No error is seen: the measurement is that of this run, but for noise."
WHOSE = "An error is one of the measurement, of its description, or of the scene that was run."
_SOURCES = (
    f"Tolerances marked {UNCOMPARED} are from memory of the {LINE_TEST}, and were not compared "
    "with its text."
)


@dataclass(frozen=True)
class Finding:
    """An error of the measurement, or of its description.

    Attributes
    ----------
    kind : "shift", "drift", "gain", "filter", "sign", "unit", "missing pantograph",
        "other pantograph", "unlike", "height", "gaps" or "supports"
    pantograph : its name, empty if of none
    text : a sentence
    value : of what was found, in SI units, NaN without
    """

    kind: str
    pantograph: str
    text: str
    value: float = float("nan")


@dataclass(frozen=True)
class Compared:
    """A figure of run and measurement.

    Attributes
    ----------
    figure, pantograph, unit : in words; the unit is that of the values
    run, measured : values
    tolerance : how far they may differ, NaN where none is known
    passed : None if it is not judged
    because : why it is not judged
    source : of the tolerance
    """

    figure: str
    pantograph: str
    unit: str
    run: float
    measured: float
    tolerance: float
    passed: bool | None
    because: str
    source: str


@dataclass(frozen=True)
class Overlay:
    """Histories of a pantograph on the run's places.

    Attributes
    ----------
    pantograph : its name
    place : (n,) of the measured samples on the run's line [m]
    measured, run : (n,) forces below the cut-off [N]
    measured_height, run_height : (n,) heights of the head likewise [m], NaN in gaps of the
        measured ones, None if not measured
    alignment : None if it could not be aligned
    """

    pantograph: str
    place: np.ndarray
    measured: np.ndarray
    run: np.ndarray
    measured_height: np.ndarray | None
    run_height: np.ndarray | None
    alignment: Alignment | None


@dataclass(frozen=True)
class UpliftAtSupports:
    """Largest uplifts (n,) at supports [m], by their places in the run [m]."""

    place: np.ndarray
    measured: np.ndarray
    run: np.ndarray


@dataclass
class Comparison:
    """A measured passage beside a run.

    Attributes
    ----------
    measured, run, lead : names of both, and a sentence on the run
    remarks : sentences on damage, on the noise floor, and on what cannot be told apart
    overlays : of the pantographs that were measured
    uplift : None if it was not measured
    figures : of run and measurement
    findings : errors; empty if there is none
    """

    measured: str
    run: str
    lead: str
    remarks: list[str]
    overlays: list[Overlay] = field(default_factory=list)
    uplift: UpliftAtSupports | None = None
    figures: list[Compared] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    @property
    def passed(self) -> bool | None:
        """Whether all judged figures are within their tolerances, None if none is judged."""
        judged = [one.passed for one in self.figures if one.passed is not None]
        return all(judged) if judged else None


def _figures_table(found: Comparison) -> StudyTable:
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
    return StudyTable(
        columns,
        [
            {
                **vars(one),
                "difference": one.run - one.measured,
                "tolerance": None if np.isnan(one.tolerance) else one.tolerance,
                "verdict": VERDICTS[one.passed]
                + (f" {UNCOMPARED}" if one.source == LINE_TEST and one.passed is not None else ""),
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
    return "\n".join([*lines, _figures_table(found).text(), _SOURCES])


def _summary_of(found: Comparison) -> dict[str, Any]:
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
            "figures": _figures_table(found).records(),
            "remarks": list(found.remarks),
        }
    )
    return content


def _forces_table(found: Comparison) -> StudyTable:
    """Places on the run's line, and forces and head heights there, of all pantographs."""
    names = ["pantograph", "place_m", "measured_N", "run_N", "measured_height_m", "run_height_m"]
    rows = []
    for one in found.overlays:
        histories = [one.place, one.measured, one.run]
        for heights in (one.measured_height, one.run_height):
            histories.append(np.full(one.place.size, np.nan) if heights is None else heights)
        rows += [[one.pantograph, *plain(row)] for row in np.stack(histories, axis=1).tolist()]
    return file_table(names, rows)


def _uplifts_table(found: Comparison) -> StudyTable:
    """Supports with their largest uplifts; empty if these were not measured."""
    names = ["place_m", "measured_mm", "run_mm"]
    own, rows = found.uplift, []
    if own is not None:
        values = np.stack([own.place, 1e3 * own.measured, 1e3 * own.run], axis=1)
        rows = [dict(zip(names, row, strict=True)) for row in values.tolist()]
    heads = ("support at [m]", "measured [mm]", "run [mm]")
    columns = [Column(name, head, ".1f") for name, head in zip(names, heads, strict=True)]
    return StudyTable(columns, rows, "Largest uplifts at supports")


def write_comparison(folder: Path, found: Comparison) -> list[Path]:
    """Write page, tables, JSON and pictures into a folder; returns the files. Not collective.

    Parameters
    ----------
    folder : Path
        Folder, which is made if it is not there.
    found : Comparison
        Comparison of a run with a measured passage.
    """
    # A text does without Matplotlib.
    from catenary.postproc.report.pictures import along_track
    from catenary.postproc.report.pictures.figures import painted

    panels = [
        (one.pantograph, [("run", one.place, one.run), ("measured", one.place, one.measured)])
        for one in found.overlays
    ]
    own = found.uplift
    uplifts = own and [("run", own.place, own.run), ("measured", own.place, own.measured)]
    pictures = painted(_FORCE, lambda: along_track.overlaid_forces(panels))
    pictures |= painted(_UPLIFT, lambda: along_track.overlaid_uplifts(uplifts or ()))
    content: dict[str, bytes | str] = {f"{name}.png": data for name, data in pictures.items()}
    content[FIGURES], content[FORCES] = _figures_table(found).csv(), _forces_table(found).csv()
    if found.uplift is not None:
        content[UPLIFTS] = _uplifts_table(found).csv()
    content[SUMMARY] = json.dumps(_summary_of(found), indent=2) + "\n"
    title = f"{found.measured} beside {Path(found.run).parent.name}"
    content[PAGE] = page(title, f"{found.lead}.", _sections(found), pictures)
    return write_all(folder, content)


def _sections(found: Comparison) -> Iterator[Section]:
    errors = [Text(one.text, "bad", "Error: ") for one in found.findings]
    yield Section("Errors", [*errors, Text(WHOSE)] if errors else [Text(NO_ERRORS, "good")])
    force = Picture(_FORCE, "Contact forces below the cut-off, at the run's positions")
    table = replace(_figures_table(found), title="")
    yield Section("Figures", [table], [force] if found.overlays else [])
    if found.uplift is not None:
        uplift = Picture(_UPLIFT, "Largest uplifts at supports")
        yield Section("Uplift", [replace(_uplifts_table(found), title="")], [uplift])
    yield Section("Remarks", [Text(text, "remark") for text in found.remarks])
