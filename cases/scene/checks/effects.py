"""Whether effects exist and have what they need, twins move as one, and keys have a reader."""

from __future__ import annotations

import difflib
import functools
from collections.abc import Iterator, Mapping

from catenary.cases.scene.input.faults import Fault, shown
from catenary.cases.scene.keys.table import take_away
from catenary.cases.scene.line.hardware import FEWEST_SAGGING, DropperTable, SteadyArmTable
from catenary.cases.scene.line.line_data import tables_of
from catenary.cases.scene.scene import Scene, problem_of
from catenary.meshgen.line import Line
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import LineData
from catenary.postproc.evaluate.wording import counted
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.effect import Limit
from catenary.solver.problem.contact_laws import KinematicLaw
from catenary.solver.problem.problem import Damping, Problem

_RESIDUAL = "residual_dropper_stiffness"


def check_effect_names(scene: Scene) -> Iterator[Fault]:
    """Unknown effects, and what is always simulated but switched off."""
    known = effects.registry()
    for name, on in scene.effects.items():
        key = f"effects.{name}"
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f"did you mean effects.{near[0]}?" if near else f"known are {', '.join(known)}"
            yield Fault(key, f"{shown(key)[1:-1]} {scene.origin.of(key)} is unknown; {hint}")
        elif known[name].always and not on:
            yield scene.refused(key, "it is part of every scene and cannot be left out")


def check_requirements_of_chosen(scene: Scene) -> Iterator[Fault]:
    """Effects that the scene switches on without the effects that they require."""
    switches = scene.switches()
    for name in scene.effects:
        yield from _requirements(scene, switches, name, "on", f"effects.{name}")


def check_chosen_act(scene: Scene) -> Iterator[Fault]:
    """Effects that the scene switches on without anything for them to act on.

    One that lifts a limit is a permission, of which a scene need not make use. In a calm, such as
    a variant of a sweep, effects of the wind may stay on.
    """
    if scene.origin.recorded:
        return
    problem = functools.cache(lambda: problem_of(scene))
    calmed = _calmed(scene)
    for name, on in scene.effects.items():
        effect = effects.registry()[name]
        needs = on and effect.data and not effect.lifts and name not in calmed
        if needs and not effect.applies(problem()):
            lacking = f"it acts only with {effect.data}; give that, or leave the effect out"
            yield scene.refused(f"effects.{name}", effect.instead(problem()) or lacking)


def _calmed(scene: Scene) -> set[str]:
    """Effects whose tables are there, but have nothing to do in a calm."""
    wind = scene.wind
    if wind is None or wind.speed_m_per_s > 0.0:
        return set()
    return {"wind"} if wind.gusts is None else {"wind", "gusts"}


def check_requirements_of_defaults(scene: Scene) -> Iterator[Fault]:
    """Check requirements of effects that are on by default and find something to act on."""
    problem, switches = functools.cache(lambda: problem_of(scene)), scene.switches()
    for name, effect in effects.registry().items():
        if name in scene.effects:
            continue
        for fault in _requirements(scene, switches, name, "on by default", ""):
            if effect.applies(problem()):
                yield fault


def _requirements(
    scene: Scene, switches: Mapping[str, bool], name: str, how: str, key: str
) -> Iterator[Fault]:
    for required in effects.registry()[name].requires if switches.get(name) else ():
        if not switches[required]:
            at = key or f"effects.{required}"
            yield Fault(
                at,
                f"effects.{name} is {how} and requires effects.{required}, which is off "
                f"{scene.origin.of(at)}; switch both on or both off",
            )


def check_effect_data(scene: Scene) -> Iterator[Fault]:
    """Effects without the value that they need, and values without their effect."""
    # A line has one ratio for all droppers, as another check sees to.
    name, on = _RESIDUAL, scene.switches()[_RESIDUAL]
    key, hung = next(iter(tables_of(scene.line, DropperTable).items()), ("", None))
    if hung is None:
        if on:
            yield scene.refused(f"effects.{name}", "the line has no droppers")
    elif on and not hung.residual_stiffness_ratio:
        why = f"effects.{name} is on and needs a value greater than 0"
        yield scene.refused(f"{key}.residual_stiffness_ratio", why)
    elif hung.residual_stiffness_ratio:
        yield from scene.needs_effect(name, f"{key}.residual_stiffness_ratio")
    n = len(scene.train.pantographs)
    if n > 1 and scene.holds(Limit.ONE_PANTOGRAPH):
        key = "effects.several_pantographs"
        yield scene.refused(key, f"train.pantographs has {n} entries; leave one or switch it on")


def check_idle(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Masses of arms and clamps, lateral positions of clamped wires, errors of droppers and further
    overlaps of which there are none.

    Of an effect that the scene writes as false data may stand there.
    """
    if scene.origin.recorded:
        return
    yield from _idle_arms(scene)
    yield from _idle_clamps(scene)
    yield from _lateral_places(scene)
    yield from _places_of_free_lines(scene)
    yield from _dropper_lengths(scene, line)
    yield from _random(scene)
    yield from _sagging(scene)
    yield from _further_overlaps(scene, line)


def _idle_arms(scene: Scene) -> Iterator[Fault]:
    for key, arm in tables_of(scene.line, SteadyArmTable).items():
        if arm.mass_kg_per_m and not arm.length_m and scene.effects.get("arm_inertia") is not False:
            why = f"an arm of length 0 has no mass by it: give {key}.length_m, or clamp_kg alone"
            yield scene.refused(f"{key}.mass_kg_per_m", why + take_away())


def _idle_clamps(scene: Scene) -> Iterator[Fault]:
    """Clamps at the ends of free wires that none has."""
    wires = scene.line.wires or []
    names = {wire.name for wire in wires}
    for i, wire in enumerate(wires):
        if {wire.start, wire.end} & names:
            continue
        for name in ("clamp_kg", "clamp_stiffness_N_per_m"):
            if name in wire.model_fields_set:
                why = (
                    f"{wire.name} has no clamp: neither start nor end names a wire to which it is "
                    f"clamped{take_away()}"
                )
                yield scene.refused(f"line.wires.{i}.{name}", why)


def _lateral_places(scene: Scene) -> Iterator[Fault]:
    """Lateral positions of free wires that lie where the wires do to which they are clamped."""
    wires = scene.line.wires or []
    names = {wire.name for wire in wires}
    links = scene.line.links or []
    held = {link.wire for link in links if link.type in ("supports", "steady_arms")}
    for i, wire in enumerate(wires):
        n_clamped = len([end for end in (wire.start, wire.end) if end in names])
        if n_clamped == 2 and wire.name not in held:
            idle = ["stagger_m", "sideways_m"]
            why = (
                f"nothing holds {wire.name} sideways but the wires to which both of its ends are "
                "clamped"
            )
        elif (
            n_clamped and wire.role != "contact" and (wire.stagger_m, wire.course_m) == (None,) * 2
        ):
            idle = ["sideways_m"]
            why = (
                f"without stagger_m or course_m {wire.name} has the lateral position of the wire "
                "to which it is clamped"
            )
        else:
            continue
        for name in set(idle) & wire.model_fields_set:
            yield scene.refused(f"line.wires.{i}.{name}", why + take_away())


def _places_of_free_lines(scene: Scene) -> Iterator[Fault]:
    """Heights and staggers of a whole free line whose wires all have their own."""
    wires = scene.line.wires or []
    names = {wire.name for wire in wires}
    placed = [wire for wire in wires if wire.course_m is None]
    contact = [wire for wire in placed if wire.role == "contact"]
    others = [wire for wire in placed if wire not in contact and not {wire.start, wire.end} & names]
    reads = {
        "contact_height_m": any(wire.height_m is None for wire in contact),
        "stagger_m": any(wire.stagger_m is None for wire in contact),
        "messenger_stagger_m": any(wire.stagger_m is None for wire in others),
    }
    for name, read in reads.items():
        if wires and not read and name in scene.line.model_fields_set:
            own = name.removeprefix("contact_").removeprefix("messenger_")
            which = "other" if name == "messenger_stagger_m" else "contact"
            why = f"nothing reads it: {which} wires have places of their own ({own} or course_m)"
            yield scene.refused(f"line.{name}", why + take_away())


def _dropper_lengths(scene: Scene, line: LineData) -> Iterator[Fault]:
    name = "dropper_lengths"
    given = scene.irregularities.dropper_lengths is not None
    if given and scene.effects.get(name) is not False and not make_line(line).droppers:
        why = "changes nothing: the line has no droppers; leave it out, or write"
        yield scene.fault(f"irregularities.{name}", f"{why} effects.{name} = false")


def _sagging(scene: Scene) -> Iterator[Fault]:
    """A sag at mid-span of droppers between a first and a last one, where there are none."""
    for key, table in tables_of(scene.line, DropperTable).items():
        if table.count is not None:
            most = table.count
        else:
            each = [len(pattern.positions_m) for pattern in table.patterns or ()]
            most = max([len(table.positions_m or ()), *each])
        if table.pre_sag_mid_mm and most < FEWEST_SAGGING and scene.effects.get("pre_sag", True):
            why = (
                "it is that of droppers between the first and the last one of a span, of which "
                f"there is none: spans have {counted(most, 'dropper')}"
            )
            at = f"{key}.pre_sag_mid_mm"
            yield scene.refused(at, why + take_away())


# Keys of random irregularities.
_DRAWN = ("exponent", "shortest_m", "longest_m", "cut_off", "seed")


def _random(scene: Scene) -> Iterator[Fault]:
    """Faults of keys of random irregularities in a table without randomness."""
    for name in scene.irregularities.given:
        table = getattr(scene.irregularities, name)
        for part in _DRAWN if not table.standard_deviation_mm else ():
            if part in table.model_fields_set:
                key = f"irregularities.{name}.{part}"
                why = f"nothing is random without irregularities.{name}.standard_deviation_mm"
                yield scene.refused(key, why + take_away())


def _further_overlaps(scene: Scene, line: LineData) -> Iterator[Fault]:
    table = scene.line.overlap
    if table is None or line.overlaps is None or table.repeat_every_spans is None:
        return
    if len(line.overlaps.first) == len(table.first_span):
        next_one = table.first_span[-1] + table.repeat_every_spans
        last = line.n_spans - line.n_transition[1] - table.n_spans
        why = (
            f"it adds no overlap: the next one would begin in span {next_one}, and the last in "
            f"which one may begin is {last}"
        )
        key = "line.overlap.repeat_every_spans"
        yield scene.refused(key, why + take_away())


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


def check_damped(scene: Scene) -> Iterator[Fault]:
    """Damping of components that neither the line has nor an effect adds."""
    given = scene.line.damping.per_component
    if not given:
        return
    problem = problem_of(scene)
    added = (name for effect in effects.active(problem) for name in effect.components)
    known = (*problem.line.components, *added)
    for name in given:
        key = f"line.damping.per_component.{name}"
        yield from scene.among(key, known, "the line has", name=name)


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
