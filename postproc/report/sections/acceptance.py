"""Whether a run is complete and accepted, and each criterion."""

from __future__ import annotations

from collections.abc import Iterator

from catenary.postproc.evaluate.acceptance import judged_by
from catenary.postproc.evaluate.verdict import Criterion, labels
from catenary.postproc.evaluate.wording import decimals_that_tell
from catenary.postproc.report.sections.section import EvaluatedRun, Section, Text, number
from catenary.postproc.report.study_table import StudyTable, texts_table
from catenary.postproc.standards.supplies import KMH

_RELATIONS = {"<=": "≤", "<": "<", ">=": "≥", ">": ">"}
_UNCOMPARED = "not compared with the text"
_WORDS = {None: "not judged", True: "passed", False: "failed"}
_BROKEN_OFF = {
    "running": "The file was not closed: the run is still going on or its program was ended.",
    "interrupted": "It was interrupted.",
}


def status(run: EvaluatedRun) -> Section:
    """What a reader is to know first."""
    return Section("", _status(run))


def _status(run: EvaluatedRun) -> Iterator[Text]:
    results, about = run.results, run.results.attributes
    if not results.complete:
        why = _BROKEN_OFF.get(results.outcome, f"It broke: {results.outcome}")
        yield Text(
            f"{why} What follows describes {results.n_steps} of {about['n_steps_planned']} steps "
            f"({number(results.simulated, 3)} s) and is no acceptance.",
            "open",
            "This run is not complete.",
        )
    by = judged_by(results, list(run.criteria))
    if run.verdict is None:
        yield Text(
            f"No criterion failed, but some could not be judged. {by}.", "open", "Not judged."
        )
    elif not run.verdict:
        failed = [
            _sentence(one, label)
            for one, label in zip(run.criteria, labels(run.criteria), strict=True)
            if one.passed is False
        ]
        yield Text(f"{by}. Failed:", "bad", "Not passed.", failed)
    elif results.complete:
        yield Text(f"{by}.", "good", "Passed.")
    yield from (Text(sentence, "open") for sentence in run.statistics.complaints)


def _figures(one: Criterion) -> tuple[str, str]:
    digits = decimals_that_tell(one.value, one.limit, 3 if one.unit == "%" else 1)
    return number(one.value, digits), number(one.limit, digits)


def _sentence(one: Criterion, label: str) -> str:
    value, limit = _figures(one)
    relation = _RELATIONS[one.relation]
    return f"{label}: {value} {one.unit}, must be {relation} {limit} {one.unit}"


def section(run: EvaluatedRun) -> Section:
    """All criteria with their limits."""
    return Section("Acceptance", _criteria(run))


def _criteria(run: EvaluatedRun) -> Iterator[Text | StudyTable]:
    rows, left = [], []
    for one, label in zip(run.criteria, labels(run.criteria), strict=True):
        if one.absent:
            left.append(f"{label}: because {one.because}")
            continue
        value, limit = _figures(one)
        source = one.clause if one.compared else f"{one.clause}; {_UNCOMPARED}"
        words = one.unit, _WORDS[one.passed], source
        rows.append([label, value, _RELATIONS[one.relation], limit, *words])
    yield texts_table(["criterion", "value", "", "limit", "unit", "", "source"], rows, {1, 3})
    if left:
        yield Text("for want of data or of a limit:", "open", "Not judged", left)
    speed = number(KMH * run.results.fact("wave_speed"), 0)
    yield Text(
        f"Wave speed of the contact wire: {speed} km/h. Forces are filtered by a 20 Hz low-pass "
        "(Butterworth, 6th order, forward and backward)."
    )
