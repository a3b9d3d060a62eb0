"""The report of a run: ``report.html`` with its pictures, ``summary.json``, ``droppers.csv``.

It reads the result file and nothing else, and works for unfinished runs as well.
"""

from __future__ import annotations

import base64
import json
import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from catenary.meshgen.slowest_wave import bends
from catenary.postproc.channels.line_record import says
from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate import verdict as acceptance
from catenary.postproc.evaluate.error_indicators import Indicators, indicate
from catenary.postproc.evaluate.remarks import all_remarks
from catenary.postproc.evaluate.statistics import RunStatistics
from catenary.postproc.evaluate.verdict import Criterion
from catenary.postproc.evaluate.wording import counted, decimals_that_tell, fixed
from catenary.postproc.files.disk import write_into
from catenary.postproc.read.records import Records
from catenary.postproc.read.results import Results
from catenary.postproc.report import csv_tables
from catenary.postproc.report.summary import as_json, real_time_factor, summarise
from catenary.postproc.standards import en50367 as standards
from catenary.postproc.standards.en50367 import KMH

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    # Name of the file without its end, caption, and what makes the figure, if there is one.
    Drawing = tuple[str, str, Callable[[], Figure | None]]

logger = logging.getLogger("catenary.report")

_TEMPLATES = Path(__file__).parent / "templates"
_STATISTICS_ROWS = (
    ("mean", "mean", "N", 1.0, 1),
    ("standard deviation", "std", "N", 1.0, 1),
    ("standard deviation, 0-5 Hz", "std_0_5", "N", 1.0, 1),
    ("standard deviation, 5-20 Hz", "std_5_20", "N", 1.0, 1),
    ("maximum", "maximum", "N", 1.0, 1),
    ("minimum", "minimum", "N", 1.0, 1),
    ("mean + 3 sigma", "stat_max", "N", 1.0, 1),
    ("mean - 3 sigma", "stat_min", "N", 1.0, 1),
    ("loss of contact (unfiltered)", "loss_percent", "%", 1.0, 3),
    ("losses of 5 ms and longer", "arcing_percent", "%", 1.0, 3),
    ("contact height range", "contact_height_range", "mm", 1e3, 1),
)


# Counters of summary.json that say how the contact problem was solved, not what came of it.
_OF_THE_SOLVER = ("steps", "rounds", "repeated_steps", "pivoted_steps")


@dataclass(frozen=True)
class Report:
    """What was written and found: the files, the criteria, and ``verdict`` (None: not judged)."""

    files: list[Path]
    criteria: list[Criterion]
    verdict: bool | None


@dataclass(frozen=True)
class _Picture:
    name: str
    caption: str
    data: bytes

    @property
    def uri(self) -> str:
        return "data:image/png;base64," + base64.b64encode(self.data).decode("ascii")


def write_report(
    result_path: Path | str, out_dir: Path | str, records: Records | None = None
) -> Report:
    """Write summary, report, pictures and dropper table of a run into a folder. Not collective.

    Each file appears whole or not at all. The summary is written before the first picture is
    drawn, and a picture that cannot be drawn is left out with a remark.

    Parameters
    ----------
    result_path : result file or its folder
    out_dir : folder that exists
    records : what ``evaluate.guard`` found in the file, None to check it here

    Raises
    ------
    InputError
        If ``result_path`` is no result file, or too damaged.
    RunBroken
        If a file cannot be written.
    """
    out = Path(out_dir)
    with Results(result_path, records) as results:
        for sentence in results.damage:
            logger.warning("%s", sentence)
        statistics = stats.evaluate(results)
        criteria = judge(results, statistics)
        found = indicate(results)
        summary = as_json(summarise(results, statistics, criteria, found))
        content: dict[str, bytes | str] = {"droppers.csv": csv_tables.droppers_csv(results)}
        registration = results.registration()
        if registration is not None:
            content["registration.csv"] = registration.csv()
        files = write_into(out, {"summary.json": summary, **content})
        pictures = _pictures(results, statistics)
        html = _html(results, statistics, criteria, found, pictures)
        content = {f"{p.name}.png": p.data for p in pictures}
        files += write_into(out, {**content, "report.html": html})
        verdict = acceptance.verdict(criteria) if results.complete else None
    return Report(files, criteria, verdict)


def write_summary(result_path: Path | str, out_dir: Path | str) -> bool | None:
    """Write ``summary.json`` of a run alone; returns the verdict as ``Report``. Not collective.

    Raises
    ------
    InputError
        If ``result_path`` is no result file.
    """
    with Results(result_path) as results:
        statistics = stats.evaluate(results)
        criteria = judge(results, statistics)
        text = as_json(summarise(results, statistics, criteria))
        verdict = acceptance.verdict(criteria) if results.complete else None
    write_into(Path(out_dir), {"summary.json": text})
    return verdict


def judge(results: Results, statistics: RunStatistics) -> list[Criterion]:
    """The criteria of the edition and system that the result file names. Not collective."""
    about, slowest = results.attributes, results.fact("wave_speed")
    tensions = results.facts_of_wires("contact_wire_tension")
    masses = results.facts_of_wires("contact_wire_mass")
    return acceptance.judge(
        statistics,
        results.fact("speed"),
        slowest,
        about["system"],
        about["edition"],
        all(bends(slowest, tensions[wire], masses[wire]) for wire in tensions),
    )


def _pictures(results: Results, statistics: RunStatistics) -> list[_Picture]:
    """The pictures of a run, without those that cannot be drawn, which is logged."""
    # A summary alone does without Matplotlib.
    from catenary.postproc.report.pictures import figures

    pictures = []
    for name, caption, draw in drawings(results, statistics):
        data = figures.painted(f"{name}.png", draw)
        pictures += [_Picture(name, caption, content) for content in data.values()]
    return pictures


def drawings(results: Results, statistics: RunStatistics) -> Iterator[Drawing]:
    """Name, caption and what makes the figure of each picture of a run, in their order."""
    from catenary.postproc.report.pictures import (
        channel_pictures,
        force_pictures,
        lateral_picture,
        line_pictures,
        plan_view,
    )

    if results.n_rows("time") > 1:
        text = "Contact force along the track."
        yield "contact_force", text, lambda: force_pictures.contact_force(results)
        if results.several_strips:
            text = "Shares of the collector strips in the contact force, below 20 Hz."
            yield "strip_forces", text, lambda: force_pictures.strip_forces(results)
        if results.has("contact_wire_force"):
            text = "Shares of the contact wires in the contact force, below 20 Hz."
            yield "wire_forces", text, lambda: force_pictures.wire_forces(results)
        if results.has("lateral_place"):
            text = "Lateral place of the contact wires on the strips."
            yield "lateral_place", text, lambda: lateral_picture.lateral_places(results)
        if len(statistics.complaints) < len(statistics.pantographs):
            text = "Contact force in the evaluation stretch."
            yield "statistics", text, lambda: force_pictures.force_statistics(results, statistics)
            text = "Distribution of the contact force in the evaluation stretch."
            yield "histogram", text, lambda: force_pictures.force_histogram(results, statistics)
        if statistics.supports.x.size:
            limit = standards.EDITIONS[results.attributes["edition"]].arm_uplift
            text = "Uplift of the contact wire at the steady arms."
            yield "uplift", text, lambda: line_pictures.arm_uplift(results, statistics, limit)
        if statistics.droppers.x.size:
            text = "Dropper forces."
            yield "droppers", text, lambda: line_pictures.dropper_force(results, statistics)
    yield from channel_pictures.channel_pictures(results)
    text = "Profile and elasticity of the line."
    yield "static", text, lambda: line_pictures.static_line(results)
    text = "The line at rest from above, and its steady arms."
    yield "plan_view", text, lambda: plan_view.plan_view(results)
    yield "energy", "Energies of the line.", lambda: line_pictures.energies(results)


def _html(
    results: Results,
    statistics: RunStatistics,
    criteria: list[Criterion],
    indicators: Indicators,
    pictures: list[_Picture],
) -> str:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = _number
    about = results.attributes
    return environment.get_template("report.html.j2").render(
        about=about,
        results=results,
        statistics=statistics,
        statistics_rows=_statistics_rows(statistics)
        + _error_rows(indicators)
        + _violation_row(results),
        criteria=criteria,
        digits=lambda c: decimals_that_tell(c.value, c.limit, 3 if c.unit == "%" else 1),
        failed=[c for c in criteria if c.passed is False],
        verdict=acceptance.verdict(criteria),
        edition=standards.EDITIONS[about["edition"]].title,
        system=standards.SYSTEMS[about["system"]],
        speed_km_h=KMH * results.fact("speed"),
        wave_speed_km_h=KMH * results.fact("wave_speed"),
        droppers=csv_tables.dropper_table(results),
        several_hangers=csv_tables.joins_several(results),
        registration=results.registration(),
        lateral=_lateral_places(results),
        reference_span=results.reference_span + 1,
        elasticity=1e3 * results.static("elasticity"),
        remarks=[*results.damage, *all_remarks(results, indicators)],
        facts=_facts(results) + _mesh_facts(indicators),
        phases=about.get("phase_wall_s", {}),
        config=json.dumps(about["config"], indent=2, ensure_ascii=False),
        pictures={p.name: p for p in pictures},
    )


def _lateral_places(results: Results) -> list[tuple[str, float, float]]:
    """Names of contact wires that move sideways, and from where to where they are at rest in the
    running spans, to the left [m]."""
    if not results.has_static("contact_y"):
        return []
    first, last = results.line("running_range")
    found = []
    for name, wire in results.contact_profiles().items():
        assert wire.y is not None
        own = wire.y[(wire.x >= first) & (wire.x <= last)]
        found.append((name, float(own.min()), float(own.max())))
    return found


def _statistics_rows(statistics: RunStatistics) -> list[tuple[str, str, list[str]]]:
    """Label, unit and the figures of all pantographs, row by row."""
    return [
        (label, unit, [_number(factor * getattr(p, name), digits) for p in statistics.pantographs])
        for label, name, unit, factor, digits in _STATISTICS_ROWS
    ]


def _error_rows(found: Indicators) -> list[tuple[str, str, list[str]]]:
    """What the time step is estimated to change, pantograph by pantograph."""
    label = "estimated error of the force history by the time step, 20 Hz, rms"
    shares = [f"{_number(100.0 * share, 2)}" for share in found.relative_error]
    return [
        (label, "N", [_number(float(error), 2) for error in found.force_error]),
        ("the same, of the standard deviation", "%", shares),
    ]


def _mesh_facts(found: Indicators) -> list[tuple[str, str]]:
    """The shortest waves of the mesh beside those that matter."""
    if np.isnan(found.resolved_frequency):
        return []
    required = (
        f"{found.required_frequency:.0f} Hz" if np.isfinite(found.required_frequency) else "–"
    )
    return [
        (
            "waves on the contact wire that the mesh carries within 1 %",
            f"up to {found.resolved_frequency:.0f} Hz; waves that 20 Hz at the pantograph excite "
            f"ahead of the train are as short as those of {required}",
        )
    ]


def _violation_row(results: Results) -> list[tuple[str, str, list[str]]]:
    """Joints of the whole run, where a pantograph has any in the time loop."""
    if not results.has_violations:
        return []
    found = results.largest_violations()
    return [
        ("largest open joint, whole run", "m", ["–" if v is None else f"{v:.1e}" for v in found])
    ]


def _facts(results: Results) -> list[tuple[str, str]]:
    about = results.attributes
    n_cells = sum(len(pairs) for pairs in results.elements().values())
    facts = [
        (
            "line",
            f"{counted(results.line('support_x').size - 1, 'span')}, "
            f"{results.line('support_x')[-1] - results.line('support_x')[0]:.0f} m, "
            f"{counted(results.line('dropper_x').size, 'dropper')}, "
            f"{counted(results.line('arm_x').size, 'steady arm')}",
        ),
        *(
            (name, f"{told['kind']}, {told['description']}")
            for name, told in zip(
                results.pantograph_names(), results.pantograph_words(), strict=True
            )
            if told
        ),
        ("mesh", f"{results.line('node_points').shape[0]} nodes, {n_cells} wire elements"),
        ("unknowns", f"{about['n_dofs']}"),
        ("ranks", f"{about['n_ranks']}"),
        *([("speed of steps", about["detour"])] if about.get("detour") else []),
        *([("window", about["window"])] if about.get("window") else []),
        *(("defect", fact["says"]) for fact in about.get("defects", [])),
        *(
            (f"incident at {fact['time_s']:.4g} s", fact["says"])
            for fact in about.get("incidents", [])
        ),
        *(("end of the line", says) for says in about.get("arrivals", {}).get("ends", [])),
        *(
            ("waves and run-in", fact["says"])
            for fact in about.get("arrivals", {}).get("pantographs", [])
        ),
        ("arm uplift and dropper forces", says(results.line_record, results.dt)),
        ("time step", f"{1e3 * results.dt:g} ms"),
        ("steps", f"{results.n_steps} of {about['n_steps_planned']}"),
        ("simulated time", f"{results.simulated:.3f} s"),
    ]
    if "march_wall_s" in about:
        facts.append(("wall time of the march", f"{about['march_wall_s']:.2f} s"))
    for name, with_records in (("steps", False), ("steps and all records", True)):
        factor = real_time_factor(results, with_records)
        if factor is not None:
            facts.append((f"real-time factor (simulated / wall), {name}", f"{factor:.2f}"))
    facts += [
        (name.replace("_", " "), f"{value}")
        for name, value in about.get("inner_iterations", {}).items()
        if name not in _OF_THE_SOLVER
    ]
    facts.append(("started", str(about["created"])))
    return facts


def _number(value: Any, digits: int = 1) -> str:
    """``value`` with ``digits`` decimals, a dash for NaN and None."""
    if value is None or value != value:
        return "–"
    return fixed(value, digits)
