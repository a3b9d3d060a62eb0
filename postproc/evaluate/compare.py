"""Compares runs: statistics side by side, differences by spans, histories at equal times.

Whether statistics of two runs differ by more than chance is told span by span: the force of a span
is taken for a sample of what the line may show. The statistic without each span in turn, the
jackknife, tells how far it depends on which spans there are (B. Efron, The jackknife, the bootstrap
and other resampling plans, 1982, chapter 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from string import ascii_uppercase
from typing import NamedTuple

import numpy as np
from scipy import stats as scipy_stats

from catenary.base.errors import InputError
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate.error_indicators import indicate
from catenary.postproc.evaluate.remarks import all_remarks
from catenary.postproc.evaluate.verdict import Criterion, criteria_of, judged_by, labels
from catenary.postproc.evaluate.wording import (
    UNCOMPARED,
    UNCOMPARED_SAYS,
    VERDICTS,
    counted,
    decimals_that_tell,
    fixed,
    terminal_width,
)
from catenary.postproc.read.results import Results, in_stretch
from catenary.postproc.read.validation import Records

_FORCES = (
    ("mean [N]", "mean", 1.0),
    ("standard deviation [N]", "std", 1.0),
    ("  0-5 Hz [N]", "std_0_5", 1.0),
    ("  5-20 Hz [N]", "std_5_20", 1.0),
    ("maximum [N]", "maximum", 1.0),
    ("minimum [N]", "minimum", 1.0),
    ("loss of contact [%]", "loss_percent", 1.0),
    ("contact height range [mm]", "contact_height_range", 1e3),
)
_Evaluated = tuple[Results, stats.RunStatistics]
# With fewer spans nothing is said.
_LEAST_SPANS = 4
STATISTICS = ("mean", "standard deviation")


def compare(*runs: Path | str, records: Sequence[Records | None] | None = None) -> str:
    """A table of the figures of two or more runs and of their differences, as text. Not collective.

    Parameters
    ----------
    *runs : Path or str
        Result folders or files.
    records : sequence of Records or None, optional
        Findings of ``guard.examined`` in each run, None to examine it here.

    Raises
    ------
    InputError
        If one of them is no result, or if there are more than letters.
    """
    if len(runs) > len(ascii_uppercase):
        raise InputError(f"{len(runs)} runs are too many to compare; name {len(ascii_uppercase)}")
    known = records or [None] * len(runs)
    with ExitStack() as stack:
        opened = [
            stack.enter_context(Results(path, own)) for path, own in zip(runs, known, strict=True)
        ]
        found = [(run, stats.evaluate(run)) for run in opened]
        parts = [_heads(opened), _statistics(found), _by_spans(opened)]
        parts.append([_histories(opened[0], one, letter) for letter, one in _others(opened)])
        return "\n\n".join("\n".join(part) for part in parts if part) + "\n"


def _others(runs: Sequence[Results]) -> list[tuple[str, Results]]:
    """The runs after the first with their letters; a lone one has none."""
    letters = ascii_uppercase[1 : len(runs)] if len(runs) > 2 else [""]
    return list(zip(letters, runs[1:], strict=False))


def _heads(runs: Sequence[Results]) -> list[str]:
    lines = []
    for letter, run in zip(ascii_uppercase, runs, strict=False):
        about = run.attributes
        lines.append(
            f"{letter}: {run.path} ({about['case']}, {3.6 * run.fact('speed'):.0f} km/h, "
            f"dt {run.dt:g} s, {counted(about['n_ranks'], 'rank')}, "
            f"{counted(run.n_steps, 'step')}, {run.outcome})"
        )
    shared = set.intersection(*map(_simulated, runs))
    for letter, run in zip(ascii_uppercase, runs, strict=False):
        alone = _simulated(run) - shared
        if alone:
            only = "only " if len(runs) == 2 else ""
            lines.append(f"{only}{letter} simulates {', '.join(sorted(alone))}")
    if not np.allclose([run.evaluation for run in runs], runs[0].evaluation, rtol=0.0, atol=1e-6):
        stretches = ", ".join(
            f"{letter} from {run.evaluation[0]:g} to {run.evaluation[1]:g} m"
            for letter, run in zip(ascii_uppercase, runs, strict=False)
        )
        lines.append(f"the evaluated stretches differ: {stretches}")
    return lines


def _simulated(run: Results) -> set[str]:
    return {name for name, *_ in run.attributes["effects_on"]}


def _statistics(runs: Sequence[_Evaluated]) -> list[str]:
    found = [statistics for _, statistics in runs]
    letters = ascii_uppercase[: len(runs)]
    heads = [*letters, *(f"{letter} - A" for letter in letters[1:])]
    lines = [f"{'':34}" + "".join(f"{head:>14}" for head in heads)]
    for of_all in zip(*(one.pantographs for one in found), strict=False):
        lines.append(" / ".join(dict.fromkeys(one.name for one in of_all)))
        for label, name, factor in _FORCES:
            lines.append(table_row("  " + label, [factor * getattr(one, name) for one in of_all]))
    counts = [len(one.pantographs) for one in found]
    if len(set(counts)) > 1:
        named = zip(letters[1:], counts[1:], strict=True)
        others = ", ".join(f"{letter} has {n}" for letter, n in named)
        lines.append(
            f"A has {counted(counts[0], 'pantograph')}, {others}: only the first are compared."
        )
    lines += [
        "line",
        table_row("  max uplift at arms [mm]", [1e3 * one.supports.maximum for one in found]),
        table_row("  droppers slackened", [one.droppers.n_slackened for one in found], 0),
        table_row("  max dropper force [N]", [one.droppers.maximum for one in found]),
        table_row("  min dropper force [N]", [one.droppers.minimum for one in found]),
    ]
    lines += _acceptance(*runs)
    for _, statistics in runs:
        lines += statistics.complaints
    for run, _ in runs:
        lines += run.damage
    return lines + [
        f"{letter}: {text}"
        for letter, (run, _) in zip(letters, runs, strict=True)
        for text in all_remarks(run, indicate(run))
    ]


def _acceptance(*runs: _Evaluated) -> list[str]:
    """Every criterion of any run with its value and verdict in all."""
    found = [criteria_of(run, statistics) for run, statistics in runs]
    lines = ["acceptance"]
    for letter, (run, _), criteria in zip(ascii_uppercase, runs, found, strict=False):
        lines.append(f"  {letter} by {judged_by(run, criteria)}")
    columns = [dict(zip(labels(criteria), criteria, strict=True)) for criteria in found]
    every = list(dict.fromkeys(label for column in columns for label in column))
    width = max(map(len, every), default=0)
    room = terminal_width()
    is_narrow = room is not None and 2 + width + 26 * len(columns) > room
    for label in every:
        cells = [_judged(column.get(label)) for column in columns]
        if is_narrow:
            lines += [f"  {label}", "  " + "".join(f"{cell:>26}" for cell in cells)]
        else:
            lines.append(f"  {label:{width}}" + "".join(f"{cell:>26}" for cell in cells))
    return [*lines, f"  {UNCOMPARED_SAYS}"]


def _judged(one: Criterion | None) -> str:
    if one is None:
        return "-"
    if one.absent:
        return VERDICTS[None]
    if np.isnan(one.value):
        return f"no value, {VERDICTS[one.passed]}"
    mark = "" if one.compared else f" {UNCOMPARED}"
    digits = decimals_that_tell(one.value, one.limit, 2)
    return f"{fixed(one.value, digits)} {one.unit} {VERDICTS[one.passed]}{mark}"


def table_row(label: str, values: Sequence[float], digits: int | None = None) -> str:
    """Values and their differences from the first, by default with the decimals that show these."""
    first, *others = values
    if digits is None:
        digits = _decimals([abs(value - first) for value in others], not any(values))
    cells = [f"{fixed(value, digits):>14}" for value in values]
    return f"{label:34}" + "".join(
        cells + [f"{_difference(value - first, digits):>14}" for value in others]
    )


def _decimals(differences: Sequence[float], all_zero: bool) -> int:
    """Decimals, 1 to 4, that show the smallest difference to two digits.

    Equal values get all four, which tell how far they are equal, but zeros one.
    """
    apart = [value for value in differences if 0.0 < value < np.inf]
    if not apart:
        return 1 if all_zero else 4
    return int(np.clip(1 - np.floor(np.log10(min(apart))), 1, 4))


def _difference(value: float, digits: int = 4) -> str:
    """A difference with so many decimals, as a power of ten where these would hide it."""
    return fixed(value, digits) if not 0.0 < abs(value) < 1e-3 else f"{value:.1e}"


def _by_spans(runs: Sequence[Results]) -> list[str]:
    """Differences from the first run with their intervals, by the spread from span to span."""
    rows = []
    n = min(run.n_pantographs for run in runs)
    names = runs[0].pantograph_names()
    of_all = [[_span_sums(run, number) for run in runs] for number in range(n)]
    for name, (first, *others) in zip(names, of_all, strict=False):
        for letter, own, other in zip(ascii_uppercase[1:], runs[1:], others, strict=False):
            if first is None or other is None:
                continue
            paired = _spans_alike(runs[0], own)
            found = differences(first, other, paired)
            for label, one in zip(STATISTICS, found or (), strict=False):
                mark = "more than chance" if one.is_certain else "within chance"
                figures = f"{one.value:8.3f}{one.low:9.3f} to {one.high:8.3f} {mark}"
                rows.append((f"{name} {label}", f" {letter} - A{figures}"))
    if not rows:
        return []
    width = max(len(label) for label, _ in rows)
    head = "differences [N] by the spread from span to span, 95 % intervals"
    return [head, *(f"  {label:{width}}{figures}" for label, figures in rows)]


def _span_sums(run: Results, number: int) -> SpanSums | None:
    """Sums of the filtered force of a pantograph by evaluated spans; None if it has no record."""
    position, force = run.column("contact_position", number), run.column("contact_force", number)
    if position.size < 2 or not (np.isfinite(position).all() and np.isfinite(force).all()):
        return None
    try:
        force = filters.contact_force(run, number)
    except InputError:  # sampled too slowly; statistics say so
        return None
    masts = _evaluated_masts(run)
    # Spans that the record covers, to within a step as ``covers`` has it; parts are no samples.
    step = float(np.diff(position).max())
    whole = (masts >= position[0] - step) & (masts <= position[-1] + step)
    return span_sums(position, force, masts[whole])


def _evaluated_masts(run: Results) -> np.ndarray:
    """Places of the masts of the evaluated stretch [m]."""
    masts = run.line("support_x")
    return masts[in_stretch(masts, *run.evaluation)]


def _spans_alike(a: Results, b: Results) -> bool:
    """Whether two runs are evaluated on the same spans."""
    own, other = _evaluated_masts(a), _evaluated_masts(b)
    return own.size == other.size and np.allclose(own, other, rtol=0.0, atol=1e-6)


def _histories(a: Results, b: Results, letter: str) -> str:
    """The largest difference of the unfiltered contact forces, if both have the same times.

    ``letter`` names b where there are several.
    """
    of_all = f"{letter} - A: " if letter else ""
    tolerance = 1e-6 * min(a.dt, b.dt)
    same = a.n_pantographs == b.n_pantographs and a.n_rows("time") == b.n_rows("time")
    if not same or not np.allclose(a.time, b.time, rtol=0, atol=tolerance):
        return (
            f"{of_all}The runs differ in their times or pantographs: force histories are not "
            "compared."
        )
    if not a.n_rows("time"):
        return f"{of_all}The runs hold no steps: force histories are not compared."
    largest, at, whose = -1.0, 0, 0
    for p in range(a.n_pantographs):
        difference = np.abs(a.column("contact_force", p) - b.column("contact_force", p))
        step = int(difference.argmax())
        # A difference that is no number is the largest, as ``argmax`` has it.
        if not difference[step] <= largest:
            largest, at, whose = float(difference[step]), step, p
        if np.isnan(largest):
            break
    return (
        f"{of_all}Largest difference of the contact force histories: {_difference(largest)} N "
        f"at t = {a.time_at(at):.4f} s ({a.pantograph_names()[whose]})."
    )


class SpanSums(NamedTuple):
    """Number of samples of each span (n,), their sum and the sum of their squares."""

    samples: np.ndarray
    total: np.ndarray
    square: np.ndarray


class Difference(NamedTuple):
    """A difference of two runs with the interval that holds it with a confidence of 95 %."""

    value: float
    low: float
    high: float

    @property
    def is_certain(self) -> bool:
        """Whether the interval excludes zero; not of runs that are alike."""
        return not self.low <= 0.0 <= self.high


def span_sums(position: np.ndarray, force: np.ndarray, edges: np.ndarray) -> SpanSums:
    """Sums of a force (n,) at positions (n,) [m] between edges (m + 1,) of spans [m].

    Spans without a sample are left out. A sample at the last edge belongs to the last span, as it
    does to the evaluated stretch: means of all spans are those of the stretch.
    """
    n_spans = max(edges.size - 1, 0)
    which = np.searchsorted(edges, position, side="right") - 1
    if n_spans:
        which[position == edges[-1]] -= 1
    inside = (which >= 0) & (which < n_spans)
    which, force = which[inside], force[inside]
    sums = [np.bincount(which, weights, n_spans) for weights in (None, force, np.square(force))]
    there = sums[0] > 0
    return SpanSums(*(one[there].astype(float) for one in sums))


def differences(first: SpanSums, second: SpanSums, paired: bool) -> Sequence[Difference] | None:
    """Differences, second less first, of ``STATISTICS``; None with too few spans.

    Parameters
    ----------
    first, second : SpanSums
        Sums over the spans of each run.
    paired : bool
        Whether both are of the same spans of a line, whose common part then drops out.
    """
    n, m = first.samples.size, second.samples.size
    if min(n, m) < _LEAST_SPANS or (paired and n != m):
        return None
    values = _statistics_by_span(second, whole=True) - _statistics_by_span(first, whole=True)
    without = _statistics_by_span(first), _statistics_by_span(second)
    if paired:
        square, freedom = _jackknifed(without[1] - without[0]), np.full(len(STATISTICS), n - 1.0)
    else:
        own, other = _jackknifed(without[0]), _jackknifed(without[1])
        square = own + other
        with np.errstate(invalid="ignore"):  # Welch and Satterthwaite
            freedom = square**2 / (own**2 / (n - 1) + other**2 / (m - 1))
        freedom = np.nan_to_num(freedom, nan=float(min(n, m) - 1))
    width = scipy_stats.t.ppf(0.975, freedom) * np.sqrt(square)
    middle = values[:, 0]
    ends = zip(middle, middle - width, middle + width, strict=True)
    return [Difference(*map(float, row)) for row in ends]


def _statistics_by_span(sums: SpanSums, whole: bool = False) -> np.ndarray:
    """Statistics (2, n) without each span in turn, (2, 1) of all spans."""
    left = [one.sum() - (0.0 if whole else one) for one in sums]
    count, total, square = (np.atleast_1d(one) for one in left)
    mean = total / count
    return np.stack([mean, np.sqrt(np.maximum(square / count - mean**2, 0.0))])


def _jackknifed(without: np.ndarray) -> np.ndarray:
    """Variance (2,) of statistics of which (2, n) are known without each span."""
    n = without.shape[1]
    return np.asarray((n - 1.0) * without.var(axis=1))
