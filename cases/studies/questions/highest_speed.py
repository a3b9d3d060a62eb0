"""Highest speed at which acceptance criteria hold: an ensemble over speeds, then bisection.

Criteria are not monotonic in speed: mean-force limits are also missed at low speeds, and resonances
of the line make stretches of speeds between which a criterion fails. The search therefore keeps all
stretches that the first, even division shows, and bisects each of their ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

from catenary.base.errors import InputError
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.load import Draft
from catenary.cases.studies.questions.marching import Marching
from catenary.cases.studies.sweep.jobs import Ended, RunOptions
from catenary.cases.studies.sweep.variants import Variant, VariedKey, product

KEY = "train.speed_km_h"
ALL = "all criteria"
# Speeds of the first division at most, and the bounds of a scene's speed [km/h].
MOST, _SLOWEST, _FASTEST = 2000, 1.0, 1000.0


class Speeds(NamedTuple):
    """Which speeds are marched, all [km/h].

    Attributes
    ----------
    slowest, fastest : ends of the range
    step : distance of the first speeds
    within : how closely ends of stretches are bisected
    """

    slowest: float = 200.0
    fastest: float = 360.0
    step: float = 10.0
    within: float = 1.0

    def first(self) -> list[float]:
        """The even division, both ends in it.

        Raises
        ------
        InputError
            If the range is none, or the division too fine.
        """
        if not _SLOWEST <= self.slowest < self.fastest <= _FASTEST:
            raise InputError(
                f"--from {self.slowest:g} --to {self.fastest:g} is no range of speeds: give two "
                f"ascending speeds from {_SLOWEST:g} to {_FASTEST:g} km/h"
            )
        if not 0.0 < self.within <= self.step:
            raise InputError(
                f"--within {self.within:g} --step {self.step:g} is not possible: --within is above "
                "0 and at most --step"
            )
        count = ceil((self.fastest - self.slowest) / self.step - 1e-9) + 1
        if count > MOST:
            raise InputError(
                f"--step {self.step:g} makes {count} speeds; at most {MOST} are allowed"
            )
        evenly = [round(self.slowest + number * self.step, 4) for number in range(count - 1)]
        return [*evenly, self.fastest]


class Stretch(NamedTuple):
    """Neighbouring speeds at which a criterion holds [km/h].

    Attributes
    ----------
    slowest, fastest : the first and last one that was marched
    fails_at : the next faster one, at which it does not hold; None at the end of the range
    """

    slowest: float
    fastest: float
    fails_at: float | None


class Holds(NamedTuple):
    """Where a criterion holds.

    Attributes
    ----------
    criterion : its name, or ``ALL``
    stretches : ascending, empty where it holds at no speed
    fails_by : value and limit at the first failure going up, None where there is none
    unit : of these
    stopped_by : of ``ALL``, the criteria that fail there, or what refuses the speed
    """

    criterion: str
    stretches: tuple[Stretch, ...]
    fails_by: tuple[float, float] | None
    unit: str
    stopped_by: tuple[str, ...]


class SpeedStudy(NamedTuple):
    """What a search has found.

    Attributes
    ----------
    case : name of the case
    speeds : the range
    holds : ``ALL`` first, then each criterion
    not_judged : criteria without a verdict at any speed
    ended : how each speed ended, ascending
    """

    case: str
    speeds: Speeds
    holds: tuple[Holds, ...]
    not_judged: tuple[str, ...]
    ended: tuple[Ended, ...]


def find_speeds(
    draft: Draft,
    overrides: Sequence[str],
    speeds: Speeds,
    wanted: Sequence[str],
    out: Path | None,
    comm: Any,
    options: RunOptions,
) -> SpeedStudy:
    """March the speeds, and find where the criteria hold. Collective.

    Parameters
    ----------
    wanted : parts of names of criteria, all criteria if there are none
    out : folder that keeps what is marched, so that the same call continues; None to keep nothing

    Raises
    ------
    InputError
        If the range is none, if no speed can be run, or if no criterion has a wanted name.
    Interrupted
        If a signal came.
    """
    march = Marching(draft, overrides, out, comm, options)
    first = speeds.first()
    ended = dict(zip(first, march.of(_variants(first)), strict=True))
    names, not_judged = _criteria(ended, wanted)
    while more := _between(ended, [ALL, *names], names, speeds.within):
        ended |= zip(more, march.of(_variants(more)), strict=True)
    found = tuple(_holds(ended, name, names) for name in (ALL, *names))
    in_order = tuple(ended[speed] for speed in sorted(ended))
    return SpeedStudy(march.case, speeds, found, tuple(not_judged), in_order)


def _variants(speeds: Sequence[float]) -> list[Variant]:
    return product([VariedKey(KEY, tuple(f"{speed:.8g}" for speed in speeds))], {})


def _criteria(ended: dict[float, Ended], wanted: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names of the wanted criteria: those that are judged at any speed, and the others."""
    rows = [row for one in ended.values() for row in one.summary.get("acceptance", [])]
    known = list(dict.fromkeys(row["criterion"] for row in rows))
    for text in wanted:
        if not any(text.lower() in name.lower() for name in known):
            raise InputError(
                f"--criterion {shown(text)} is part of no criterion; there are {'; '.join(known)}"
            )
    if wanted:
        known = [name for name in known if any(text.lower() in name.lower() for text in wanted)]
    judged = {row["criterion"] for row in rows if row["passed"] is not None}
    return [n for n in known if n in judged], [n for n in known if n not in judged]


def _row(one: Ended, name: str) -> dict[str, Any] | None:
    """The line of a criterion in a speed's verdict."""
    rows = one.summary.get("acceptance", [])
    return next((row for row in rows if row["criterion"] == name), None)


def _is_held(one: Ended, name: str, names: Sequence[str]) -> bool:
    """Whether a criterion, or each of ``names``, holds; not where a speed could not be run."""
    rows = [_row(one, own) for own in (names if name == ALL else [name])]
    return bool(rows) and all(row is not None and row["passed"] is True for row in rows)


def _between(
    ended: dict[float, Ended], asked: Sequence[str], names: Sequence[str], within: float
) -> list[float]:
    """Middles of neighbouring speeds farther apart than ``within`` of which one fails."""
    speeds = sorted(ended)
    middles = set()
    for slower, faster in zip(speeds, speeds[1:], strict=False):
        if faster - slower > within and any(
            _is_held(ended[slower], name, names) != _is_held(ended[faster], name, names)
            for name in asked
        ):
            middles.add(round(0.5 * (slower + faster), 4))
    return sorted(middles)


def _holds(ended: dict[float, Ended], name: str, names: Sequence[str]) -> Holds:
    speeds = sorted(ended)
    stretches: list[Stretch] = []
    begin: float | None = None
    for number, speed in enumerate(speeds):
        if not _is_held(ended[speed], name, names):
            begin = None
            continue
        begin = speed if begin is None else begin
        following = speeds[number + 1] if number + 1 < len(speeds) else None
        if following is None or not _is_held(ended[following], name, names):
            stretches.append(Stretch(begin, speed, following))
    fails_at = stretches[0].fails_at if stretches else speeds[0]
    failed = None if fails_at is None else ended[fails_at]
    row = None if failed is None else _row(failed, name)
    by = None if row is None or row["value"] is None else (row["value"], row["limit"])
    stopped: tuple[str, ...] = ()
    if name == ALL and failed is not None:
        stopped = tuple(n for n in names if not _is_held(failed, n, names))
        stopped = stopped if failed.done else (failed.outcome,)
    return Holds(name, tuple(stretches), by, _unit(ended, name), stopped)


def _unit(ended: dict[float, Ended], name: str) -> str:
    rows = (_row(one, name) for one in ended.values())
    return next((str(row["unit"]) for row in rows if row is not None), "")
