"""The limits of EN 50367, edition by edition.

The edition of 2006 is the one that Ambrosio et al. (2012) quote in their section 1. The curves of
the allowed mean force for AC, DC 3 kV and DC 1.5 kV are those of EN 50367 and of the TSI Energy.
For what the newer editions leave to the line's designer (uplift, amplitude) the table keeps the
values of 2006. Clauses marked "assumed" were not compared with the text of the standard.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from catenary.base.errors import InputError

SYSTEMS = {"ac": "AC", "dc_3kv": "DC 3 kV", "dc_1500v": "DC 1.5 kV"}
KMH = 3.6  # km/h in 1 m/s


@dataclass(frozen=True)
class MeanForceRule:
    """Mean force at most ``factor`` v^2 + ``base`` [N], v in km/h, up to ``up_to`` [km/h]."""

    up_to: float
    factor: float
    base: float


@dataclass(frozen=True)
class ForceStep:
    """Maximum force ``limit`` [N] up to ``up_to`` [km/h]."""

    up_to: float
    limit: float


@dataclass(frozen=True)
class Edition:
    """The limits of one edition.

    Attributes
    ----------
    title : as cited
    mean_force : system -> rules, by ascending speed
    std_ratio : standard deviation over mean force, at most
    max_force : system -> steps, by ascending speed; the force must stay below
    min_force : the force must stay above [N], None where the edition has no such line
    arm_uplift : uplift of the contact wire at a steady arm, at most [m]
    height_range : vertical amplitude of the contact point, at most [m]
    arcing_percent : losses of contact of 5 ms and longer, at most [%]
    speed_ratio : train speed over the slowest wave of the contact wire, at most
    clause : line of this table -> where it stands
    """

    title: str
    mean_force: Mapping[str, tuple[MeanForceRule, ...]]
    std_ratio: float
    max_force: Mapping[str, tuple[ForceStep, ...]]
    min_force: float | None
    arm_uplift: float
    height_range: float
    arcing_percent: float
    speed_ratio: float
    clause: Mapping[str, str]


_ALWAYS = math.inf
_MEAN_FORCE = {
    "ac": (MeanForceRule(200.0, 0.00047, 90.0), MeanForceRule(_ALWAYS, 0.00097, 70.0)),
    "dc_3kv": (MeanForceRule(_ALWAYS, 0.00097, 110.0),),
    "dc_1500v": (MeanForceRule(_ALWAYS, 0.00097, 140.0),),
}
_MAX_FORCE_2006 = {system: (ForceStep(_ALWAYS, 350.0),) for system in SYSTEMS}
_MAX_FORCE_2012 = {
    "ac": (ForceStep(200.0, 300.0), ForceStep(_ALWAYS, 350.0)),
    "dc_3kv": (ForceStep(200.0, 300.0), ForceStep(_ALWAYS, 400.0)),
    "dc_1500v": (ForceStep(200.0, 300.0), ForceStep(_ALWAYS, 400.0)),
}
_SPEED = "EN 50119: V <= 0.7 C"
_BY_BENDING = (
    "as EN 50119: V <= 0.7 C, C of the slowest bending wave; stated for tensioned wires (assumed)"
)
_CLAUSE_2006 = {
    "mean": "EN 50367:2006",
    "std": "EN 50367:2006",
    "max": "EN 50367:2006",
    "uplift": "EN 50367:2006",
    "height": "EN 50367:2006",
    "arcing": "EN 50367:2006; losses shorter than 5 ms not counted (assumed)",
    "speed": _SPEED,
    "speed_by_bending": _BY_BENDING,
}


def _newer(year: str) -> Edition:
    own = f"EN 50367:{year}"
    kept = "as EN 50367:2006; left to the line's design (assumed)"
    return Edition(
        title=own,
        mean_force=_MEAN_FORCE,
        std_ratio=0.3,
        max_force=_MAX_FORCE_2012,
        min_force=0.0,
        arm_uplift=0.120,
        height_range=0.080,
        arcing_percent=0.2,
        speed_ratio=0.7,
        clause={
            "mean": f"{own}, table of mean forces",
            "std": own,
            "max": f"{own} with EN 50119, table of contact forces (assumed)",
            "min": f"{own} with EN 50119, table of contact forces (assumed)",
            "uplift": kept,
            "height": kept,
            "arcing": f"{own}; losses shorter than 5 ms not counted (assumed)",
            "speed": _SPEED,
            "speed_by_bending": _BY_BENDING,
        },
    )


EDITIONS: dict[str, Edition] = {
    "2006": Edition(
        title="EN 50367:2006",
        mean_force=_MEAN_FORCE,
        std_ratio=0.3,
        max_force=_MAX_FORCE_2006,
        min_force=None,
        arm_uplift=0.120,
        height_range=0.080,
        arcing_percent=0.2,
        speed_ratio=0.7,
        clause=_CLAUSE_2006,
    ),
    "2012": _newer("2012"),
    "2020": _newer("2020"),
}


def mean_force_limit(speed: float, system: str, edition: str) -> float:
    """Largest allowed mean contact force [N] at ``speed`` [m/s]."""
    v = speed * KMH
    rule = next(r for r in edition_of(edition).mean_force[system_of(system)] if _up_to(v, r.up_to))
    return rule.factor * v**2 + rule.base


def max_force_limit(speed: float, system: str, edition: str) -> float:
    """Force [N] below which the contact force must stay at ``speed`` [m/s]."""
    v = speed * KMH
    return next(
        s.limit for s in edition_of(edition).max_force[system_of(system)] if _up_to(v, s.up_to)
    )


def _up_to(speed_km_h: float, bound: float) -> bool:
    # 200 km/h is 55.555... m/s and comes back with a rounding error.
    return speed_km_h <= bound * (1.0 + 1e-9)


def edition_of(name: str) -> Edition:
    """The edition of that name; InputError if there is none."""
    if name not in EDITIONS:
        raise InputError(
            f'there is no edition "{name}" of EN 50367 here: choose one of {", ".join(EDITIONS)}'
        )
    return EDITIONS[name]


def system_of(name: str) -> str:
    """The name of a supply system; InputError if it is none."""
    if name not in SYSTEMS:
        raise InputError(f'there is no supply system "{name}": choose one of {", ".join(SYSTEMS)}')
    return name
