"""Statistics of the contact force, what they are worth, and its pictures."""

from __future__ import annotations

from collections.abc import Iterator

from catenary.postproc.read.results import Results
from catenary.postproc.report.sections.section import EvaluatedRun, Picture, Section, number
from catenary.postproc.report.study_table import StudyTable, texts_table

_ROWS = (
    ("mean", "mean", "N", 1.0, 1),
    ("standard deviation", "std", "N", 1.0, 1),
    ("standard deviation, 0–5 Hz", "std_0_5", "N", 1.0, 1),
    ("standard deviation, 5–20 Hz", "std_5_20", "N", 1.0, 1),
    ("maximum", "maximum", "N", 1.0, 1),
    ("minimum", "minimum", "N", 1.0, 1),
    ("mean + 3 sigma", "stat_max", "N", 1.0, 1),
    ("mean − 3 sigma", "stat_min", "N", 1.0, 1),
    ("loss of contact (unfiltered)", "loss_percent", "%", 1.0, 3),
    ("losses of 5 ms and longer", "arcing_percent", "%", 1.0, 3),
    ("contact height range", "contact_height_range", "mm", 1e3, 1),
)


def section(run: EvaluatedRun) -> Section:
    """The statistics of all pantographs beside each other."""
    return Section("Contact force", _blocks(run), _pictures(run))


def _blocks(run: EvaluatedRun) -> Iterator[StudyTable]:
    pantographs, found = run.statistics.pantographs, run.indicators
    rows = [
        [label, unit, *(number(factor * getattr(p, name), digits) for p in pantographs)]
        for label, name, unit, factor, digits in _ROWS
    ]
    label = "estimated error of the force history by the time step, 20 Hz, rms"
    rows.append([label, "N", *(number(float(error), 2) for error in found.force_error)])
    shares = (number(100.0 * share, 2) for share in found.relative_error)
    rows += [
        ["this error relative to the standard deviation", "%", *shares],
        *_violations(run.results),
    ]
    heads = ["in the evaluation stretch", "unit", *(p.name for p in pantographs)]
    yield texts_table(heads, rows, set(range(2, len(heads))))


def _violations(results: Results) -> list[list[str]]:
    """Joints of the whole run, where a pantograph has any in the time loop."""
    if not results.has_violations:
        return []
    found = ["–" if v is None else f"{v:.1e}" for v in results.largest_violations()]
    return [["largest open joint, whole run", "m", *found]]


def _pictures(run: EvaluatedRun) -> Iterator[Picture]:
    from catenary.postproc.report.pictures import force_pictures as forces
    from catenary.postproc.report.pictures.force_pictures import lateral_places

    results, statistics = run.results, run.statistics
    if results.n_rows("time") < 2:
        return
    text = "Contact force along the track, unfiltered and below 20 Hz."
    yield Picture("contact_force", text, lambda: forces.contact_force(results))
    if results.several_strips:
        text = "Shares of the collector strips in the contact force, below 20 Hz."
        yield Picture("strip_forces", text, lambda: forces.strip_forces(results))
    if results.has("contact_wire_force"):
        text = "Shares of the contact wires in the contact force, below 20 Hz."
        yield Picture("wire_forces", text, lambda: forces.wire_forces(results))
    if results.has("lateral_place"):
        text = "Lateral position of the contact wires on the strips."
        yield Picture("lateral_place", text, lambda: lateral_places(results))
    known = len(statistics.pantographs) - len(statistics.complaints)
    if known > 1:  # of one the table says it all
        text = "Statistics of the contact force in the evaluation stretch, below 20 Hz."
        yield Picture("statistics", text, lambda: forces.force_statistics(statistics))
    if known:
        text = "Histogram of the contact force in the evaluation stretch, below 20 Hz."
        yield Picture("histogram", text, lambda: forces.force_histogram(statistics))
