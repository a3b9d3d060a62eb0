"""What the force and the line do in detail: spectra, contact height, every support and dropper."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from catenary.base.errors import InputError
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.statistics import slack_times
from catenary.postproc.read.results import Results
from catenary.postproc.report.sections.section import (
    EvaluatedRun,
    Folded,
    Picture,
    Section,
    Text,
    number,
)
from catenary.postproc.report.study_table import StudyTable, texts_table

# Rows of a table beyond which it is folded away.
_MOST = 200


def has_statistics(run: EvaluatedRun) -> bool:
    """Whether the record of a pantograph covers the evaluation stretch."""
    return len(run.statistics.complaints) < len(run.statistics.pantographs)


def section(run: EvaluatedRun) -> Section:
    """Spectra of the contact forces; height and gradient of the contact points."""
    return Section("Spectrum and contact height", _blocks(run), _pictures(run))


def _blocks(run: EvaluatedRun) -> Iterator[Text | StudyTable]:
    results = run.results
    rows = [
        [f"{word} passing frequency", number(results.fact("speed") / length, 2), "Hz",
         f"every {number(length, 2)} m"]
        for word, length in passing_lengths(results).items()
    ]  # fmt: skip
    yield texts_table(["", "value", "unit", "at the speed of the train"], rows, {1})
    heads = ["contact point, 20 Hz low-pass", "lowest [m]", "highest [m]", "steepest [‰]"]
    rows = []
    for p, name in enumerate(results.pantograph_names()):
        found = contact_height(results, p)
        if found is not None:
            x, height, gradient = found
            start, end = results.evaluation
            own = (x >= start) & (x <= end)
            steepest = 1e3 * float(np.abs(gradient[own]).max())
            ends = float(height[own].min()), float(height[own].max())
            rows.append([name, *(number(end, 4) for end in ends), number(steepest, 2)])
    yield texts_table(heads, rows, {1, 2, 3})


def passing_lengths(results: Results) -> dict[str, float]:
    """Lengths by which the line repeats [m]: of spans, and between droppers if it has any."""
    masts = results.line("support_x")
    found = {"span": float(np.median(np.diff(masts)))}
    own = np.unique(
        results.line("dropper_x")[results.line("dropper_span") == results.reference_span]
    )
    if own.size > 1:
        found["dropper"] = float(np.median(np.diff(own)))
    return found


def contact_height(
    results: Results, pantograph: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Places (n,) [m], height of the contact wire there [m] and its gradient [-], 20 Hz low-pass.

    None where the record does not cover the evaluation stretch or is too coarse for the filter.
    """
    position = results.column("contact_position", pantograph)
    start, end = results.evaluation
    if np.count_nonzero((position >= start) & (position <= end)) < 2:
        return None
    try:
        height = filters.low_pass(results.column("wire_height", pantograph), results.dt)
    except InputError:
        return None
    return position, height, np.gradient(height, position)


def _pictures(run: EvaluatedRun) -> Iterator[Picture]:
    from catenary.postproc.report.pictures import force_pictures as forces

    results = run.results
    lengths = passing_lengths(results)
    text = "Spectral density of the unfiltered contact force in the evaluation stretch."
    yield Picture("spectrum", text, lambda: forces.force_spectrum(results, lengths))
    heights = {
        name: found
        for p, name in enumerate(results.pantograph_names())
        if (found := contact_height(results, p)) is not None
    }
    text = "Height of the contact point and its gradient along the track, 20 Hz low-pass."
    yield Picture("contact_height", text, lambda: forces.contact_height(results, heights))


def has_places(run: EvaluatedRun) -> bool:
    """Whether a steady arm or a dropper is in the evaluation stretch."""
    statistics = run.statistics
    return bool(statistics.supports.evaluated.any() or statistics.droppers.evaluated.any())


def places(run: EvaluatedRun) -> Section:
    """Tables of the evaluated supports and droppers."""
    shown, folded = [], []
    for table in _tables(run):
        if len(table.rows) <= _MOST:
            shown.append(table)
        else:
            title = f"{table.title} ({len(table.rows)})"
            folded.append(Folded(title, replace(table, title="")))
    return Section("Supports and droppers", shown, folded=folded)


def _tables(run: EvaluatedRun) -> Iterator[StudyTable]:
    results, supports, droppers = run.results, run.statistics.supports, run.statistics.droppers
    limits = [c.limit for c in run.criteria if c.quantity == "arm_uplift" and c.limit == c.limit]
    wires = results.arm_wires()
    rows = []
    for n in np.flatnonzero(supports.evaluated).tolist():
        uplift = 1e3 * float(supports.uplift[n])
        left = number(min(limits) - uplift) if limits else "–"
        rows.append([number(supports.x[n], 2), wires[n].replace("_", " "), number(uplift), left])
    if rows:
        heads = ["position [m]", "wire", "largest uplift [mm]", "margin [mm]"]
        yield texts_table(heads, rows, {0, 2, 3}, "Uplift at the evaluated steady arms")
    at_rest, slack = results.static("dropper_force"), slack_times(results)
    names = [name.replace("_", " ") for name in results.roles]
    carried = [names[wire] for wire in results.dropper_wires()[:, 1].tolist()]
    several = len(set(carried)) > 1
    rows = [
        [*([carried[n]] if several else ()), number(droppers.x[n], 2),
         number(at_rest[n]), number(droppers.highest[n]),
         number(droppers.lowest[n]), number(slack[n], 3)]
        for n in np.flatnonzero(droppers.evaluated).tolist()
    ]  # fmt: skip
    if rows:
        heads = ["position [m]", "at rest [N]", "largest [N]", "least [N]", "slack [s]"]
        note = "Forces over the whole run; slack is the time without force."
        heads = [*(["carries"] if several else ()), *heads]
        right = set(range(len(heads) - 5, len(heads)))
        yield texts_table(heads, rows, right, "Evaluated droppers", note)
