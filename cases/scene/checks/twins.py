"""Whether twin wires whose relative motion is left out would move as one."""

from __future__ import annotations

from collections.abc import Iterator

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.meshgen.line import Line
from catenary.solver.effects import all_effects as effects
from catenary.solver.problem.contact_laws import KinematicLaw
from catenary.solver.problem.problem import Damping, Problem

RELATIVE_MOTION = "relative_motion"
# Effects that treat both wires of a pair alike, whatever their data.
_ALIKE = frozenset(
    {
        "vertical",
        "gravity",
        "pre_sag",
        RELATIVE_MOTION,
        "transition_spans",
        "dropper_mass",
        "clamp_mass",
        "arm_inertia",
        "arm_stiffness",
        "uplift_stops",
        "structural_damping",
        "dropper_slackening",
        "stiff_link_damping",
        "residual_dropper_stiffness",
        "contact_loss",
        "contact_damping",
        "several_pantographs",
        "pantograph_aerodynamics",
        "pantograph_laws",
        "regulated_lift",
        "lowering",
        "vehicle_motion",
        "vehicle_suspension",
        "absorbing_layers",
        "periodic_ends",
        "supercritical_speed",
    }
)


def needs_relative_motion(problem: Problem, effect: str) -> bool:
    """Whether a problem has twin wires that move as one, and an effect may move them apart."""
    return effect not in _ALIKE and bool(effects.move_together(problem))


def check_twins(scene: Scene) -> Iterator[Fault]:
    """Scenes without the relative motion of twin wires in which they would move differently."""
    if scene.switches()[RELATIVE_MOTION]:
        return
    problem = problem_of(scene)
    why = _why_not(problem) if problem.line.twins else ""
    if why:
        yield scene.refused(f"effects.{RELATIVE_MOTION}", why)


def _why_not(problem: Problem) -> str:
    """The part that moves twin wires relative to each other, "" if none does."""
    line = problem.line
    if not _hang_alike(line):
        return (
            "droppers hang the two wires by turns, so that they move relative to each other; take "
            "line.twin.droppers = pairs, or switch this on"
        )
    for effect in effects.active(problem):
        if needs_relative_motion(problem, effect.name):
            return (
                f"effects.{effect.name} is simulated, which may move the two wires relative to "
                "each other; switch that off, or this on"
            )
    for one, other in _pairs(line):
        if _damping(problem.damping, one) != _damping(problem.damping, other):
            return (
                f"{one} and {other} have different damping (line.damping.per_component), so that "
                "the two wires move relative to each other; give them the same, or switch this on"
            )
    if isinstance(problem.contact, KinematicLaw):
        return (
            "with contact.law kinematic nothing but their relative motion says how the two wires "
            "share the contact force; take another law, or switch this on"
        )
    return ""


def _hang_alike(line: Line) -> bool:
    """Whether droppers of both wires of each pair hang at the same places."""
    places = {group.lower: group.lower_x for group in line.droppers}
    return all(places.get(one) == places.get(other) for one, other in line.twins)


def _pairs(line: Line) -> Iterator[tuple[str, str]]:
    """Names of both wires of each pair, and of what hangs them and stands under them."""
    yield from line.twins
    hung = {group.lower: group.name for group in line.droppers}
    for one, other in line.twins:
        if one in hung:
            yield hung[one], hung[other]
        for groups in (line.steady_arms, line.supports):
            names = {group.wire: group.name for group in groups}
            if one in names:
                yield names[one], names[other]


def _damping(damping: Damping, name: str) -> tuple[float, float]:
    return damping.per_component.get(name, (damping.alpha, damping.beta))
