"""Effects in the vertical plane: wires, what hangs and holds them, hardware, incidents.

One-sided links that are stiff for the time step have numerical damping.

Average acceleration reflects the force of a spring with omega dt >> 1 from step to step (its
amplification factor goes to -1) and does the work (T_n + T_n+1) / 2 times the stretch of a step. A
link that slackens from a stretch a to a gap b thereby returns k a (a + b) / 2, though only
k a^2 / 2 was stored, and a stiff link switches in every other step: the line gains energy. A damper
alpha k in the link makes the factor (2 alpha - dt) / (2 alpha + dt): with alpha = dt it is 1/3, and
a link that slackens returns less than it stored (docs/theory/droppers.md).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.wires import Profile
from catenary.solver.effects.effect import Effect, Limit
from catenary.solver.model.link_directions import at_nodes, at_places
from catenary.solver.model.links import PULLS, law
from catenary.solver.model.unknowns import UPRIGHT
from catenary.solver.problem.contact_laws import KinematicLaw
from catenary.solver.problem.defects import DropperBreak, LineIncident, TensionLoss
from catenary.solver.problem.problem import (
    Damping,
    Problem,
    Simulated,
    TargetHeight,
    slowest_wave_speed,
)
from catenary.solver.problem.watched_links import UPLIFT_STOPS

if TYPE_CHECKING:
    from catenary.meshgen.line import SteadyArms
    from catenary.solver.model.builder import ModelBuilder

# Lift that no wire gets to [m].
_OUT_OF_REACH = 1e3
NAME = "stiff_link_damping"
# A link is stiff from k dt^2 = 4 kappa m on, with some 0.25 kg of wire that move with its ends
# within a step: kappa = 0.2. Undamped lines gained energy at 0.25, over 4 km (docs/hard_cases.md).
STIFF = 0.22  # k dt^2 [N s2/m]
# Length of droppers whose stiffness goes with it and which are not cut yet, a short one [m].
_SHORT = 0.3


def pre_sag(wanted: Profile, x: np.ndarray) -> np.ndarray:
    """Minus the pre-sag at positions ``x``, shape as ``x`` [m]."""
    return -wanted.pre_sag(x)


def transition(wanted: Profile, x: np.ndarray) -> np.ndarray:
    """Rise towards the tensioners in the transition spans, shape as ``x`` [m]."""
    return np.asarray(wanted.level(x) - wanted.base(x))


def _vertical(builder: ModelBuilder) -> None:
    for wire in reversed(builder.problem.line.wires):
        builder.add_wire(wire.name)
    builder.add_droppers()
    for supports, nodes in builder.model.supports_by_group():
        builder.add_springs(supports.name, nodes, "w", supports.stiffness)
    builder.add_clamps("w")
    builder.hold(builder.held_ends, "w")


def _dropper_mass(builder: ModelBuilder) -> None:
    model = builder.model
    for droppers, mine in model.droppers_by_group():
        half = 0.5 * droppers.kind.mass_per_length * model.cut_lengths[mine]
        half[model.missing[mine]] = 0.0
        for side in (0, 1):
            builder.add_masses(droppers.name, model.mesh.droppers[mine, side], half)


def _clamp_mass(builder: ModelBuilder) -> None:
    model = builder.model
    for droppers, mine in model.droppers_by_group():
        upper, lower = model.mesh.droppers[mine].T
        there = 1.0 - model.missing[mine]
        builder.add_masses(droppers.upper, upper, droppers.kind.upper_clamp_mass * there)
        builder.add_masses(droppers.lower, lower, droppers.kind.lower_clamp_mass * there)
    for clamps, pairs in model.clamps_by_group():
        for name, side in ((clamps.upper, 0), (clamps.lower, 1)):
            builder.add_masses(name, pairs[:, side], 0.5 * clamps.mass)


def _arm_inertia(builder: ModelBuilder) -> None:
    model = builder.model
    for arms, mine in model.arms_by_group():
        nodes, clamp = model.mesh.steady_arms[mine], arms.kind.clamp_mass
        rod = arms.kind.mass_per_length * arms.kind.length
        # A rod hinged at its far end: a third of its mass moves with the wire, half of it hangs.
        builder.add_masses(arms.name, nodes, rod / 3 + clamp, hanging_mass=rod / 2 + clamp)
        model.hanging_at_arms[mine] = rod / 2 + clamp


def _arm_stiffness(builder: ModelBuilder) -> None:
    model = builder.model
    for arms, mine in model.arms_by_group():
        if arms.kind.length > 0.0 and model.simulated.lateral:
            continue  # a bar, whose stiffness follows from its radial force
        stiffness = arms.vertical_stiffness(builder.problem.line.wire(arms.wire))
        builder.add_springs(arms.name, model.mesh.steady_arms[mine], "w", stiffness)


def _is_bar(problem: Problem, arms: SteadyArms) -> bool:
    """Whether arms are bars, whose stiffness follows from their radial force."""
    return arms.kind.length > 0.0 and "lateral_motion" in problem.effects


def _bars_instead(problem: Problem) -> str:
    """The stiffness that arms have in a scene, and do not as bars."""
    found = {
        arms.name: arms.kind.stiffness
        for arms in problem.line.steady_arms
        if arms.kind.stiffness > 0.0 and _is_bar(problem, arms)
    }
    given = ", ".join(f"of {name} {stiffness:g} N/m" for name, stiffness in found.items())
    radial = [
        arms.name
        for arms in problem.line.steady_arms
        if arms.kind.by_radial_force and _is_bar(problem, arms)
    ]
    if radial and not found:
        return f"{', '.join(radial)} have it as bars, which lateral motion makes of them"
    return (
        f"{given} are not used: with lateral motion they are bars, whose stiffness follows from "
        "their radial force"
        if found
        else ""
    )


def _shaped(laws: Simulated, by: TargetHeight) -> Simulated:
    return replace(laws, target_heights=(*laws.target_heights, by))


def _residual_stiffness(laws: Simulated, problem: Problem) -> Simulated:
    return replace(laws, kept_ratio=problem.residual_stiffness_ratio) if laws.slackening else laws


def _happening(laws: Simulated, problem: Problem, kind: type[LineIncident]) -> Simulated:
    """The incidents of one more kind, in the problem's order."""
    chosen = [i for i in problem.incidents if isinstance(i, kind) or i in laws.incidents]
    return replace(laws, incidents=tuple(chosen))


VERTICAL = (
    Effect(
        "vertical",
        "vertical motion of the tensioned wires",
        "wire bending and tension, droppers, messenger supports, anchors",
        "paper eq. (2.1)",
        unknowns_of_wire=lambda wire: UPRIGHT,
        always=True,
        build=_vertical,
    ),
    Effect(
        "gravity",
        "gravity and form finding",
        "weights, static equilibrium, dropper pre-tension and lengths",
        "paper section 2; static equilibrium of a tensioned beam",
        law=lambda laws, p: replace(laws, gravity=p.gravity),
    ),
    Effect(
        "pre_sag",
        "pre-sag of the contact wire",
        "target heights of the form finding",
        "paper section 1 (pre-sag of 1/1000)",
        requires=("gravity",),
        applies=lambda p: any(any(wanted.sag) for wanted in p.line.profiles),
        law=lambda laws, p: _shaped(laws, pre_sag),
        data="line.dropper.pre_sag_mm or pre_sag_mid_mm other than 0",
    ),
    Effect(
        "transition_spans",
        "transition spans in which the contact wire rises to the tensioner",
        "target heights of the form finding at both ends",
        "paper section 5, figure 4",
        applies=lambda p: any(wanted.rises for wanted in p.line.profiles),
        law=lambda laws, p: _shaped(laws, transition),
        data="line.transition with a rise_m",
    ),
    Effect(
        "dropper_mass",
        "mass of the droppers",
        "half of each dropper's mass at either end",
        "paper Table 1",
        applies=lambda p: any(group.kind.mass_per_length > 0 for group in p.line.droppers),
        build=_dropper_mass,
        data="line.dropper.mass_kg_per_m above 0",
    ),
    Effect(
        "clamp_mass",
        "mass of clamps on the wires",
        "lumped masses at both ends of droppers and clamps",
        "paper section 2 and Table 1",
        applies=lambda p: (
            any(group.mass > 0 for group in p.line.clamps)
            or any(
                group.kind.upper_clamp_mass + group.kind.lower_clamp_mass > 0
                for group in p.line.droppers
            )
        ),
        build=_clamp_mass,
        data="clamps of some mass, such as line.dropper.contact_clamp_kg",
    ),
    Effect(
        "arm_inertia",
        "inertia and weight of the steady arms",
        "a third of the hinged arm's mass and its clamp on the contact wire",
        "paper Table 1; hinged rod",
        applies=lambda p: any(
            group.kind.clamp_mass + group.kind.mass_per_length * group.kind.length > 0
            for group in p.line.steady_arms
        ),
        build=_arm_inertia,
        data="line.steady_arm with a clamp_kg, or a length_m and mass_kg_per_m",
    ),
    Effect(
        "arm_stiffness",
        "vertical stiffness of the steady arms",
        "springs from the contact wire to the ground at the arms",
        "EN 50318:2002 reference model",
        applies=lambda p: any(
            bool(group.vertical_stiffness(p.line.wire(group.wire)).any()) and not _is_bar(p, group)
            for group in p.line.steady_arms
        ),
        instead=_bars_instead,
        build=_arm_stiffness,
        data="line.steady_arm.stiffness_N_per_m above 0, or stiffness_by_radial_force",
    ),
    Effect(
        "relative_motion",
        "motion of twin wires relative to each other",
        "unknowns of the second of two wires side by side, which has the first one's without it",
        "sum and difference of two like wires; docs/theory/line.md",
        applies=lambda p: bool(p.line.twins),
        law=lambda laws, p: replace(laws, relative_motion=True),
        data="two wires side by side (line.topology twin or twin_messenger)",
    ),
    Effect(
        "structural_damping",
        "structural damping of the line",
        "C = alpha K + beta M, globally or per component",
        "paper eq. (2.2)",
        applies=lambda p: (
            p.damping.alpha > 0
            or p.damping.beta > 0
            or any(any(pair) for pair in p.damping.per_component.values())
            or any(p.damping.lateral or ())
        ),
        law=lambda laws, p: replace(laws, damping=p.damping),
        data="line.damping with alpha_s or beta_per_s above 0",
    ),
    Effect(
        "dropper_slackening",
        "droppers that slacken",
        "compensation of the droppers that would be pushed",
        "paper eq. (2.7)",
        requires=("gravity",),
        applies=lambda p: bool(p.line.droppers),
        law=lambda laws, p: replace(laws, slackening=True, kept_ratio=0.0),
        data="droppers",
    ),
    Effect(
        "residual_dropper_stiffness",
        "residual stiffness of slack droppers",
        "a share of the stiffness is kept in compression",
        "paper section 2 (about 1/100)",
        default=False,
        requires=("dropper_slackening",),
        applies=lambda p: p.residual_stiffness_ratio > 0,
        law=_residual_stiffness,
        data="line.dropper.residual_stiffness_ratio above 0",
    ),
    Effect(
        "contact_loss",
        "loss and regain of contact",
        "the contact force cannot pull",
        "paper section 4",
        applies=lambda p: not isinstance(p.contact, KinematicLaw),
        law=lambda laws, p: replace(laws, contact_loss=True),
        data="contact.law other than kinematic",
    ),
    Effect(
        "contact_damping",
        "damping of the contact",
        "a force on the gap rate, its convective part V dw/dx included",
        "penalty contact with a viscous term, or hysteresis (paper eq. 4.1)",
        default=False,
        applies=lambda p: p.contact.dissipates,
        law=lambda laws, p: replace(laws, contact=p.contact),
        data="contact.damping_N_s_per_m above 0 or contact.restitution below 1",
    ),
    Effect(
        "several_pantographs",
        "several pantographs on one train",
        "one contact and one pantograph each",
        "paper section 5",
        applies=lambda p: len(p.train.placements) > 1,
        lifts=(Limit.ONE_PANTOGRAPH,),
        data="a second entry of train.pantographs",
    ),
    Effect(
        "head_roll",
        "roll of the pan heads under a wire that moves along their strips",
        "a roll of each head, on which the contact force acts with the stagger as its lever",
        "rigid head on two springs beside each other",
        default=False,
        applies=lambda p: any(place.data.roll is not None for place in p.train.placements),
        law=lambda laws, p: replace(laws, head_roll=True),
        data="a head that can roll (pantographs.*.roll) under a wire with line.stagger_m",
    ),
    Effect(
        "vehicle_motion",
        "motion of the vehicle under its pantographs",
        "height and lateral position of the pantographs' bases as functions of time and place",
        "given motion, or spectra of track irregularities (FRA; ORE B176)",
        default=False,
        applies=lambda p: p.train.vehicle is not None,
        law=lambda laws, p: replace(laws, vehicle=p.train.vehicle),
        data="a table [vehicle]",
    ),
    Effect(
        "dropper_break",
        "droppers that break during the run",
        "matrices without the dropper and the balance that it leaves, from its time on",
        "equation of motion of the line without it; [[incidents]]",
        applies=lambda p: any(isinstance(incident, DropperBreak) for incident in p.incidents),
        law=lambda laws, p: _happening(laws, p, DropperBreak),
        data="an entry of incidents of type dropper_break",
    ),
    Effect(
        "tension_loss",
        "wires that lose tension during the run",
        "matrices with what is left of the tension and the balance lost, from its time on",
        "equation of motion of the line with it; [[incidents]]",
        applies=lambda p: any(isinstance(incident, TensionLoss) for incident in p.incidents),
        law=lambda laws, p: _happening(laws, p, TensionLoss),
        data="an entry of incidents of type tension_loss",
    ),
    Effect(
        "lowering",
        "pantographs that are lowered during the run",
        "a static force that goes over to a lower one, and what catches the head",
        "the course of the raising, the other way; [[incidents]]",
        applies=lambda p: any(place.lowering is not None for place in p.train.placements),
        law=lambda laws, p: replace(laws, lowering=True),
        data="an entry of incidents of type lowering",
    ),
    Effect(
        "supercritical_speed",
        "train speed at or above the wave speed of the contact wire",
        "nothing: it lifts the check on the speed",
        "paper eq. (1.1)",
        default=False,
        applies=lambda p: p.train.speed >= slowest_wave_speed(p),
        lifts=(Limit.WAVE_SPEED,),
        data="a train.speed_km_h at or above the contact wire's wave speed",
    ),
)


def _fittings(builder: ModelBuilder) -> None:
    for fittings in builder.problem.line.fittings:
        place = at_places(builder.model, fittings.wire, np.array(fittings.x))
        builder.add_masses_at(fittings.wire, place, np.array(fittings.mass))


def _stops(builder: ModelBuilder) -> None:
    """Open links to the ground; an arm without a stop has one that it does not reach.

    Stops stay where they were installed, whatever has raised or lowered the wire since.
    """
    mesh, model = builder.mesh, builder.model
    gap, stiffness = np.full(mesh.steady_arms.size, _OUT_OF_REACH), np.ones(mesh.steady_arms.size)
    for arms, own in model.arms_by_group():
        if arms.kind.uplift_stop is not None:
            gap[own], stiffness[own] = arms.kind.uplift_stop, arms.kind.stop_stiffness
    if model.form is not None and model.form.arm_raised.size:
        gap -= model.form.arm_raised
        _refuse_pushed(builder, gap)
    laws = law(mesh.x(mesh.steady_arms), stiffness, acts=PULLS, gap=gap)
    builder.add_links(UPLIFT_STOPS, at_nodes(model, mesh.steady_arms), laws)


def _refuse_pushed(builder: ModelBuilder, gap: np.ndarray) -> None:
    """Refuse a line that rests on a stop: a wire that is higher than stops allow was hung wrong."""
    if (gap >= 0.0).all():
        return
    mesh, form = builder.mesh, builder.model.form
    assert form is not None
    worst = int(np.argmin(gap))
    arms = builder.problem.line.steady_arms[mesh.arm_group[worst]]
    raise InputError(
        f"line.steady_arm.uplift_stop_m is {arms.kind.uplift_stop:g} m, but the steady arm at "
        f"{mesh.x(mesh.steady_arms[worst]):g} m rests {form.arm_raised[worst]:.3f} m above its "
        "place at the installation: take a larger one, or less of what raises the wire "
        "(defects, irregularities, temperature, wind)"
    )


HARDWARE = (
    Effect(
        "uplift_stops",
        "stops that end the uplift at steady arms",
        "a link for each arm that pushes its wire down beyond a lift",
        "linear complementarity with a gap, one way",
        data="line.steady_arm.uplift_stop_m",
        applies=lambda p: any(arms.kind.uplift_stop is not None for arms in p.line.steady_arms),
        build=_stops,
        components=(UPLIFT_STOPS,),
        law=lambda laws, p: replace(laws, uplift_stops=True),
    ),
    Effect(
        "fittings",
        "section insulators and other fittings on the wires",
        "lumped masses at places of wires, for which droppers are cut; [[line.fittings]]",
        "consistent mass and weight at the place within its element",
        data="line.fittings",
        applies=lambda p: bool(p.line.fittings),
        build=_fittings,
    ),
)


def _one_sided(problem: Problem) -> Iterator[tuple[str, float]]:
    """Components whose links act one way, and the largest stiffness of each [N/m]."""
    line = problem.line
    if "dropper_slackening" in problem.effects:
        for group in line.droppers:
            yield group.name, group.kind.stiffest_at(_SHORT)
    if "uplift_stops" in problem.effects:
        kinds = [arms.kind for arms in line.steady_arms if arms.kind.uplift_stop is not None]
        if kinds:
            yield UPLIFT_STOPS, max(kind.stop_stiffness for kind in kinds)


def _given(problem: Problem) -> Damping:
    return problem.damping if "structural_damping" in problem.effects else Damping(0.0, 0.0)


def _added(problem: Problem) -> dict[str, float]:
    """Alpha [s] by component that its links lack to have dt."""
    given, dt = _given(problem), problem.numerics.dt
    found = {}
    for name, stiffness in _one_sided(problem):
        alpha, _ = given.per_component.get(name, (given.alpha, given.beta))
        if stiffness * dt**2 > STIFF and alpha < dt:
            found[name] = dt - alpha
    return found


def _damped(laws: Simulated, problem: Problem) -> Simulated:
    own, added = laws.damping, _added(problem)
    pairs = dict(own.per_component)
    for name, more in added.items():
        alpha, beta = pairs.get(name, (own.alpha, own.beta))
        pairs[name] = alpha + more, beta
    return replace(laws, damping=replace(own, per_component=pairs), added_alpha=added)


STIFF_LINKS = Effect(
    NAME,
    "numerical damping of droppers and stops that are stiff for the time step",
    "a damper alpha k in each link that acts one way, with alpha = dt",
    "amplification factor of average acceleration for omega dt >> 1; docs/theory/droppers.md",
    applies=lambda p: bool(_added(p)),
    law=_damped,
    data="droppers that slacken, or stops, with k dt^2 above 0.22 N s2/m and less damping",
)
