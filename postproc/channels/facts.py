"""Facts of a run in SI units: derived once from its problem, stored in its result file.

One table for the writer, the reader, their checks and the documentation. To add a fact, add a row
to ``FACTS``; whatever evaluates a run reads it with ``Results.fact`` or ``Results.facts_of``. A
reader needs no effects and no line: what facts are derived with is loaded when they are derived.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from catenary.meshgen.wires import Role, Wire
from catenary.solver.problem.contact_laws import ContactLaw, HertzLaw, LinearLaw
from catenary.solver.problem.ends import Periodic
from catenary.solver.problem.integrator_parameters import Integration, integration_of
from catenary.solver.time_loop.views.channels import PANTOGRAPH, RUN

if TYPE_CHECKING:
    from catenary.meshgen.mesh import LineMesh
    from catenary.solver.problem.problem import Problem, Simulated

# Of each contact wire, in the order of the line.
WIRE = "contact wire"
# Bounds of what cannot be zero, and of everything.
_POSITIVE, _MOST = 1e-12, 1e15
NONE = float("nan")


class Derivation(NamedTuple):
    """Sources of facts: the problem, its mesh, the droppers' lengths (n,) [m], and the laws that
    its effects set."""

    problem: Problem
    mesh: LineMesh
    dropper_length: np.ndarray
    laws: Simulated


class Fact(NamedTuple):
    """A fact.

    Attributes
    ----------
    unit : SI unit, "-" if none
    meaning : description in words
    of : how it is derived: a number, or a sequence with one for each pantograph or contact wire
    per : ``RUN``, ``PANTOGRAPH`` or ``WIRE``
    low, high : bounds, inclusive
    may_be_nan : whether NaN is a value, which then stands for "none"
    """

    unit: str
    meaning: str
    of: Callable[[Derivation], float | Sequence[float]]
    per: str = RUN
    low: float = 0.0
    high: float = _MOST
    may_be_nan: bool = False


def facts_of(problem: Problem, mesh: LineMesh, dropper_length: np.ndarray) -> dict[str, np.ndarray]:
    """All facts of a run by name, (), (n_pantographs,) or (n_contact_wires,) each. Not collective.

    Parameters
    ----------
    problem : Problem
        Problem of the run.
    mesh : LineMesh
        Mesh of the line.
    dropper_length : ndarray, shape (n_droppers,)
        Length of droppers at rest [m].
    """
    from catenary.solver.effects.all_effects import simulated

    source = Derivation(problem, mesh, dropper_length, simulated(problem))
    return {name: np.asarray(fact.of(source), dtype=float) for name, fact in FACTS.items()}


def _or_none(value: float | None) -> float:
    return NONE if value is None else float(value)


def _shortest_step(source: Derivation) -> float:
    from catenary.solver.problem.problem import n_halvings

    numerics = source.problem.numerics
    if not numerics.adaptive_tolerance:
        return numerics.dt
    return float(numerics.dt / 2 ** n_halvings(numerics.dt, numerics.smallest_dt))


def _integration(source: Derivation) -> Integration:
    numerics = source.problem.numerics
    own = numerics.integrator, numerics.spectral_radius, numerics.beta, numerics.gamma
    return integration_of(*own)


def _of_contacts(of: Callable[[Derivation, Wire], float]) -> Callable[[Derivation], list[float]]:
    """Derivation of a fact of each contact wire."""
    return lambda source: [of(source, wire) for wire in source.problem.line.wires_of(Role.CONTACT)]


def _damping(source: Derivation, component: str) -> tuple[float, float]:
    own = source.laws.damping
    return own.per_component.get(component, (own.alpha, own.beta))


def _longest_element(source: Derivation, wire: Wire) -> float:
    """Longest element of a wire [m] where it is evaluated; its shortest one if it is not there."""
    first, second = (source.mesh.x(ends) for ends in source.mesh.elements(wire.name).T)
    start, end = source.problem.evaluation
    lengths = (second - first)[(second > start) & (first < end)]
    return float(lengths.max(initial=(second - first).min()))


def _lost_section(source: Derivation, wire: Wire) -> float:
    low, high = source.problem.evaluation
    return max((lost for start, end, lost in wire.worn if end > low and start < high), default=0.0)


def _stiffest_dropper(source: Derivation) -> float:
    stiffest = 0.0
    for number, group in enumerate(source.problem.line.droppers):
        length = source.dropper_length[source.mesh.dropper_group == number]
        stiffest = max(stiffest, float(group.kind.slopes_at(length).slope.max(initial=0.0)))
    return stiffest


def _stiffness_under(law: ContactLaw, force: float) -> float:
    """Tangent stiffness of a contact law under a force [N/m]."""
    if isinstance(law, LinearLaw):
        return law.stiffness
    if isinstance(law, HertzLaw):
        share = 1.0 / law.exponent
        return float(law.exponent * law.stiffness**share * force ** (1.0 - share))
    return math.inf


def _slowest_wave(source: Derivation) -> float:
    from catenary.meshgen.slowest_wave import slowest_wave

    return slowest_wave(source.problem.line)


def _strongest_gust(source: Derivation) -> float:
    """Strongest gust over the mean wind, if drag of gusts is linearised; else none."""
    from catenary.solver.wind import PEAK

    wind = source.laws.wind
    if wind is None or wind.gusts is None or wind.quadratic:
        return NONE
    return PEAK * wind.intensity


def _touching_masses(source: Derivation) -> list[float]:
    from catenary.mbs.build import touching_mass

    return [touching_mass(place.data) for place in source.problem.train.placements]


def _actuator_forces(source: Derivation) -> list[float]:
    from catenary.mbs.build import actuator_force

    return [_or_none(actuator_force(place.data)) for place in source.problem.train.placements]


def _strip_half_lengths(source: Derivation) -> list[float]:
    own = (place.data.strips.half_length for place in source.problem.train.placements)
    return [half if math.isfinite(half) else NONE for half in own]


FACTS: dict[str, Fact] = {
    "time_step": Fact(
        "s",
        "time between two records",
        lambda source: source.problem.numerics.dt,
        low=_POSITIVE,
        high=1e3,
    ),
    "shortest_step": Fact(
        "s", "shortest step that the run may take", _shortest_step, low=1e-15, high=1e3
    ),
    "step_tolerance": Fact(
        "N",
        "error of a contact force accepted in a step, NaN where steps are not adapted",
        lambda source: _or_none(source.problem.numerics.adaptive_tolerance),
        may_be_nan=True,
    ),
    "fixed_iterations": Fact(
        "-",
        "iterations of every step of the fixed-point scheme, NaN where it iterates to tolerances",
        lambda source: _or_none(source.problem.numerics.iterations),
        may_be_nan=True,
    ),
    "newmark_beta": Fact(
        "-", "Newmark's beta of the line's integrator", lambda source: _integration(source).beta
    ),
    "newmark_gamma": Fact(
        "-", "Newmark's gamma of the line's integrator", lambda source: _integration(source).gamma
    ),
    "mass_weight": Fact(
        "-",
        "weight of a step's start in the inertia forces (alpha_m of generalized alpha)",
        lambda source: _integration(source).mass_weight,
        low=-1.0,
        high=1.0,
    ),
    "force_weight": Fact(
        "-",
        "weight of a step's start in all other forces (alpha_f of generalized alpha)",
        lambda source: _integration(source).force_weight,
        high=1.0,
    ),
    "speed": Fact(
        "m/s",
        "speed of the train",
        lambda source: source.problem.train.speed,
        low=_POSITIVE,
        high=1e4,
    ),
    "wave_speed": Fact(
        "m/s",
        "speed of the contact wire's slowest wave at the start, that of a string unless supports "
        "and bending stiffness carry it; of several the smallest",
        _slowest_wave,
        low=_POSITIVE,
        high=1e6,
    ),
    "contact_wire_tension": Fact(
        "N",
        "tension of a contact wire at the start",
        _of_contacts(lambda source, wire: wire.tension),
        per=WIRE,
        low=1e-6,
    ),
    "contact_wire_mass": Fact(
        "kg/m",
        "mass per length of a contact wire",
        _of_contacts(lambda source, wire: wire.mass_per_length),
        per=WIRE,
        low=1e-9,
    ),
    "contact_wire_bending_stiffness": Fact(
        "N m2",
        "bending stiffness of a contact wire",
        _of_contacts(lambda source, wire: wire.bending_stiffness),
        per=WIRE,
    ),
    "contact_wire_axial_stiffness": Fact(
        "N",
        "axial stiffness of a contact wire, NaN if it is not known",
        _of_contacts(lambda source, wire: _or_none(wire.axial_stiffness)),
        per=WIRE,
        may_be_nan=True,
    ),
    "contact_wire_lost_section": Fact(
        "-",
        "largest share of its section that a contact wire has lost by wear in the evaluation "
        "stretch",
        _of_contacts(_lost_section),
        per=WIRE,
        high=1.0,
    ),
    "contact_wire_stiffness_damping": Fact(
        "s",
        "alpha of a contact wire's proportional damping C = alpha K + beta M",
        _of_contacts(lambda source, wire: _damping(source, wire.name)[0]),
        per=WIRE,
    ),
    "contact_wire_mass_damping": Fact(
        "1/s",
        "beta of a contact wire's proportional damping C = alpha K + beta M",
        _of_contacts(lambda source, wire: _damping(source, wire.name)[1]),
        per=WIRE,
    ),
    "longest_element": Fact(
        "m",
        "length of the longest element of a contact wire in the evaluation stretch, of the "
        "shortest one if the wire is not there",
        _of_contacts(_longest_element),
        per=WIRE,
        low=_POSITIVE,
        high=1e9,
    ),
    "stiffest_dropper": Fact("N/m", "largest stiffness of a dropper", _stiffest_dropper),
    "dropper_stiffness_damping": Fact(
        "s",
        "alpha of the droppers' proportional damping C = alpha K + beta M",
        lambda source: max(
            (_damping(source, group.name)[0] for group in source.problem.line.droppers),
            default=0.0,
        ),
    ),
    "added_dropper_damping": Fact(
        "s",
        "the part of that alpha which is numerical damping of droppers stiff for the step",
        lambda source: max(
            (
                source.laws.added_alpha.get(group.name, 0.0)
                for group in source.problem.line.droppers
            ),
            default=0.0,
        ),
    ),
    "slack_stiffness_share": Fact(
        "-",
        "share of its stiffness that a pushed dropper keeps, 1 where droppers do not slacken",
        lambda source: source.laws.kept_ratio,
        high=1.0,
    ),
    "periodic_start": Fact(
        "-",
        "1 where the line goes on periodically beyond its start, 0 where not",
        lambda source: float(isinstance(source.problem.ends[0], Periodic)),
        high=1.0,
    ),
    "periodic_end": Fact(
        "-",
        "the same of its end",
        lambda source: float(isinstance(source.problem.ends[1], Periodic)),
        high=1.0,
    ),
    "strongest_gust": Fact(
        "-",
        "gust that is hardly exceeded, over the mean wind, where drag is linearised about that; "
        "NaN without such gusts",
        _strongest_gust,
        may_be_nan=True,
    ),
    "static_force": Fact(
        "N",
        "static force of a pantograph",
        lambda source: [place.static_force for place in source.problem.train.placements],
        per=PANTOGRAPH,
    ),
    "actuator_force": Fact(
        "N",
        "constant force of the actuator of a multibody pantograph at its static force, NaN for "
        "others",
        _actuator_forces,
        per=PANTOGRAPH,
        low=-_MOST,
        may_be_nan=True,
    ),
    "touching_mass": Fact(
        "kg",
        "mass that one contact meets first: a strip on its suspension, or its share of the head",
        _touching_masses,
        per=PANTOGRAPH,
        low=1e-9,
    ),
    "strip_half_length": Fact(
        "m",
        "half length of the strips of a pantograph, NaN if it is not known",
        _strip_half_lengths,
        per=PANTOGRAPH,
        may_be_nan=True,
    ),
    "contact_stiffness": Fact(
        "N/m",
        "stiffness of the contact, of a law that is not linear its tangent at the static force; "
        "infinite where head and wire cannot part",
        lambda source: [
            _stiffness_under(source.problem.contact, place.static_force)
            for place in source.problem.train.placements
        ],
        per=PANTOGRAPH,
        high=math.inf,
    ),
}
