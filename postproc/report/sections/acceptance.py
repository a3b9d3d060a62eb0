"""Whether a run is complete and accepted, and each criterion."""

from __future__ import annotations

from collections.abc import Iterator

from catenary.postproc.evaluate.verdict import Criterion
from catenary.postproc.evaluate.wording import decimals_that_tell
from catenary.postproc.report.sections.section import EvaluatedRun, Section, Text, number
from catenary.postproc.report.study_table import StudyTable, texts_table
from catenary.postproc.standards import en50367 as standards

_RELATIONS = {"<=": "≤", "<": "<", ">": ">"}
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
    edition = standards.EDITIONS[about["edition"]].title
    by = f"{edition} ({standards.SYSTEMS[about['system']]})"
    if run.verdict is None:
        yield Text("No criterion failed, but some could not be judged.", "open", "Not judged.")
    elif not run.verdict:
        failed = [_sentence(one) for one in run.criteria if one.passed is False]
        yield Text(f"Failed by {by}:", "bad", "Not passed.", failed)
    elif results.complete:
        yield Text(f"All criteria of {by} are met.", "good", "Passed.")
    yield from (Text(sentence, "open") for sentence in run.statistics.complaints)


def _figures(one: Criterion) -> tuple[str, str]:
    digits = decimals_that_tell(one.value, one.limit, 3 if one.unit == "%" else 1)
    return number(one.value, digits), number(one.limit, digits)


def _sentence(one: Criterion) -> str:
    value, limit = _figures(one)
    relation = _RELATIONS[one.relation]
    return f"{one.criterion}: {value} {one.unit}, must be {relation} {limit} {one.unit}"


def section(run: EvaluatedRun) -> Section:
    """All criteria with their limits."""
    return Section("Acceptance", _criteria(run))


def _criteria(run: EvaluatedRun) -> Iterator[Text | StudyTable]:
    rows = []
    for one in run.criteria:
        value, limit = _figures(one)
        words = one.unit, _WORDS[one.passed], one.clause
        rows.append([one.criterion, value, _RELATIONS[one.relation], limit, *words])
    yield texts_table(["criterion", "value", "", "limit", "unit", "", "source"], rows, {1, 3})
    speed = number(standards.KMH * run.results.fact("wave_speed"), 0)
    yield Text(
        f"Wave speed of the contact wire: {speed} km/h. Forces are filtered by a 20 Hz low-pass "
        "(Butterworth, 6th order, forward and backward)."
    )
