"""The paper's nine statements about its results, each with the criterion by which it is judged.

Pure functions of plain figures: nothing here reads files or runs anything.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from catenary.postproc.report.study_report import NOT_REPRODUCED, REPRODUCED, UNDECIDED, Finding

LIGHT, AVERAGE = "light", "average"
DAMPINGS = (LIGHT, AVERAGE)
SINGLE = "single"

MEAN, MEAN_WITHIN = 150.0, 5.0  # two significant digits: what rounds to 150 N or 1.5e2 N [N]
STD_RATIO = 0.3  # EN 50367:2006, as the paper quotes it
UPLIFT = 0.070  # [m]
# Half the step or twice the elements change the standard deviation by less (README.md): a smaller
# difference of two deviations is within the discretisation's error.
STD_ERROR = 0.006
SLIGHTLY = 0.15  # more than this share is no longer a slight change
CRITICAL, CRITICAL_WITHIN = 441.0, 0.5  # [km/h], a figure rounded to 1 km/h
SPEED_RATIO = 0.7


@dataclass(frozen=True)
class Force:
    """Contact force of one pantograph in the stretch, 20 Hz low-pass [N]; losses of the raw one.

    ``std_0_5`` and ``std_5_20`` are the deviations of the bands 0-5 and 5-20 Hz.
    """

    mean: float
    std: float
    maximum: float
    minimum: float
    loss_percent: float
    std_0_5: float
    std_5_20: float

    @property
    def amplitude(self) -> float:
        """From the smallest to the largest force [N]."""
        return self.maximum - self.minimum


class Slack(NamedTuple):
    """Droppers near mid-span that were slack before the last pantograph's passage and after."""

    leading: int
    trailing: int
    of: int


@dataclass(frozen=True)
class Run:
    """The figures of a run that the statements judge.

    Attributes
    ----------
    separation : of the two pantographs [m], None for a single one
    named : whether the paper's text names this separation; true for the single one
    forces : leading one first
    uplift : largest uplift at an evaluated arm [m]
    onset : how far the head is before an arm when its uplift begins [m], None if unknown
    slack : of the droppers next to mid-span
    wave_speed, train_speed : [m/s]
    """

    separation: float | None
    named: bool
    forces: Sequence[Force]
    uplift: float
    onset: float | None
    slack: Slack
    wave_speed: float
    train_speed: float


# damping -> train -> run, None if it broke or has no statistics
Runs = Mapping[str, Mapping[str, Run | None]]


class Judged(NamedTuple):
    """A verdict and our numbers."""

    verdict: str
    found: str


class _Missing(Exception):
    """A run that the statement needs is not there."""


def judge(runs: Runs) -> list[Finding]:
    """The findings on all nine statements, without reasons."""
    findings = []
    for number, (statement, criterion, decide) in enumerate(_STATEMENTS, start=1):
        try:
            judged = decide(runs)
        except _Missing as missing:
            judged = Judged(UNDECIDED, f"there is no run {missing}")
        findings.append(Finding(number, statement, criterion, judged.verdict, judged.found))
    return findings


def named_only(runs: Runs) -> Runs:
    """The runs with the separations that the paper's text names."""
    return {
        damping: {train: run for train, run in trains.items() if run is None or run.named}
        for damping, trains in runs.items()
    }


def _verdict(holds: bool) -> str:
    return REPRODUCED if holds else NOT_REPRODUCED


def _all(runs: Runs, damping: str) -> dict[str, Run]:
    """Every run of a damping; a statement about all of them needs all."""
    found = {}
    for train, run in runs.get(damping, {}).items():
        if run is None:
            raise _Missing(f"{train}, {damping}")
        found[train] = run
    if not found:
        raise _Missing(f"with {damping} damping")
    return found


def _one(runs: Runs, damping: str, separation: float | None) -> Run:
    for run in runs.get(damping, {}).values():
        if run is not None and run.separation == separation:
            return run
    what = SINGLE if separation is None else f"{separation:g} m"
    raise _Missing(f"{what}, {damping}")


def _pairs(runs: Runs, damping: str) -> dict[str, Run]:
    pairs = {name: run for name, run in _all(runs, damping).items() if run.separation is not None}
    if not pairs:
        raise _Missing(f"of a pair, {damping}")
    return pairs


def _everyone(runs: Runs, damping: str) -> list[tuple[str, Force]]:
    """All pantographs of a damping with their names."""
    return [
        (train if len(run.forces) == 1 else f"{train} {place}", force)
        for train, run in _all(runs, damping).items()
        for place, force in zip(("leading", "trailing"), run.forces, strict=False)
    ]


def _mean_force(runs: Runs) -> Judged:
    means = [force.mean for damping in DAMPINGS for _, force in _everyone(runs, damping)]
    low, high = min(means), max(means)
    holds = MEAN - MEAN_WITHIN <= low and high <= MEAN + MEAN_WITHIN
    return Judged(_verdict(holds), f"{low:.1f} to {high:.1f} N")


def _deviation(runs: Runs) -> Judged:
    ratios = {
        damping: [(force.std / force.mean, name, force.std) for name, force in everyone]
        for damping, everyone in ((d, _everyone(runs, d)) for d in DAMPINGS)
    }
    lowest, highest = min(ratios[LIGHT]), max(ratios[AVERAGE])
    holds = lowest[0] > STD_RATIO > highest[0]
    above = sum(ratio > STD_RATIO for ratio, *_ in ratios[LIGHT])
    below = sum(ratio < STD_RATIO for ratio, *_ in ratios[AVERAGE])
    found = (
        f"light: {above} of {len(ratios[LIGHT])} pantographs above 30 %, the smallest "
        f"{100 * lowest[0]:.1f} % ({lowest[2]:.1f} N, {lowest[1]}); average: {below} of "
        f"{len(ratios[AVERAGE])} below, the largest {100 * highest[0]:.1f} % "
        f"({highest[2]:.1f} N, {highest[1]})"
    )
    return Judged(_verdict(holds), found)


def _worst_at_200(runs: Runs) -> Judged:
    holds, parts = True, []
    for damping in DAMPINGS:
        _one(runs, damping, 200.0)
        everyone = _everyone(runs, damping)
        extremes = (
            ("maximum", max(everyone, key=lambda one: one[1].maximum), "maximum"),
            ("minimum", min(everyone, key=lambda one: one[1].minimum), "minimum"),
            ("deviation", max(everyone, key=lambda one: one[1].std), "std"),
        )
        said = []
        for word, (name, force), attribute in extremes:
            holds = holds and name == _name_at_200(runs, damping)
            said.append(f"{word} {getattr(force, attribute):.1f} N {name}")
        parts.append(f"{damping}: {', '.join(said)}")
    return Judged(_verdict(holds), "; ".join(parts))


def _name_at_200(runs: Runs, damping: str) -> str:
    train = next(name for name, run in _pairs(runs, damping).items() if run.separation == 200.0)
    return f"{train} trailing"


def _trailing_exceeds(runs: Runs) -> Judged:
    holds, excess, parts = True, {}, []
    for damping in DAMPINGS:
        differences = {
            train: run.forces[1].amplitude - run.forces[0].amplitude
            for train, run in _pairs(runs, damping).items()
        }
        holds = holds and min(differences.values()) > 0
        excess[damping] = sum(differences.values()) / len(differences)
        listed = ", ".join(f"{train} {value:+.0f}" for train, value in differences.items())
        parts.append(f"{damping}: {listed}, on average {excess[damping]:+.0f} N")
    holds = holds and excess[LIGHT] > excess[AVERAGE]
    return Judged(_verdict(holds), "trailing less leading, " + "; ".join(parts))


def _leading_suffers(runs: Runs) -> Judged:
    alone = _one(runs, LIGHT, None).forces[0].std
    leading = _one(runs, LIGHT, 31.0).forces[0].std
    change = leading / alone - 1.0
    found = f"standard deviation {leading:.1f} N, {alone:.1f} N alone ({100 * change:+.1f} %)"
    if abs(change) <= STD_ERROR:
        return Judged(UNDECIDED, found + ", within the discretisation's error")
    return Judged(_verdict(0 < change <= SLIGHTLY), found)


def _no_loss(runs: Runs) -> Judged:
    everyone = [
        (force.loss_percent, f"{name}, {damping}")
        for damping in DAMPINGS
        for name, force in _everyone(runs, damping)
    ]
    losing = [one for one in everyone if one[0] > 0]
    if not losing:
        return Judged(REPRODUCED, f"none of {len(everyone)} pantographs loses contact")
    worst = max(losing)
    return Judged(
        NOT_REPRODUCED,
        f"{len(losing)} of {len(everyone)} pantographs lose contact, at most {worst[0]:.1f} % of "
        f"the time ({worst[1]})",
    )


def _uplift(runs: Runs) -> Judged:
    everyone = [
        (run.uplift, f"{train}, {damping}", run.onset)
        for damping in DAMPINGS
        for train, run in _all(runs, damping).items()
    ]
    largest = max(everyone, key=lambda one: one[0])
    onsets = [onset for *_, onset in everyone if onset is not None]
    if len(onsets) < len(everyone) or not all(math.isfinite(one[0]) for one in everyone):
        raise _Missing("with steady arms in the evaluated stretch in each configuration")
    holds = largest[0] < UPLIFT and min(onsets) > 0
    return Judged(
        _verdict(holds),
        f"at most {1e3 * largest[0]:.1f} mm ({largest[1]}); it begins when the head has still "
        f"{min(onsets):.1f} m or more to go",
    )


def _slackening(runs: Runs) -> Judged:
    light = {train: run.slack for train, run in _all(runs, LIGHT).items()}
    average = {train: run.slack for train, run in _all(runs, AVERAGE).items()}
    at_200 = _one(runs, AVERAGE, 200.0).slack
    others = [slack for train, slack in average.items() if _separation(runs, train) != 200.0]
    holds = (
        all(slack.leading + slack.trailing > 0 for slack in light.values())
        and at_200.leading == 0
        and at_200.trailing > 0
        and all(slack.leading + slack.trailing == 0 for slack in others)
    )
    parts = []
    for damping, group in ((LIGHT, light), (AVERAGE, average)):
        listed = ", ".join(
            f"{train} {slack.leading}" + ("" if train == SINGLE else f"+{slack.trailing}")
            for train, slack in group.items()
        )
        parts.append(f"{damping}: {listed}")
    of = max(slack.of for slack in (*light.values(), *average.values()))
    return Judged(
        _verdict(holds),
        f"slack droppers of {of} next to mid-span, before + in and after the trailing "
        f"pantograph's passage; {'; '.join(parts)}",
    )


def _separation(runs: Runs, train: str) -> float | None:
    run = runs[AVERAGE][train]
    return None if run is None else run.separation


def _critical_speed(runs: Runs) -> Judged:
    run = next((r for damping in DAMPINGS for r in runs.get(damping, {}).values() if r), None)
    if run is None:
        raise _Missing("at all")
    wave, train = 3.6 * run.wave_speed, 3.6 * run.train_speed
    holds = abs(wave - CRITICAL) <= CRITICAL_WITHIN and train <= SPEED_RATIO * wave
    return Judged(
        _verdict(holds),
        f"{wave:.1f} km/h; 0.7 of it is {SPEED_RATIO * wave:.1f} km/h, the train runs at "
        f"{train:.0f} km/h",
    )


_STATEMENTS: tuple[tuple[str, str, Callable[[Runs], Judged]], ...] = (
    (
        "The mean contact force is 150 N for every pantograph.",
        f"every mean within {MEAN_WITHIN:g} N of 150 N, which is given to two digits",
        _mean_force,
    ),
    (
        "The standard deviation is above 30 % of the mean for every pantograph on the lightly "
        "damped line and below it on the average one.",
        "every ratio above 0.3 (light) and below 0.3 (average)",
        _deviation,
    ),
    (
        "At 200 m the trailing pantograph has the largest maximum, the smallest minimum and the "
        "largest deviation.",
        "it has all three extremes among all pantographs, with both dampings",
        _worst_at_200,
    ),
    (
        "The trailing pantograph's amplitudes exceed the leading one's in all separations, more "
        "so with light damping.",
        "maximum less minimum is larger in each pair; the excess, averaged over the pairs, is "
        "larger with light damping",
        _trailing_exceeds,
    ),
    (
        "At 31 m the leading pantograph suffers slightly from the trailing one (light damping).",
        f"its standard deviation exceeds the single one's by more than {100 * STD_ERROR:g} % (the "
        f"discretisation's error) and at most {100 * SLIGHTLY:g} %",
        _leading_suffers,
    ),
    ("No pantograph loses contact.", "the unfiltered force is never zero", _no_loss),
    (
        "The uplift at the steady arms stays below 70 mm; it begins before the head arrives.",
        "largest uplift of all evaluated arms; each reaches 5 % of its largest uplift before the "
        "leading head is there",
        _uplift,
    ),
    (
        "Droppers slacken on the lightly damped line; with average damping only after the "
        "trailing pantograph at 200 m.",
        "droppers next to mid-span, as in figure 12: some in every configuration (light); none "
        "but in or after the trailing pantograph's passage at 200 m (average)",
        _slackening,
    ),
    (
        "The critical speed of the contact wire is 441 km/h; V <= 0.7 C.",
        f"sqrt(F/rho) within {CRITICAL_WITHIN:g} km/h; 300 km/h within 0.7 of it",
        _critical_speed,
    ),
)
