"""Facts of a run in SI units: derived once from its problem, stored in its result file.

``FACTS`` is one table for the writer, the reader, their checks and the documentation. To add a
fact, add a row there, and its value by the same name in ``_of_run``, ``_of_wire`` or
``_of_pantograph``; whatever evaluates a run reads it with ``Results.fact`` or ``Results.facts_of``.
A reader needs no effects and no line: what facts are derived with is loaded when they are derived.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from catenary.meshgen.wires import Role, Wire
from catenary.solver.problem.contact_laws import ContactLaw, HertzLaw, LinearLaw
from catenary.solver.problem.ends import Periodic
from catenary.solver.problem.integrator_parameters import integration_of
from catenary.solver.time_loop.views.channels import PANTOGRAPH, RUN

if TYPE_CHECKING:
    from catenary.meshgen.mesh import LineMesh
    from catenary.solver.problem.problem import Placement, Problem, Simulated

# Of each contact wire, in the order of the line.
WIRE = "contact wire"
# Bounds of what cannot be zero, and of everything.
_POSITIVE, _MOST = 1e-12, 1e15
NONE = float("nan")


class Fact(NamedTuple):
    """A fact.

    Attributes
    ----------
    unit : SI unit, "-" if none
    meaning : description in words
    per : ``RUN``, ``PANTOGRAPH`` or ``WIRE``
    low, high : bounds, inclusive
    may_be_nan : whether NaN is a value, which then stands for "none"
    """

    unit: str
    meaning: str
    per: str = RUN
    low: float = 0.0
    high: float = _MOST
    may_be_nan: bool = False


FACTS: dict[str, Fact] = {
    "time_step": Fact("s", "time between two records", low=_POSITIVE, high=1e3),
    "shortest_step": Fact("s", "shortest step that the run may take", low=1e-15, high=1e3),
    "step_tolerance": Fact(
        "N",
        "error of a contact force accepted in a step, NaN where steps are not adapted",
        may_be_nan=True,
    ),
    "fixed_iterations": Fact(
        "-",
        "iterations of every step of the fixed-point scheme, NaN where it iterates to tolerances",
        may_be_nan=True,
    ),
    "newmark_beta": Fact("-", "Newmark's beta of the line's integrator"),
    "newmark_gamma": Fact("-", "Newmark's gamma of the line's integrator"),
    "mass_weight": Fact(
        "-",
        "weight of a step's start in the inertia forces (alpha_m of generalized alpha)",
        low=-1.0,
        high=1.0,
    ),
    "force_weight": Fact(
        "-", "weight of a step's start in all other forces (alpha_f of generalized alpha)", high=1.0
    ),
    "speed": Fact("m/s", "speed of the train", low=_POSITIVE, high=1e4),
    "wave_speed": Fact(
        "m/s",
        "speed of the contact wire's slowest wave at the start, that of a string unless supports "
        "and bending stiffness carry it; of several the smallest",
        low=_POSITIVE,
        high=1e6,
    ),
    "contact_wire_tension": Fact("N", "tension of a contact wire at the start", per=WIRE, low=1e-6),
    "contact_wire_mass": Fact("kg/m", "mass per length of a contact wire", per=WIRE, low=1e-9),
    "contact_wire_bending_stiffness": Fact("N m2", "bending stiffness of a contact wire", per=WIRE),
    "contact_wire_axial_stiffness": Fact(
        "N", "axial stiffness of a contact wire, NaN if it is not known", per=WIRE, may_be_nan=True
    ),
    "contact_wire_lost_section": Fact(
        "-",
        "largest share of its section that a contact wire has lost by wear in the evaluation "
        "stretch",
        per=WIRE,
        high=1.0,
    ),
    "contact_wire_stiffness_damping": Fact(
        "s", "alpha of a contact wire's proportional damping C = alpha K + beta M", per=WIRE
    ),
    "contact_wire_mass_damping": Fact(
        "1/s", "beta of a contact wire's proportional damping C = alpha K + beta M", per=WIRE
    ),
    "longest_element": Fact(
        "m",
        "length of the longest element of a contact wire in the evaluation stretch, of the "
        "shortest one if the wire is not there",
        per=WIRE,
        low=_POSITIVE,
        high=1e9,
    ),
    "stiffest_dropper": Fact("N/m", "largest stiffness of a dropper"),
    "dropper_stiffness_damping": Fact(
        "s", "alpha of the droppers' proportional damping C = alpha K + beta M"
    ),
    "added_dropper_damping": Fact(
        "s", "the part of that alpha which is numerical damping of droppers stiff for the step"
    ),
    "slack_stiffness_share": Fact(
        "-",
        "share of its stiffness that a pushed dropper keeps, 1 where droppers do not slacken",
        high=1.0,
    ),
    "periodic_start": Fact(
        "-", "1 where the line goes on periodically beyond its start, 0 where not", high=1.0
    ),
    "periodic_end": Fact("-", "the same of its end", high=1.0),
    "strongest_gust": Fact(
        "-",
        "gust that is hardly exceeded, over the mean wind, where drag is linearised about that; "
        "NaN without such gusts",
        may_be_nan=True,
    ),
    "static_force": Fact("N", "static force of a pantograph", per=PANTOGRAPH),
    "actuator_force": Fact(
        "N",
        "constant force of the actuator of a multibody pantograph at its static force, NaN for "
        "others",
        per=PANTOGRAPH,
        low=-_MOST,
        may_be_nan=True,
    ),
    "touching_mass": Fact(
        "kg",
        "mass that one contact meets first: a strip on its suspension, or its share of the head",
        per=PANTOGRAPH,
        low=1e-9,
    ),
    "strip_half_length": Fact(
        "m",
        "half length of the strips of a pantograph, NaN if it is not known",
        per=PANTOGRAPH,
        may_be_nan=True,
    ),
    "contact_stiffness": Fact(
        "N/m",
        "stiffness of the contact, of a law that is not linear its tangent at the static force; "
        "infinite where head and wire cannot part",
        per=PANTOGRAPH,
        high=math.inf,
    ),
}


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

    laws = simulated(problem)
    of_run = _of_run(problem, laws)
    of_run["stiffest_dropper"] = _stiffest_dropper(problem, mesh, dropper_length)
    wires = [_of_wire(wire, problem, laws, mesh) for wire in problem.line.wires_of(Role.CONTACT)]
    train = [_of_pantograph(place, problem.contact) for place in problem.train.placements]
    found = {}
    for name, fact in FACTS.items():
        each = {RUN: None, WIRE: wires, PANTOGRAPH: train}[fact.per]
        value = of_run[name] if each is None else [one[name] for one in each]
        found[name] = np.array(value, dtype=float)
    return found


def _of_run(problem: Problem, laws: Simulated) -> dict[str, float | None]:
    """Facts of the run as a whole, None where there is none."""
    from catenary.meshgen.slowest_wave import slowest_wave

    numerics, groups = problem.numerics, [group.name for group in problem.line.droppers]
    scheme = integration_of(
        numerics.integrator, numerics.spectral_radius, numerics.beta, numerics.gamma
    )
    return {
        "time_step": numerics.dt,
        "shortest_step": _shortest_step(problem),
        "step_tolerance": numerics.adaptive_tolerance,
        "fixed_iterations": numerics.iterations,
        "newmark_beta": scheme.beta,
        "newmark_gamma": scheme.gamma,
        "mass_weight": scheme.mass_weight,
        "force_weight": scheme.force_weight,
        "speed": problem.train.speed,
        "wave_speed": slowest_wave(problem.line),
        "dropper_stiffness_damping": max((_damping(laws, own)[0] for own in groups), default=0.0),
        "added_dropper_damping": max((laws.added_alpha.get(n, 0.0) for n in groups), default=0.0),
        "slack_stiffness_share": laws.kept_ratio,
        "periodic_start": isinstance(problem.ends[0], Periodic),
        "periodic_end": isinstance(problem.ends[1], Periodic),
        "strongest_gust": _strongest_gust(laws),
    }


def _of_wire(
    wire: Wire, problem: Problem, laws: Simulated, mesh: LineMesh
) -> dict[str, float | None]:
    """Facts of a contact wire; those of a stretch are of the evaluated one."""
    start, end = problem.evaluation
    first, second = (mesh.x(ends) for ends in mesh.elements(wire.name).T)
    lengths = (second - first)[(second > start) & (first < end)]
    lost = (share for begin, stop, share in wire.worn if stop > start and begin < end)
    alpha, beta = _damping(laws, wire.name)
    return {
        "contact_wire_tension": wire.tension,
        "contact_wire_mass": wire.mass_per_length,
        "contact_wire_bending_stiffness": wire.bending_stiffness,
        "contact_wire_axial_stiffness": wire.axial_stiffness,
        "contact_wire_lost_section": max(lost, default=0.0),
        "contact_wire_stiffness_damping": alpha,
        "contact_wire_mass_damping": beta,
        "longest_element": lengths.max(initial=(second - first).min()),
    }


def _of_pantograph(place: Placement, contact: ContactLaw) -> dict[str, float | None]:
    from catenary.mbs.build import actuator_force, touching_mass

    half = place.data.strips.half_length
    return {
        "static_force": place.static_force,
        "actuator_force": actuator_force(place.data),
        "touching_mass": touching_mass(place.data),
        "strip_half_length": half if math.isfinite(half) else None,
        "contact_stiffness": _stiffness_under(contact, place.static_force),
    }


def _shortest_step(problem: Problem) -> float:
    from catenary.solver.problem.problem import n_halvings

    numerics = problem.numerics
    if not numerics.adaptive_tolerance:
        return numerics.dt
    return float(numerics.dt / 2 ** n_halvings(numerics.dt, numerics.smallest_dt))


def _damping(laws: Simulated, component: str) -> tuple[float, float]:
    own = laws.damping
    return own.per_component.get(component, (own.alpha, own.beta))


def _stiffest_dropper(problem: Problem, mesh: LineMesh, dropper_length: np.ndarray) -> float:
    stiffest = 0.0
    for number, group in enumerate(problem.line.droppers):
        length = dropper_length[mesh.dropper_group == number]
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


def _strongest_gust(laws: Simulated) -> float | None:
    """Strongest gust over the mean wind, if drag of gusts is linearised about that; else None."""
    from catenary.solver.wind import PEAK

    wind = laws.wind
    if wind is None or wind.gusts is None or wind.quadratic:
        return None
    return PEAK * wind.intensity
