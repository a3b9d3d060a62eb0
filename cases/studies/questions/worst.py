"""Worst spans, steady arms and droppers of a run: figures of each, ranked, and which stand out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate.statistics import slack_times
from catenary.postproc.evaluate.wording import wire_words
from catenary.postproc.read.line_of_run import in_stretch
from catenary.postproc.read.results import Results

# A figure stands out if it exceeds the median of its likes by this many robust standard deviations
# (1.4826 times the median absolute deviation) and by this share.
_DEVIATIONS, _SHARE, _NORMAL = 3.0, 0.1, 1.4826
# Likes of a dropper hang so close to the same share of their spans [-]; fewer than this say little.
_SAME_SHARE, _FEWEST = 0.02, 3


class Passage(NamedTuple):
    """A pantograph in a span.

    Attributes
    ----------
    span : number of the span, from 0
    start, end : masts of the span [m]
    pantograph : number of the pantograph, from 0
    std, maximum, minimum : of the contact force, 20 Hz low-pass [N]
    loss : share of time without contact [%]
    median : of the deviations of this pantograph in all spans [N]
    stands_out : whether the deviation is far above it, None where there are too few others
    """

    span: int
    start: float
    end: float
    pantograph: int
    std: float
    maximum: float
    minimum: float
    loss: float
    median: float
    stands_out: bool | None


class Spot(NamedTuple):
    """A steady arm or a dropper.

    Attributes
    ----------
    number : of it, from 0
    x : where it is [m]
    wire : name of the wire that it holds, where there are several; else empty
    value : uplift of an arm [mm], largest force of a dropper [N], or its time slack [s]
    median : of its likes
    stands_out : whether the value is far above it, None where there are too few others
    """

    number: int
    x: float
    wire: str
    value: float
    median: float
    stands_out: bool | None

    @property
    def place(self) -> str:
        """Its place, in words."""
        return f"{self.x:.1f} m{self.wire and f', {self.wire}'}"


class WorstPlaces(NamedTuple):
    """All places of the evaluated stretch, the worst first.

    Attributes
    ----------
    passages : by standard deviation, of every span that lies within the stretch
    arms : by uplift
    forces : droppers by largest force
    slack : droppers by time slack, those that are
    least : (n_droppers,) smallest force of every dropper of the line [N]
    passed_to : place that all pantographs have reached [m]; arms and droppers beyond are left out,
        as their largest values are still to come
    """

    passages: list[Passage]
    arms: list[Spot]
    forces: list[Spot]
    slack: list[Spot]
    least: np.ndarray
    passed_to: float


def worst_places(results: Results) -> WorstPlaces:
    """Rank the places of a run. Not collective.

    Raises
    ------
    InputError
        If the time step is too long for the 20 Hz filter.
    """
    statistics = stats.evaluate(results)
    supports, droppers = statistics.supports, statistics.droppers
    everywhere = np.zeros(supports.x.size, dtype=np.int64)
    names = list(results.roles)
    of_arms = _of_several(results.arm_wires())
    of_droppers = _of_several([names[wire] for wire in results.dropper_wires()[:, 1].tolist()])
    likes = dropper_likes(results)
    times = slack_times(results)
    passed_to = _passed_to(results)
    arms, hung = (one.evaluated & (one.x <= passed_to) for one in (supports, droppers))
    # One that never carries is missing or loose, and not slack at times.
    slack = _spots(droppers.x, times, hung & (droppers.highest > 0.0), likes, of_droppers)
    return WorstPlaces(
        sorted(_passages(results), key=lambda one: -one.std),
        _spots(supports.x, 1e3 * supports.uplift, arms, everywhere, of_arms),
        _spots(droppers.x, droppers.highest, hung, likes, of_droppers),
        [one for one in slack if one.value > 0.0],
        droppers.lowest,
        passed_to,
    )


def _passed_to(results: Results) -> float:
    """Place that all pantographs have reached, to within a step as ``covers`` has it [m]; infinite
    without a train."""
    if results.attributes.get("excitation"):
        return np.inf
    n = results.n_rows("time")
    step = results.fact("speed") * results.dt
    last = (
        results.column("contact_position", p, slice(n - 1, n)) for p in range(results.n_pantographs)
    )
    return min((float(one[0]) for one in last), default=-np.inf) + step if n else -np.inf


def _of_several(wires: Sequence[str]) -> list[str]:
    """Names of wires as words, all empty if they are of one wire."""
    several = len(set(wires)) > 1
    return [wire_words(name) if several else "" for name in wires]


def spans_in_stretch(results: Results) -> list[int]:
    """Numbers of the spans that lie within the evaluated stretch, from 0."""
    within = in_stretch(results.line("support_x"), *results.evaluation)
    return [int(number) for number in np.flatnonzero(within[:-1] & within[1:])]


def _passages(results: Results) -> list[Passage]:
    masts, found = results.line("support_x"), []
    for p in range(results.n_pantographs):
        position, force = results.column("contact_position", p), results.column("contact_force", p)
        filtered = filters.contact_force(results, p)
        own = []
        for span in spans_in_stretch(results):
            start, end = float(masts[span]), float(masts[span + 1])
            if not stats.covers(position, (start, end)):
                continue
            within = (position >= start) & (position <= end)
            part = filtered[within]
            loss = 100.0 * float((force[within] <= 0.0).mean())
            extremes = float(part.max()), float(part.min())
            own.append(Passage(span, start, end, p, float(part.std()), *extremes, loss, 0.0, False))
        values = np.array([one.std for one in own])
        found += [
            one._replace(median=float(np.median(values)), stands_out=is_out)
            for one, is_out in zip(own, stands_out(values), strict=True)
        ]
    return found


def stands_out(values: np.ndarray) -> list[bool | None]:
    """Mask (n,) of likes that are far above their median; None of all where they are too few."""
    if values.size < _FEWEST:
        return [None] * values.size
    median = float(np.median(values))
    scatter = _NORMAL * float(np.median(np.abs(values - median)))
    beyond = values > median + max(_DEVIATIONS * scatter, _SHARE * abs(median))
    return [bool(one) for one in beyond]


def dropper_likes(results: Results) -> np.ndarray:
    """Number of the group of each dropper, (n_droppers,): those at the same share of a span."""
    x, span, masts = (
        results.line("dropper_x"),
        results.line("dropper_span"),
        results.line("support_x"),
    )
    share = (x - masts[span]) / (masts[span + 1] - masts[span])
    order = np.argsort(share, kind="stable")
    group = np.empty(x.size, dtype=np.int64)
    group[order] = np.cumsum(np.diff(share[order], prepend=share[order][:1]) > _SAME_SHARE)
    return group


def _spots(
    x: np.ndarray,
    values: np.ndarray,
    evaluated: np.ndarray,
    likes: np.ndarray,
    wires: Sequence[str],
) -> list[Spot]:
    """Evaluated places whose value is known, the largest first."""
    spots = []
    known = evaluated & np.isfinite(values)
    for group in np.unique(likes[known]):
        (own,) = np.nonzero(known & (likes == group))
        median = float(np.median(values[own]))
        for n, is_out in zip(own.tolist(), stands_out(values[own]), strict=True):
            spots.append(Spot(n, float(x[n]), wires[n], float(values[n]), median, is_out))
    return sorted(spots, key=lambda one: -one.value)
