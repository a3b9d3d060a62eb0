"""Dynamics of force and line: statistics of the contact force, spectra, heights, the worst places.

Statistics stand beside what they are worth; full reports also have spectra, height and gradient of
the contact point, and every support and dropper, of many the extremes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.wires import Role
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.statistics import slack_times
from catenary.postproc.evaluate.wording import wire_words
from catenary.postproc.read.results import Results
from catenary.postproc.report.page import EvaluatedRun, Picture, Section, Text, number
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
# Places that a table shows all of, and extremes of each kind that it shows of more.
_FEW, _EXTREMES = 12, 5


def contact_force(run: EvaluatedRun) -> Section:
    """The statistics of all pantographs beside each other."""
    return Section("Contact force", _force_blocks(run), _force_pictures(run))


def _force_blocks(run: EvaluatedRun) -> Iterator[StudyTable]:
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


def _force_pictures(run: EvaluatedRun) -> Iterator[Picture]:
    from catenary.postproc.report.pictures import force_pictures as forces

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
        yield Picture("lateral_place", text, lambda: forces.lateral_places(results))
    known = len(statistics.pantographs) - len(statistics.complaints)
    if known > 1:  # of one the table says it all
        text = "Statistics of the contact force in the evaluation stretch, below 20 Hz."
        yield Picture("statistics", text, lambda: forces.force_statistics(statistics))
    if known:
        text = "Histogram of the contact force in the evaluation stretch, below 20 Hz."
        yield Picture("histogram", text, lambda: forces.force_histogram(statistics))


def has_statistics(run: EvaluatedRun) -> bool:
    """Whether the record of a pantograph covers the evaluation stretch."""
    return len(run.statistics.complaints) < len(run.statistics.pantographs)


def spectrum(run: EvaluatedRun) -> Section:
    """Spectra of the contact forces; height and gradient of the contact points."""
    return Section("Spectrum and contact height", _spectrum_blocks(run), _spectrum_pictures(run))


def _spectrum_blocks(run: EvaluatedRun) -> Iterator[Text | StudyTable]:
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
    """Lengths by which the line repeats [m]: of spans, and between droppers of contact wires if it
    has any."""
    masts = results.line("support_x")
    found = {"span": float(np.median(np.diff(masts)))}
    is_contact = np.array([role is Role.CONTACT for role in results.roles.values()])
    chosen = is_contact[results.dropper_wires()[:, 1]]
    chosen &= results.line("dropper_span") == results.reference_span
    own = np.unique(results.line("dropper_x")[chosen])
    if own.size > 1:
        found["dropper"] = float(np.median(np.diff(own)))
    return found


def contact_height(
    results: Results, pantograph: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Places (n,) of a ``pantograph``, by its number [m], height of the contact wire there [m] and
    its gradient [-], 20 Hz low-pass.

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


def _spectrum_pictures(run: EvaluatedRun) -> Iterator[Picture]:
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
    """Tables of the evaluated supports and droppers, of many only the extremes."""
    return Section("Supports and droppers", _tables(run))


def _tables(run: EvaluatedRun) -> Iterator[StudyTable]:
    results, supports, droppers = run.results, run.statistics.supports, run.statistics.droppers
    limit = run.limit("arm_uplift")
    wires = [wire_words(name) for name in results.arm_wires()]
    several = len(set(wires)) > 1
    uplift = 1e3 * supports.uplift
    chosen = _extremes(supports.evaluated, {"": uplift}, uplift > limit)
    rows = [
        [number(supports.x[n], 2), *([wires[n]] if several else ()), number(uplift[n]),
         number(limit - uplift[n])]
        for n in chosen
    ]  # fmt: skip
    if rows:
        heads = ["position [m]", *(["wire"] if several else ()), "largest uplift [mm]"]
        right = {0, len(heads) - 1, len(heads)}
        title = "Uplift at the evaluated steady arms"
        note = _note(len(rows), int(supports.evaluated.sum()), "summary.json")
        yield texts_table([*heads, "margin [mm]"], rows, right, title, note)
    at_rest, slack = results.static("dropper_force"), slack_times(results)
    names = [wire_words(name) for name in results.roles]
    carried = [names[wire] for wire in results.dropper_wires()[:, 1].tolist()]
    several = len(set(carried)) > 1
    # The least force of all that slacken is zero; one that never carries is missing or too long.
    longest = np.where((slack > 0.0) & (droppers.highest > 0.0), slack, np.nan)
    slackened = bool(np.isfinite(longest[droppers.evaluated]).any())
    least = {"longest slack": longest} if slackened else {"least force": -droppers.lowest}
    kinds = {"largest force": droppers.highest, **least}
    allowed = run.limit("dropper_force_max")
    chosen = _extremes(droppers.evaluated, kinds, droppers.highest > allowed)
    rows = [
        [number(droppers.x[n], 2), *([carried[n]] if several else ()), number(at_rest[n]),
         number(droppers.highest[n]), number(droppers.lowest[n]), number(slack[n], 3),
         ", ".join(words)]
        for n, words in chosen.items()
    ]  # fmt: skip
    if rows:
        heads = ["position [m]", *(["carries"] if several else ())]
        right = {0, *range(len(heads), len(heads) + 4)}
        heads += ["at rest [N]", "largest [N]", "least [N]", "slack [s]", "among the extremes"]
        recorded = "" if results.line_record.whole else ", as far as it is recorded"
        note = f"Forces over the whole run; slack is the time without force{recorded}. "
        note += _note(len(rows), int(droppers.evaluated.sum()), "droppers.csv")
        yield texts_table(heads, rows, right, "Evaluated droppers", note)


def _extremes(
    evaluated: np.ndarray, kinds: Mapping[str, np.ndarray], beyond: np.ndarray
) -> dict[int, list[str]]:
    """Places of a table in their order, each with the kinds of extremes that it is among.

    All places stand there if they are few; of many the largest of each kind, and those beyond
    limits.

    Parameters
    ----------
    evaluated, beyond : ndarray of bool, shape (n,)
        Whether a place is evaluated, and beyond a limit.
    kinds : mapping
        Values (n,) by the name of their kind; NaN is never an extreme.
    """
    all_of = np.flatnonzero(evaluated)
    found: dict[int, list[str]] = {n: [] for n in all_of.tolist()} if all_of.size <= _FEW else {}
    for word, values in kinds.items():
        known = all_of[np.isfinite(values[all_of])]
        for n in known[np.argsort(-values[known], kind="stable")][:_EXTREMES].tolist():
            found.setdefault(n, []).append(word)
    for n in np.flatnonzero(evaluated & beyond).tolist():
        found.setdefault(n, []).append("beyond the limit")
    return dict(sorted(found.items()))


def _note(n_shown: int, n_all: int, file: str) -> str:
    """Sentence on the rows that a table leaves out; empty if it has all."""
    if n_shown == n_all:
        return ""
    return f"{n_shown} of {n_all} are shown, the extremes and any beyond a limit; {file} has all."
