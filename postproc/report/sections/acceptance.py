"""Whether a run is complete and accepted, and each criterion."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from shlex import quote

import numpy as np

from catenary.postproc.evaluate.statistics import PantographStatistics
from catenary.postproc.evaluate.verdict import Criterion, judged_by, labels
from catenary.postproc.evaluate.wording import decimals_that_tell
from catenary.postproc.report.page import EvaluatedRun, Section, Text, number
from catenary.postproc.report.study_table import StudyTable, texts_table
from catenary.postproc.standards.rule_books import KMH, QUANTITIES

_RELATIONS = {"<=": "≤", "<": "<", ">=": "≥", ">": ">"}
NAN = float("nan")
# Error of a quantity over the rms error of the force history.
_TIMES_RMS = {"mean_force": 1.0, "force_std": 1.0, "force_max": 3.0, "force_min": 3.0}
# Heads of errors, estimated and measured.
_SOURCES = ("estimated error of the time step", "measured error of step and mesh")
_UNCOMPARED = "not compared with the text"
_WORDS = {None: "not judged", True: "passed", False: "failed"}
_BROKEN_OFF = {
    "running": "The file was not closed: the run is still going on or its program was ended.",
    "interrupted": "It was interrupted.",
}


def status(run: EvaluatedRun) -> Section:
    """Verdict, the limits that are nearest, and faults of the run."""
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
    if run.excitation:
        yield Text("Something other than a train excites the line.", "open", "Nothing is judged.")
        return
    by = judged_by(results, run.criteria)
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
    yield from (Text(sentence) for sentence in nearest_limit(run))
    yield from (Text(sentence, "open") for sentence in run.statistics.complaints)


def _fewest(one: Criterion) -> int:
    """Decimals of figures of a criterion, at least."""
    return 3 if one.unit == "%" else 1


def _figures(one: Criterion) -> tuple[str, str]:
    digits = decimals_that_tell(one.value, one.limit, _fewest(one))
    return number(one.value, digits), number(one.limit, digits)


def _sentence(one: Criterion, label: str) -> str:
    value, limit = _figures(one)
    relation = _RELATIONS[one.relation]
    return f"{label}: {value} {one.unit}, must be {relation} {limit} {one.unit}"


def errors_of(run: EvaluatedRun) -> dict[str, dict[str, float]]:
    """Errors by quantity and pantograph, in the quantity's unit.

    Those that an accuracy study measured, or else those by the time step as the record lets
    estimate them: the rms error of the history of the filtered force bounds the error of its mean
    and of its deviation. Three times that stands for the error of its extremes, for which there is
    no bound.
    """
    if run.measured:
        names = ["", *(one.name for one in run.statistics.pantographs)]
        return {quantity: dict.fromkeys(names, error) for quantity, error in run.measured.items()}
    return _by_rms(zip(run.statistics.pantographs, run.indicators.force_error, strict=True))


def _by_rms(pairs: Iterable[tuple[PantographStatistics, float]]) -> dict[str, dict[str, float]]:
    """Errors by quantity and pantograph, from pantographs and rms errors of their force [N]."""
    by_name = {one.name: float(error) for one, error in pairs}
    return {
        quantity: {name: factor * error for name, error in by_name.items()}
        for quantity, factor in _TIMES_RMS.items()
    }


def _error_of(one: Criterion, errors: Mapping[str, Mapping[str, float]]) -> float:
    """Estimated error of the value of a criterion, NaN if there is no estimate."""
    return errors.get(one.quantity, {}).get(one.pantograph, NAN)


def _error(one: Criterion, errors: Mapping[str, Mapping[str, float]]) -> str:
    error = _error_of(one, errors)
    return number(error, decimals_that_tell(error, 0.0, 2))


def _distance(one: Criterion) -> float:
    """Distance of the value from its limit, negative if the criterion failed; NaN if not judged."""
    if one.passed is None:
        return NAN
    return abs(one.limit - one.value) * (1.0 if one.passed else -1.0)


def _margin(one: Criterion) -> str:
    return number(_distance(one), decimals_that_tell(_distance(one), 0.0, _fewest(one)))


def nearest_limit(run: EvaluatedRun) -> Iterator[str]:
    """Sentences on the smallest margin of what the run finds, and on verdicts that errors and the
    start could turn.

    Parameters
    ----------
    run : EvaluatedRun
        Run with its criteria.
    """
    judged = [
        (one, label)
        for one, label in zip(run.criteria, labels(run.criteria), strict=True)
        if one.passed is not None
    ]
    passed = [(one, label) for one, label in judged if one.passed and not _is_given(one)]
    shares = [(one, label) for one, label in passed if one.limit != 0.0]
    if shares:
        one, label = min(shares, key=lambda pair: abs(_distance(pair[0]) / pair[0].limit))
        share = 100.0 * _distance(one) / abs(one.limit)
        head = "Nearest to its limit"
        if not all(other.passed for other, _ in judged):
            head = "Passed criterion nearest to its limit"
        yield (
            f"{head}: {label}, with a margin of {_margin(one)} {one.unit} "
            f"({number(share, decimals_that_tell(share, 0.0, 1))} %)."
        )
    without_share: dict[str, str] = {}
    for one, label in sorted(passed, key=lambda pair: abs(_distance(pair[0]))):
        if one.limit == 0.0:
            without_share.setdefault(one.quantity, f"{label} ({_margin(one)} {one.unit})")
    if without_share:
        named = ", ".join(without_share.values())
        yield f"Margins from limits of zero, without a percentage: {named}."
    errors, what = errors_of(run), _SOURCES[bool(run.measured)]
    turned = _turned(judged, errors)
    if turned:
        yield f"The {what} could change the verdict on: {turned}."
    elif any(np.isfinite(_error_of(one, errors)) for one, _ in judged):
        yield f"The {what} changes no verdict: where it is known, it is smaller than the margin."
    left = _turned(judged, _start_up(run))
    if left:
        yield (
            "Start-up, which still affects the evaluated stretch, could change the verdict on: "
            f"{left}. Take a longer run-in."
        )


def _is_given(one: Criterion) -> bool:
    return one.quantity in QUANTITIES and QUANTITIES[one.quantity].given


def _turned(
    judged: Sequence[tuple[Criterion, str]], errors: Mapping[str, Mapping[str, float]]
) -> str:
    """Criteria whose errors exceed their margins, with both."""
    return "; ".join(
        f"{label} (margin {_margin(one)} {one.unit}, error {_error(one, errors)} {one.unit})"
        for one, label in judged
        if abs(_distance(one)) <= _error_of(one, errors)
    )


def _start_up(run: EvaluatedRun) -> dict[str, dict[str, float]]:
    """Estimated error that the start of the run leaves, by quantity and pantograph [N].

    It is an rms error of the force history, as that of the time step is.
    """
    facts = run.results.attributes.get("arrivals", {}).get("pantographs", [])
    pairs = zip(run.statistics.pantographs, facts, strict=False)
    return _by_rms((one, fact["start_share_of_std"] * one.std) for one, fact in pairs)


def section(run: EvaluatedRun) -> Section:
    """All criteria with their limits."""
    return Section("Acceptance", _criteria(run))


def _criteria(run: EvaluatedRun) -> Iterator[Text | StudyTable]:
    rows, left = [], []
    errors = errors_of(run)
    # If no limit is compared, the verdict says so once.
    some = any(one.compared for one in run.criteria)
    for one, label in zip(run.criteria, labels(run.criteria), strict=True):
        if one.absent:
            left.append(f"{label}: {one.because}")
            continue
        value, limit = _figures(one)
        clause = one.clause.replace("<=", "≤")
        source = f"{clause}; {_UNCOMPARED}" if some and not one.compared else clause
        words = one.unit, source
        of_margin = _margin(one), _error(one, errors)
        first = label, _WORDS[one.passed], value, _RELATIONS[one.relation], limit
        rows.append([*first, *of_margin, *words])
    heads = ["criterion", "verdict", "value", "", "limit", "margin", "error", "unit", "source"]
    yield texts_table(heads, rows, {2, 4, 5, 6})
    case = quote(run.results.attributes["case"])
    how = (
        f"The error is that of step and mesh, from {run.measured_by}."
        if run.measured
        else "The error is that of the time step, estimated from the record; three times the rms "
        "error of the history for extremes, a dash where there is no estimate. The error of the "
        f"mesh is not estimated: `catenary accuracy {case} -o STUDY --axes grid` measures it, "
        "`catenary report --accuracy STUDY` shows it here."
    )
    yield Text(f"The margin is the distance from the limit, negative beyond it. {how}")
    if left:
        yield Text("for want of data or of a limit:", "open", "Not judged", left)
    speed = number(KMH * run.results.fact("wave_speed"), 0)
    yield Text(
        f"Wave speed of the contact wire: {speed} km/h. Forces are filtered by a 20 Hz low-pass "
        "(Butterworth, 6th order, forward and backward)."
    )
