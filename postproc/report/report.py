"""The report of a run: ``report.html`` with its pictures, ``summary.json``, ``droppers.csv``.

It reads the result file and nothing else, and works for unfinished runs as well.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate import verdict as acceptance
from catenary.postproc.evaluate.acceptance import criteria_of
from catenary.postproc.evaluate.statistics import RunStatistics
from catenary.postproc.evaluate.verdict import Criterion
from catenary.postproc.evaluate.wording import counted
from catenary.postproc.files.disk import write_into
from catenary.postproc.read.records import Records
from catenary.postproc.read.results import Results
from catenary.postproc.report import csv_tables
from catenary.postproc.report.page import page
from catenary.postproc.report.sections import acceptance as acceptance_section
from catenary.postproc.report.sections import contact_force, line, run_facts
from catenary.postproc.report.sections.section import EvaluatedRun, Picture, Section, number
from catenary.postproc.report.summary import as_json, summarise
from catenary.postproc.standards.supplies import KMH

logger = logging.getLogger("catenary.report")


# The sections of a report in their order.
SECTIONS: list[Callable[[EvaluatedRun], Section]] = [
    acceptance_section.status,
    acceptance_section.section,
    contact_force.section,
    line.in_motion,
    line.at_rest,
    line.from_above,
    run_facts.effects,
    run_facts.section,
]


@dataclass(frozen=True)
class Report:
    """What was written and found: the files, the criteria, and ``verdict`` (None: not judged)."""

    files: list[Path]
    criteria: list[Criterion]
    verdict: bool | None


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
        criteria = criteria_of(results, statistics)
        run = EvaluatedRun(results, statistics, criteria)
        summary = as_json(summarise(results, statistics, criteria, run.indicators))
        content: dict[str, bytes | str] = {"droppers.csv": csv_tables.droppers_csv(results)}
        registration = results.registration()
        if registration is not None:
            content["registration.csv"] = registration.csv()
        files = write_into(out, {"summary.json": summary, **content})
        pictures = _painted(run)
        content = {f"{name}.png": data for name, data in pictures.items()}
        files += write_into(out, {**content, "report.html": _page(run, pictures)})
    return Report(files, criteria, run.verdict if run.results.complete else None)


def write_summary(result_path: Path | str, out_dir: Path | str) -> bool | None:
    """Write ``summary.json`` of a run alone; returns the verdict as ``Report``. Not collective.

    Raises
    ------
    InputError
        If ``result_path`` is no result file.
    """
    with Results(result_path) as results:
        statistics = stats.evaluate(results)
        criteria = criteria_of(results, statistics)
        text = as_json(summarise(results, statistics, criteria))
        verdict = acceptance.verdict(criteria) if results.complete else None
    write_into(Path(out_dir), {"summary.json": text})
    return verdict


def drawings(results: Results, statistics: RunStatistics) -> Iterator[Picture]:
    """What makes each picture of a run, in their order."""
    yield from _pictures(EvaluatedRun(results, statistics, criteria_of(results, statistics)))


def _pictures(run: EvaluatedRun) -> Iterator[Picture]:
    """What makes each picture of a run that has been judged, in their order."""
    for section in SECTIONS:
        yield from section(run).pictures


def _painted(run: EvaluatedRun) -> dict[str, bytes]:
    """The pictures of a run as PNG, without those that cannot be drawn, which is logged."""
    # A summary alone does without Matplotlib.
    from catenary.postproc.report.pictures import figures

    painted: dict[str, bytes] = {}
    for name, _, draw in _pictures(run):
        painted.update(zip([name], figures.painted(f"{name}.png", draw).values(), strict=False))
    return painted


def _page(run: EvaluatedRun, pictures: Mapping[str, bytes]) -> str:
    """The page of a run, with the PNG files of its pictures by name."""
    results = run.results
    start, end = (number(place, 0) for place in results.evaluation)
    lead = (
        f"Case {results.attributes['case']}: {number(KMH * results.fact('speed'), 0)} km/h, "
        f"{counted(results.n_pantographs, 'pantograph')}, evaluated from {start} to {end} m."
    )
    return page(results.attributes["title"], lead, [make(run) for make in SECTIONS], pictures)
