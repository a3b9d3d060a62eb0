"""Acceptance of a run: its statistics beside the limits of an edition of EN 50367."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from catenary.postproc.evaluate.statistics import PantographStatistics, RunStatistics
from catenary.postproc.standards.en50367 import (
    KMH,
    edition_of,
    max_force_limit,
    mean_force_limit,
)

# Where the limit of lateral places comes from, which no edition has.
_STRIPS_END = "strips.length_m"


@dataclass(frozen=True)
class Criterion:
    """One judged line of the table.

    Attributes
    ----------
    criterion : what is judged, in words; names the pantograph where there are several
    value, limit : in ``unit``; the value is NaN where the run gives none
    unit : for readers: N, mm, %, km/h
    relation : how the value must stand to the limit, "<=", "<" or ">"
    passed : None if there is no value to judge
    clause : where the limit comes from
    """

    criterion: str
    value: float
    limit: float
    unit: str
    relation: str
    passed: bool | None
    clause: str


def judge(
    statistics: RunStatistics,
    speed: float,
    wave_speed: float,
    system: str,
    edition: str,
    by_bending: bool = False,
) -> list[Criterion]:
    """Every line of an edition's table, judged: those of each pantograph, then those of the line.

    Parameters
    ----------
    statistics : of the run
    speed : of the train [m/s]
    wave_speed : of the slowest wave of the contact wire [m/s]
    system : key of ``SYSTEMS``
    edition : key of ``EDITIONS``
    by_bending : whether that wave is one of a conductor rail, for which EN 50119 states no rule

    Raises
    ------
    InputError
        If system or edition is unknown.
    """
    table = edition_of(edition)
    judged = []
    several = len(statistics.pantographs) > 1
    for pantograph in statistics.pantographs:
        suffix = f", {pantograph.name}" if several else ""
        judged += _of_pantograph(pantograph, suffix, speed, system, edition)
    for lateral in statistics.lateral:
        if not math.isnan(lateral.half_length):
            judged.append(
                _criterion(
                    "lateral place of the contact wire on the strips"
                    + (f", {lateral.name}" if several else ""),
                    1e3 * abs(lateral.place),
                    1e3 * lateral.half_length,
                    "mm",
                    "<=",
                    _STRIPS_END,
                )
            )
    uplift = statistics.supports.maximum
    judged.append(
        _criterion(
            "contact-wire uplift at steady arms",
            1e3 * uplift,
            1e3 * table.arm_uplift,
            "mm",
            "<=",
            table.clause["uplift"],
        )
    )
    judged.append(
        _criterion(
            f"train speed against {table.speed_ratio:g} of the wave speed",
            KMH * speed,
            KMH * table.speed_ratio * wave_speed,
            "km/h",
            "<=",
            table.clause["speed_by_bending" if by_bending else "speed"],
        )
    )
    return judged


def verdict(criteria: list[Criterion]) -> bool | None:
    """True if all passed, False if one failed, None if none failed but some were not judged."""
    if any(c.passed is False for c in criteria):
        return False
    return None if any(c.passed is None for c in criteria) else True


def _of_pantograph(
    p: PantographStatistics, suffix: str, speed: float, system: str, edition: str
) -> list[Criterion]:
    table = edition_of(edition)
    mean_limit = mean_force_limit(speed, system, edition)
    rows = [
        ("mean contact force", p.mean, mean_limit, "N", "<=", "mean"),
        (
            f"standard deviation, {table.std_ratio:g} of the mean",
            p.std,
            table.std_ratio * p.mean,
            "N",
            "<=",
            "std",
        ),
        (
            f"standard deviation, {table.std_ratio:g} of the allowed mean",
            p.std,
            table.std_ratio * mean_limit,
            "N",
            "<=",
            "std",
        ),
        (
            "maximum contact force",
            p.maximum,
            max_force_limit(speed, system, edition),
            "N",
            "<",
            "max",
        ),
    ]
    if table.min_force is not None:
        rows.append(("minimum contact force", p.minimum, table.min_force, "N", ">", "min"))
    rows += [
        (
            "vertical amplitude of the contact point",
            1e3 * p.contact_height_range,
            1e3 * table.height_range,
            "mm",
            "<=",
            "height",
        ),
        ("arcing NQ", p.arcing_percent, table.arcing_percent, "%", "<=", "arcing"),
    ]
    criteria = [
        _criterion(what + suffix, value, limit, unit, relation, table.clause[line])
        for what, value, limit, unit, relation, line in rows
    ]
    return [replace(c, passed=None) for c in criteria] if p.unjudged else criteria


def _criterion(
    what: str, value: float, limit: float, unit: str, relation: str, clause: str
) -> Criterion:
    passed: bool | None = None
    if not (math.isnan(value) or math.isnan(limit)):
        passed = bool({"<=": value <= limit, "<": value < limit, ">": value > limit}[relation])
    return Criterion(what, value, limit, unit, relation, passed, clause)
