"""Quantities of a run that rule books judge, or the sentence why the run has none.

Each function is named in ``standards.rule_books``; its values are in the unit that stands there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from catenary.meshgen.slowest_wave import bends
from catenary.meshgen.wires import Role, worn_round
from catenary.postproc.evaluate.statistics import (
    PantographStatistics,
    RunStatistics,
    slackens_at_all,
)
from catenary.postproc.read.results import ContactProfile, Results, in_stretch
from catenary.postproc.standards.rule_books import KMH
from catenary.solver.problem.watched_links import TENSION

# A smaller gradient, a millimetre from mast to mast, is none: erection leaves ten times that [-].
_NO_GRADIENT = 2e-5
# Wires that differ by less in height are both met [m].
_SAME_HEIGHT = 1e-3


class WireAtRest(NamedTuple):
    """The lowest contact wire along the evaluation stretch, which a head meets.

    Attributes
    ----------
    x : (n,) nodes of the contact wires along the track, ascending [m]
    height : (n,) above the rail [m]
    y : (m, 2) place of a node along the track and to the left, of wires that are met [m]; None
        where no wire moves sideways
    sweep : mean of |dy/dx| along the wires that are met [-], None likewise
    """

    x: np.ndarray
    height: np.ndarray
    y: np.ndarray | None
    sweep: float | None

    def gradients(self, masts: np.ndarray) -> np.ndarray:
        """Gradients between successive ``masts`` (n,) [m] in the stretch, shape (n - 1,) [-]."""
        height = np.interp(masts, self.x, self.height)
        slopes = np.diff(height) / np.diff(masts)
        return np.where(np.abs(slopes) < _NO_GRADIENT, 0.0, slopes)


def wire_at_rest(results: Results) -> WireAtRest | None:
    """The contact wire at rest in the evaluation stretch, None if no node is there. Not
    collective."""
    profiles = list(results.contact_profiles().values())
    x = np.unique(np.concatenate([profile.x for profile in profiles]))
    x = x[in_stretch(x, *results.evaluation)]
    if not x.size:
        return None
    heights = np.array([profile.height_at(x) for profile in profiles])
    lowest = np.nanmin(heights, axis=0)
    y, sweep = _lateral(profiles, x, lowest)
    return WireAtRest(x, lowest, y, sweep)


def _lateral(
    profiles: list[ContactProfile], x: np.ndarray, lowest: np.ndarray
) -> tuple[np.ndarray | None, float | None]:
    """Lateral positions and sweep of wires where they are met."""
    places, swept, length = [], 0.0, 0.0
    for profile in profiles:
        if profile.y is None:
            return None, None
        for piece in profile.pieces():
            at, y, height = profile.x[piece], profile.y[piece], profile.height[piece]
            met = (at >= x[0]) & (at <= x[-1])
            met &= height <= np.interp(at, x, lowest) + _SAME_HEIGHT
            places.append(np.column_stack([at[met], y[met]]))
            both = met[:-1] & met[1:]
            swept += float(np.abs(np.diff(y))[both].sum())
            length += float(np.diff(at)[both].sum())
    return np.concatenate(places), swept / length if length else None


@dataclass(frozen=True)
class Observation:
    """A quantity of a run.

    Attributes
    ----------
    values : by the name of a pantograph, or under "" for the run; NaN where its record gives none
    unjudged : why values are NaN, or judge nothing, by the same names
    absent : why runs of this scene have no such quantity, empty if they have
    so_far : why values may still grow, empty if they are final
    note : remark on the quantity where it is a limit
    """

    values: Mapping[str, float] = field(default_factory=dict)
    unjudged: Mapping[str, str] = field(default_factory=dict)
    absent: str = ""
    so_far: str = ""
    note: str = ""


class ObservedRun:
    """A run, and what several quantities are taken from."""

    def __init__(self, results: Results, statistics: RunStatistics) -> None:
        self.results = results
        self.statistics = statistics

    @cached_property
    def wire(self) -> WireAtRest | None:
        """The contact wire at rest."""
        return wire_at_rest(self.results)

    @cached_property
    def masts(self) -> np.ndarray:
        """Masts in the evaluation stretch, (n,) [m]."""
        if self.wire is None:
            return np.zeros(0)
        masts, x = self.results.line("support_x"), self.wire.x
        return masts[in_stretch(masts, *self.results.evaluation) & in_stretch(masts, x[0], x[-1])]


Observe = Callable[[ObservedRun], Observation]
# Quantities that grow from step to step, as pantographs pass.
_OF_PASSAGES = {
    *("arm_uplift", "strip_place", "contact_wire_tension"),
    *("dropper_force_max", "dropper_compression", "dropper_slackenings"),
}


def observe(
    names: Iterable[str], results: Results, statistics: RunStatistics
) -> dict[str, Observation]:
    """The quantities of ``names`` of a run, from its ``results`` and ``statistics``. Not
    collective."""
    run = ObservedRun(results, statistics)
    found = {name: OBSERVED[name](run) for name in dict.fromkeys(names)}
    if all(p.covered for p in statistics.pantographs):
        return found
    why = "the record does not cover the evaluation stretch"
    return {
        name: replace(one, so_far=why) if name in _OF_PASSAGES else one
        for name, one in found.items()
    }


def _one(value: float, missing: str = "") -> Observation:
    """A quantity of the run; ``missing`` is why it is NaN."""
    return Observation({"": value}, {"": missing} if math.isnan(value) else {})


def _force(of: Callable[[PantographStatistics], float]) -> Observe:
    def observation(run: ObservedRun) -> Observation:
        pantographs = run.statistics.pantographs
        reasons = {p.name: p.complaint or p.unjudged for p in pantographs}
        unjudged = {name: why for name, why in reasons.items() if why}
        return Observation({p.name: of(p) for p in pantographs}, unjudged)

    return observation


def _strip_place(run: ObservedRun) -> Observation:
    if not run.statistics.lateral:
        return Observation(absent="no contact wire moves sideways in this run")
    return Observation({p.name: 1e3 * abs(p.place) for p in run.statistics.lateral})


def _strip_half_length(run: ObservedRun) -> Observation:
    names = run.results.pantograph_names()
    halves = run.results.facts_of("strip_half_length")
    known = {
        name: 1e3 * float(half)
        for name, half in zip(names, halves, strict=True)
        if not math.isnan(half)
    }
    return Observation(known, absent="" if known else "the length of the strips is not known")


def _distance_ahead(run: ObservedRun) -> Observation:
    names = run.results.pantograph_names()
    if len(names) < 2:
        return Observation(absent="the train has one pantograph")
    if not run.results.n_rows("time"):
        return Observation(dict.fromkeys(names[1:], math.nan), dict.fromkeys(names, "no records"))
    first = run.results.first_position
    order = np.argsort(-first, kind="stable").tolist()
    return Observation(
        {
            names[behind]: _as_stated(first[ahead] - first[behind])
            for ahead, behind in zip(order[:-1], order[1:], strict=True)
        }
    )


def _arm_uplift(run: ObservedRun) -> Observation:
    value = 1e3 * run.statistics.supports.maximum
    return _one(value, "no steady arm in the evaluation stretch has a record")


def _as_stated(value: float) -> float:
    """A number of the scene that was converted and back, which rounds: 120 km/h are 1e-14 more."""
    return round(float(value), 9)


def _train_speed(run: ObservedRun) -> Observation:
    return _one(_as_stated(KMH * run.results.fact("speed")))


def _wave_speed(run: ObservedRun) -> Observation:
    slowest = run.results.fact("wave_speed")
    tensions = run.results.facts_of_wires("contact_wire_tension")
    masses = run.results.facts_of_wires("contact_wire_mass")
    by_bending = all(bends(slowest, tensions[wire], masses[wire]) for wire in tensions)
    note = "C of the slowest bending wave; stated for tensioned wires (assumed)"
    return Observation({"": KMH * slowest}, note=note if by_bending else "")


def _of_wire(of: Callable[[WireAtRest], float]) -> Observe:
    def observation(run: ObservedRun) -> Observation:
        if run.wire is None:
            return Observation(absent="no node of a contact wire is in the evaluation stretch")
        return _one(of(run.wire))

    return observation


def _gradient(of: Callable[[np.ndarray], float], fewest: int) -> Observe:
    def observation(run: ObservedRun) -> Observation:
        if run.wire is None or run.masts.size < fewest:
            return Observation(
                absent=f"the evaluation stretch has {run.masts.size} masts, fewer than {fewest}"
            )
        return _one(1e3 * of(run.wire.gradients(run.masts)))

    return observation


def _wire_lateral_place(run: ObservedRun) -> Observation:
    if run.wire is None or run.wire.y is None:
        return Observation(absent="no contact wire moves sideways in this run")
    return _one(1e3 * float(np.abs(run.wire.y[:, 1]).max()))


def _lateral_sweep(run: ObservedRun) -> Observation:
    if run.wire is None or run.wire.sweep is None:
        return Observation(absent="no contact wire moves sideways in this run")
    return _one(1e3 * run.wire.sweep * run.results.fact("speed"))


def _elasticity_variation(run: ObservedRun) -> Observation:
    elasticity = run.results.static("elasticity")
    if not elasticity.size:
        return Observation(absent="the run has no elasticity of its line")
    low, high = float(elasticity.min()), float(elasticity.max())
    return _one(100.0 * (high - low) / (high + low))


_NO_DROPPER = "no dropper hangs in the evaluation stretch"


def _dropper_force_max(run: ObservedRun) -> Observation:
    droppers = run.statistics.droppers
    if not droppers.evaluated.any():
        return Observation(absent=_NO_DROPPER)
    return _one(droppers.maximum, "no record of dropper forces")


def _dropper_compression(run: ObservedRun) -> Observation:
    droppers = run.statistics.droppers
    if not droppers.evaluated.any():
        return Observation(absent=_NO_DROPPER)
    least = droppers.minimum
    return _one(least if math.isnan(least) else max(0.0, -least), "no record of dropper forces")


def _dropper_slackenings(run: ObservedRun) -> Observation:
    results, evaluated = run.results, run.statistics.droppers.evaluated
    if not evaluated.any():
        return Observation(absent=_NO_DROPPER)
    if not slackens_at_all(results):
        return Observation(absent="droppers do not slacken in this run")
    if not results.has("dropper_force") or not results.line_record.whole:
        return Observation(absent="the forces of droppers are not recorded in every step")
    begun = np.zeros(evaluated.size, dtype=np.int64)
    was, until = np.zeros(0, dtype=bool), (-1, -1)
    for part, columns, force in results.written_blocks("dropper_force"):
        slack = force <= 0.0
        if (columns[0], part.start) != until:  # the first rows, or the first after unwritten ones
            was = np.zeros(columns.size, dtype=bool)
        begun[columns] += (slack & ~np.vstack([was, slack[:-1]])).sum(axis=0)
        was, until = slack[-1], (columns[0], part.stop)
    # One that never carries, as it is missing or too long, does not slacken.
    carries = run.statistics.droppers.highest > 0.0
    return _one(float(begun[evaluated & carries].max(initial=0)))


def _contact_wire_tension(run: ObservedRun) -> Observation:
    results = run.results
    if results.has(TENSION) and results.n_rows("time"):
        roles = list(results.roles.values())
        of_contact = [roles[n] is Role.CONTACT for n in results.line("end_wire").tolist()]
        largest = results.extremes(TENSION)[1][np.array(of_contact, dtype=bool)]
        if largest.size and not np.isnan(largest).any():
            return _one(float(largest.max()))
    return _one(max(results.facts_of_wires("contact_wire_tension").values()))


def _contact_wire_strain(run: ObservedRun) -> Observation:
    forces = [p.stat_max for p in run.statistics.pantographs if not (p.complaint or p.unjudged)]
    if not forces:
        return _one(math.nan, "no pantograph has statistics")
    results = run.results
    facts = ("tension", "mass", "bending_stiffness", "axial_stiffness", "lost_section")
    columns = [results.facts_of_wires(f"contact_wire_{name}").values() for name in facts]
    speed, strains = results.fact("speed"), []
    for wire in zip(*columns, strict=True):
        *known, lost = wire
        if any(math.isnan(number) or not number > 0.0 for number in known):
            return Observation(absent="the axial or bending stiffness of the wire is not known")
        if math.isnan(lost):
            return Observation(absent="how far the contact wire is worn is not known")
        if speed**2 * (1.0 - lost) * wire[1] >= wire[0]:
            return Observation(absent="the train is faster than waves of the contact wire")
        strains.append(bending_strain(max(forces), speed, *wire))
    return _one(1e6 * max(strains))


def bending_strain(
    force: float,
    speed: float,
    tension: float,
    mass: float,
    bending_stiffness: float,
    axial_stiffness: float,
    lost: float = 0.0,
) -> float:
    """Strain at the surface of a round wire under a force that moves along it [-].

    A beam under tension that travels with the force satisfies EI w'''' - (F - m v^2) w'' = 0 beside
    it, so that its curvature there is P / (2 sqrt(EI (F - m v^2))). The radius of a round wire is
    2 sqrt(EI / EA). Droppers and supports are far off: sqrt(EI / F) is about 0.1 m. A worn wire has
    less mass and bending stiffness, and its top is nearer to the axis of bending.

    Parameters
    ----------
    force : float
        Force P, all of it at one point [N].
    speed : float
        Speed V of the force, below that of waves [m/s].
    tension, mass : float
        Tension F [N] and mass m [kg/m] of the wire.
    bending_stiffness, axial_stiffness : float
        EI [N m2] and EA [N] of the wire, before it wears.
    lost : float
        Share of its section that is worn off from below [-].
    """
    worn = worn_round(lost)
    pull = tension - (1.0 - lost) * mass * speed**2
    curvature = force / (2.0 * math.sqrt(worn.bending * bending_stiffness * pull))
    return curvature * worn.farthest * 2.0 * math.sqrt(bending_stiffness / axial_stiffness)


OBSERVED: dict[str, Observe] = {
    "mean_force": _force(lambda p: p.mean),
    "force_std": _force(lambda p: p.std),
    "force_max": _force(lambda p: p.maximum),
    "force_min": _force(lambda p: p.minimum),
    "force_stat_max": _force(lambda p: p.stat_max),
    "force_stat_min": _force(lambda p: p.stat_min),
    "contact_height_range": _force(lambda p: 1e3 * p.contact_height_range),
    "arcing": _force(lambda p: p.arcing_percent),
    "strip_place": _strip_place,
    "strip_half_length": _strip_half_length,
    "distance_ahead": _distance_ahead,
    "arm_uplift": _arm_uplift,
    "train_speed": _train_speed,
    "wave_speed": _wave_speed,
    "wire_height_max": _of_wire(lambda wire: 1e3 * float(wire.height.max())),
    "wire_height_min": _of_wire(lambda wire: 1e3 * float(wire.height.min())),
    "wire_gradient": _gradient(lambda slopes: float(np.abs(slopes).max()), 2),
    "wire_gradient_change": _gradient(lambda slopes: float(np.abs(np.diff(slopes)).max()), 3),
    "wire_lateral_place": _wire_lateral_place,
    "lateral_sweep": _lateral_sweep,
    "elasticity_variation": _elasticity_variation,
    "dropper_force_max": _dropper_force_max,
    "dropper_compression": _dropper_compression,
    "dropper_slackenings": _dropper_slackenings,
    "contact_wire_tension": _contact_wire_tension,
    "contact_wire_strain": _contact_wire_strain,
}
