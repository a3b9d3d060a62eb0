"""The report of a run: ``report.html`` with its pictures, ``summary.json``, ``droppers.csv``.

It reads the result file and nothing else, and works for unfinished runs as well.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate.statistics import RunStatistics
from catenary.postproc.evaluate.verdict import Criterion, criteria_of
from catenary.postproc.evaluate.wording import counted
from catenary.postproc.files.disk import write_into
from catenary.postproc.files.own_files import CHANNEL_PICTURE, PICTURES, REPORT_FILES, remove_stale
from catenary.postproc.read.results import Results
from catenary.postproc.read.validation import Records
from catenary.postproc.report.page import (
    EvaluatedRun,
    Picture,
    Section,
    SectionEntry,
    has_train,
    number,
    page,
    pdf,
    refuse_without_pdf,
)
from catenary.postproc.report.sections import acceptance, dynamics, line, run_facts
from catenary.postproc.report.summary import as_json, summarise
from catenary.postproc.standards.rule_books import KMH

logger = logging.getLogger("catenary.report")


# The sections of a report in their order.
SECTIONS: list[SectionEntry] = [
    SectionEntry("verdict", acceptance.status),
    SectionEntry("acceptance", acceptance.section, has_train),
    SectionEntry("checks", run_facts.checks),
    SectionEntry("force", dynamics.contact_force, has_train),
    SectionEntry("spectrum", dynamics.spectrum, dynamics.has_statistics, full=True),
    SectionEntry("motion", line.in_motion),
    SectionEntry("places", dynamics.places, dynamics.has_places, full=True),
    SectionEntry("rest", line.at_rest),
    SectionEntry("above", line.from_above, line.has_registration),
    SectionEntry("effects", run_facts.effects),
    SectionEntry("run", run_facts.section),
]


def quick_sections() -> list[SectionEntry]:
    """Sections that a run writes when it ends."""
    return [entry for entry in SECTIONS if not entry.full]


@dataclass(frozen=True)
class Report:
    """Written files of a report, its criteria, and ``verdict`` (None: not judged)."""

    files: list[Path]
    criteria: list[Criterion]
    verdict: bool | None


def write_report(
    result_path: Path | str,
    out_dir: Path | str,
    records: Records | None = None,
    entries: Sequence[SectionEntry] | None = None,
    beside: Mapping[str, str] | None = None,
    *,
    measured: tuple[Mapping[str, float], str] = ({}, ""),
    vector: bool = False,
    on_paper: bool = False,
    interactive: bool = False,
) -> Report:
    """Write summary, report, pictures and dropper table of a run into a folder. Not collective.

    Each file appears whole or not at all. The summary is written before the first picture is
    drawn, and a picture that cannot be drawn is left out with a remark. Files of an earlier report
    that are not written again are removed.

    Parameters
    ----------
    result_path : Path or str
        Result file or its folder.
    out_dir : Path or str
        Folder that exists.
    records : Records, optional
        What ``guard.examined`` found in the file; without it the file is checked here.
    entries : sequence of SectionEntry, optional
        Sections; those of ``quick_sections`` without it.
    beside : mapping, optional
        Texts of further files by name.
    measured : tuple, optional
        Errors of quantities that a study measured, in their units, and the study, as
        ``EvaluatedRun`` has them.
    vector : bool, optional
        Whether pictures are SVG files instead of PNG files.
    on_paper : bool, optional
        Whether ``report.pdf`` is written too.
    interactive : bool, optional
        Whether ``report_interactive.html`` is written too, whose pictures are Plotly's.

    Raises
    ------
    InputError
        If ``result_path`` is no result file, or too damaged; if a library for PDF or Plotly is
        missing.
    RunBroken
        If a file cannot be written.
    """
    out = Path(out_dir)
    if on_paper:
        refuse_without_pdf()
    program = ""
    if interactive:
        from catenary.postproc.report.pictures.interactive import script

        program = script()
    with Results(result_path, records) as results:
        for sentence in results.damage:
            logger.warning("%s", sentence)
        statistics = stats.evaluate(results)
        criteria = criteria_of(results, statistics)
        run = EvaluatedRun(results, statistics, criteria, *measured)
        summary = as_json(summarise(results, statistics, criteria, run.indicators))
        content: dict[str, bytes | str] = {"droppers.csv": line.droppers_csv(results)}
        content |= beside or {}
        registration = results.registration()
        if registration is not None:
            content["registration.csv"] = registration.csv()
        files = write_into(out, {"summary.json": summary, **content})
        shown = {
            entry.name: _with_lists(entry.name, entry.make(run))
            for entry in (quick_sections() if entries is None else entries)
            if entry.applies(run)
        }
        pictures = _painted(shown.values(), "svg" if vector else "png")
        html = _page(run, shown, _by_stem(pictures))
        content = {**pictures, "report.html": html}
        if interactive:
            plots = _by_stem(_painted(shown.values(), "json"))
            texts = {name: data.decode() for name, data in plots.items()}
            page_of_plots = _page(run, shown, _by_stem(pictures), texts, program)
            content["report_interactive.html"] = page_of_plots
        if on_paper:
            content["report.pdf"] = pdf(html)
        files += write_into(out, content)
    remove_stale(out, set(REPORT_FILES).difference(path.name for path in files))
    return Report(files, criteria, run.verdict if run.results.complete else None)


def write_summary(result_path: Path | str, out_dir: Path | str) -> None:
    """Write ``summary.json`` of a run alone. Not collective.

    Files of an earlier report are removed: they may tell of a run that has gone on since.

    Parameters
    ----------
    result_path : Path or str
        Result file or its folder.
    out_dir : Path or str
        Folder that exists.

    Raises
    ------
    InputError
        If ``result_path`` is no result file.
    """
    with Results(result_path) as results:
        statistics = stats.evaluate(results)
        criteria = criteria_of(results, statistics)
        text = as_json(summarise(results, statistics, criteria))
    write_into(Path(out_dir), {"summary.json": text})
    remove_stale(Path(out_dir), set(REPORT_FILES).difference(["summary.json"]))


def drawings(results: Results, statistics: RunStatistics) -> Iterator[Picture]:
    """Pictures of a run in their order, each with the function that draws it. Not collective.

    Parameters
    ----------
    results : Results
        Results of the run.
    statistics : RunStatistics
        Its statistics.
    """
    run = EvaluatedRun(results, statistics, criteria_of(results, statistics))
    for entry in SECTIONS:
        if entry.applies(run):
            yield from entry.make(run).pictures


def _with_lists(name: str, section: Section) -> Section:
    """The section of a name with its parts in lists, which several pages go through.

    Raises
    ------
    ValueError
        If ``PICTURES`` lacks one of its pictures, which no later report would remove.
    """
    _, blocks, pictures, folded = section
    pictures = list(pictures)
    unknown = {one.name for one in pictures}.difference(PICTURES.get(name, ()))
    unknown = {one for one in unknown if not one.startswith(CHANNEL_PICTURE)}
    if unknown:
        raise ValueError(f"own_files.PICTURES of section {name} lacks {sorted(unknown)}")
    return section._replace(blocks=list(blocks), pictures=pictures, folded=list(folded))


def _painted(sections: Iterable[Section], kind: str) -> dict[str, bytes]:
    """The files of all pictures but the ones that cannot be drawn, which are logged."""
    # A summary alone does without Matplotlib.
    from catenary.postproc.report.pictures import figures

    painted: dict[str, bytes] = {}
    with figures.own_style():  # set once for all of them
        for section in sections:
            for name, _, draw in section.pictures:
                painted |= figures.painted(f"{name}.{kind}", draw)
    return painted


def _by_stem(files: Mapping[str, bytes]) -> dict[str, bytes]:
    return {Path(name).stem: data for name, data in files.items()}


def _page(
    run: EvaluatedRun,
    sections: Mapping[str, Section],
    pictures: Mapping[str, bytes],
    plots: Mapping[str, str] | None = None,
    script: str = "",
) -> str:
    """The page of a run; the files of its pictures by name, others as for ``page``."""
    results = run.results
    start, end = (number(place, 0) for place in results.evaluation)
    program, version = next(iter(results.attributes["versions"].items()))
    speed = number(KMH * results.fact("speed"), 0)
    moves = run.excitation or f"{speed} km/h, {counted(results.n_pantographs, 'pantograph')}"
    lead = (
        f"Case {results.attributes['case']}: {moves}, evaluated from {start} to {end} m. "
        f"Simulated on {str(results.attributes['created'])[:10]} by {program} {version}."
    )
    title = results.attributes["title"]
    return page(title, lead, sections.values(), pictures, list(sections), plots, script)
