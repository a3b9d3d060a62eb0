"""Form finding: the line at rest under its own weight, in the wanted profiles, in both planes.

Wires are linear in their loads. At each dropper the lower wire's height is wanted and the dropper's
force unknown: one sparse system over the nodes of all wires in the order along the track, in which
a height that is given has its force as unknown. Any number of wires may hang below each other.

In the lateral plane there are stagger, curve and cant, and what droppers pull sideways. A dropper
that leans pulls its wires sideways by its vertical force times its lateral over its vertical span.
Both of these are those of the vertical plane, in which it does not matter how it leans: laterally
wires are then linear, and one sparse system gives their course.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.line import Line, SteadyArms
from catenary.meshgen.mesh import LineMesh, reduced, with_nodes_at
from catenary.meshgen.wires import SAME_PLACE, Wire
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import build, rebuilt
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium, LateralShape
from catenary.solver.model.unknowns import LEVEL, UPRIGHT
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.plane_at_rest import (
    Followed,
    Part,
    PlaneAtRest,
    clamp_parts,
    springs_between,
    wire_parts,
)
from catenary.solver.statics.potential import curve_load, dead_loads, exact_moments
from catenary.solver.statics.repeated_ends import repeated_ends
from catenary.solver.statics.rest_nearby import StiffLine, errors_of_length, hang

# Lengths are printed to a tenth of a millimetre; the iteration contracts by the ratio of dropper
# weight to tension sag, about 1e-3, so that this costs one more pass and leaves no trace in forces.
_LENGTH_TOLERANCE = 1e-10
# Round-off of a dropper's force in terms of stiffness times height of the elements beside it.
_ROUND_OFF = 100.0 * float(np.finfo(float).eps)
_MAX_PASSES = 30
# Tolerance of the lift of steady arms, which the lateral plane gives, over the largest tension:
# some ten times what round-off leaves of vertical forces on lines of 20 kN.
_FORCE_TOLERANCE = 2e-11
# An arm that hangs freely carries its weight up to this inclination, the wire what is beyond [rad].
STEEPEST = np.deg2rad(20.0)
# Arms that hold their wire's height stand no steeper [rad].
_UPRIGHT = np.deg2rad(60.0)


def find_form(
    problem: Problem,
    mesh: LineMesh,
    sound: tuple[Model, Equilibrium, StiffLine] | None = None,
) -> tuple[Model, Equilibrium]:
    """The model of a line and its equilibrium under its own weight. Not collective.

    Droppers are cut for the sound line, or for irregular heights of the contact wire; with all that
    is wrong besides the line then hangs on them. ``problem`` of the model has the wires that hang.

    Parameters
    ----------
    problem : Problem
        Problem of the run.
    mesh : LineMesh
        Mesh of the line.
    sound : tuple, optional
        Result of ``sound_form`` for a problem that differs in errors of length alone, and the
        stiffness of its model.

    Raises
    ------
    InputError
        If a dropper of the sound line would be slack at rest or would have no length, or if lengths
        do not settle.
    """
    if not effects.after_cutting(problem):
        return about(*_cut(problem, mesh))
    return hang(effects.with_defects(problem), *(sound or sound_form(problem, mesh)))


def sound_form(problem: Problem, mesh: LineMesh) -> tuple[Model, Equilibrium]:
    """The line for which droppers are cut, before it hangs on them with all that is wrong. Not
    collective; raises as ``find_form``."""
    sound = _cut(effects.as_cut(problem), mesh)
    if _cut_for(problem):
        sound = _cut(_as_installed(problem), mesh, pushing=True)
    return about(*sound)


def lengths_to_cut(problem: Problem, mesh: LineMesh) -> np.ndarray:
    """Unstretched lengths to which droppers are cut, (n_droppers,) [m]. Not collective.

    They hold for any mesh: wires bend within sqrt(EI / T), some 0.1 m, of what holds them, which
    elements of a mesh do not resolve. Here elements go from one dropper, clamp, fitting or support
    to the next and are exact. A line of ``find_form`` has lengths of its own, for it to be balanced
    on its mesh.
    """
    places = [problem.line.support_positions]
    for fittings in problem.line.fittings:
        places.append(np.array(fittings.x))
        mesh = with_nodes_at(mesh, fittings.wire, places[-1], SAME_PLACE)
    joints = reduced(mesh, np.concatenate(places), SAME_PLACE)
    cut, form = _cut(_as_installed(problem), joints, pushing=True, exact=True)
    return form.dropper_length + errors_of_length(problem, cut)


def _cut_for(problem: Problem) -> set[str]:
    """Effects after cutting whose heights droppers are cut for, by name."""
    return {effect.name for effect in effects.after_cutting(problem) if effect.cut_for}


def _as_installed(problem: Problem) -> Problem:
    """The problem of the line for which droppers are cut, with irregular heights."""
    return effects.as_cut(problem, but=_cut_for(problem))


def _cut(
    problem: Problem, mesh: LineMesh, pushing: bool = False, exact: bool = False
) -> tuple[Model, Equilibrium]:
    """The line for which droppers are cut.

    Each wire hangs by itself here, also one that moves with another.

    With ``pushing`` droppers may push. With ``exact`` wires bend as tensioned beams do, else by
    Hermite's functions as in motion.
    """
    length = mesh.points[mesh.droppers[:, 0], 2] - mesh.points[mesh.droppers[:, 1], 2]
    apart, stretched = length, np.zeros(length.size)
    hanging: _HangingWires | None = None
    model: Model | None = None
    form: Equilibrium | None = None
    close = _FORCE_TOLERANCE * max(wire.tension for wire in problem.line.wires)
    noise, slackest = _noise(problem, mesh), min(wire.tension for wire in problem.line.wires)
    give = float(np.diff(problem.line.support_positions).max()) / (4.0 * slackest)
    for _ in range(_MAX_PASSES):
        model = build(problem, mesh, length, before=model, apart=True)
        hanging = hanging or _HangingWires(model, exact)
        before = None if form is None else form.lateral
        form = hanging.at_rest(model, form)
        lifted = before is not None and bool(before.arm_force[:, 1].any())
        _check(problem.line, mesh, form, pushing, lifted)
        still_lifted = 0.0
        if model.simulated.lateral:
            form = _with_lateral(model, replace(form, lateral=before), hanging.moments)
            still_lifted = _most_change(before, form.lateral)
        distance = np.linalg.norm(form.dropper_vectors(mesh.droppers), axis=1)
        stretch = distance - form.dropper_length
        # Less what round-off of forces moves droppers, and wires between masts, by.
        moves = np.abs(distance - apart) - noise * give
        grown = np.abs(stretch - stretched) - noise / model.dropper_stiffness
        change = max(moves.max(initial=0.0), grown.max(initial=0.0))
        length, apart, stretched = form.dropper_length, distance, stretch
        if change < _LENGTH_TOLERANCE and still_lifted < close:
            return model, form
    raise InputError(
        f"the lengths of the droppers do not settle: after {_MAX_PASSES} passes they still change "
        f"by {1e3 * change:.2g} mm, and what steady arms lift by {still_lifted:.2g} N, as both "
        "stretch the line; make line.dropper.mass_kg_per_m smaller, or the tensions greater"
    )


def _noise(problem: Problem, mesh: LineMesh) -> float:
    """Round-off of forces of droppers [N], which fine elements of stiff wires make."""
    stiffest = 0.0
    for wire in problem.line.wires:
        shortest = float(np.diff(mesh.x(mesh.elements(wire.name)), axis=1).min())
        beside = 12.0 * wire.bending_stiffness / shortest**3 + 2.0 * wire.tension / shortest
        stiffest = max(stiffest, beside)
    return _ROUND_OFF * stiffest * float(np.abs(mesh.points[:, 2]).max())


def about(model: Model, form: Equilibrium) -> tuple[Model, Equilibrium]:
    """The model with matrices about its shape at rest, if any effect's are or droppers have several
    slopes, and that shape; wires that move together share unknowns. Not collective."""
    problem = model.problem
    if not (effects.needs_form(problem) or effects.move_together(problem) or model.droppers_bend):
        return model, form
    return rebuilt(model, form=form), form


def _with_lateral(model: Model, form: Equilibrium, moments: np.ndarray | None) -> Equilibrium:
    """The equilibrium with its lateral plane, in which droppers may lean, from one before."""
    shape = lateral_shape(model, form, moments)
    form = replace(form, lateral=shape)
    vectors = form.dropper_vectors(model.mesh.droppers)
    length = np.linalg.norm(vectors, axis=1)
    force = form.dropper_force * length / vectors[:, 2]
    return replace(
        form, dropper_force=force, dropper_length=length - model.dropper_slopes.stretch_under(force)
    )


def _most_change(before: LateralShape | None, after: LateralShape | None) -> float:
    """Largest change of the vertical force of an arm [N]."""
    if before is None or after is None:
        return np.inf
    return float(np.abs(after.arm_force - before.arm_force)[:, 1].max(initial=0.0))


class _HangingWires:
    """The wires of a line between what holds them, factored; their loads may change.

    Unknowns are height and slope at each node. Where a height is given, the upward force that holds
    the wire there is unknown in its place; that of a dropper also pulls down its upper end. Where
    the line goes on height and slope are given, and those of the mast before.

    Attributes
    ----------
    moments : additions of exact elements to all loads, None if they are Hermite's
    """

    def __init__(self, model: Model, exact: bool = False) -> None:
        self._w = w = 2 * model.row_of_node
        self.moments = exact_moments(model) if exact else None
        parts, self._spring_load = _springs_and_wires(model, w, exact)
        nodes, heights, held_at = _given_heights(model)
        repeated = repeated_ends(model)
        ends, masts, level = w[repeated.ends], w[repeated.masts[0]], np.zeros(repeated.rise.size)
        # Without weight the forces of all droppers are zero.
        self._weighted = model.simulated.gravity != 0.0
        self._plane = PlaneAtRest(
            parts,
            np.concatenate([w[nodes], ends + 1]),
            np.concatenate([heights, level]),
            np.concatenate([w[held_at], ends + 1]),
            w[model.mesh.droppers if self._weighted else model.mesh.droppers[:0]],
            Followed(
                np.concatenate([ends, ends + 1]),
                np.concatenate([masts, masts + 1]),
                np.concatenate([repeated.rise, level]),
            ),
            2 * model.mesh.n_nodes,
        )

    def at_rest(self, model: Model, before: Equilibrium | None) -> Equilibrium:
        """The line at rest under the weights of ``model``, which may differ in them only, and under
        what arms lift of their own and a twist of the track pulls in the shape ``before``."""
        mesh = model.mesh
        dead = dead_loads(model) + curve_load(model, before)
        if self.moments is not None:
            dead += self.moments
        load = self._spring_load + _in_plane(model, dead, UPRIGHT)
        holding = _holding(model)
        if before is not None and before.lateral is not None:
            at = self._w[mesh.steady_arms[~holding]]
            np.add.at(load, at, before.lateral.arm_force[~holding, 1])
        solution, held_by = self._plane.solve(load)
        height, slope = solution[self._w], solution[self._w + 1]
        n = mesh.droppers.shape[0]
        force = held_by[:n] if self._weighted else np.zeros(n)
        stretched = height[mesh.droppers[:, 0]] - height[mesh.droppers[:, 1]]
        lift, first = np.zeros(mesh.steady_arms.size), mesh.droppers.shape[0]
        by_group = np.argsort(mesh.arm_group[holding], kind="stable")
        lift[np.flatnonzero(holding)[by_group]] = held_by[first : first + by_group.size]
        cut = stretched - model.dropper_slopes.stretch_under(force)
        return Equilibrium(height, slope, force, cut, arm_lift=lift)


def _holding(model: Model) -> np.ndarray:
    """Mask of steady arms that hold their wire at its height, (n_arms,) bool."""
    holds = [arms.kind.holds_height for arms in model.problem.line.steady_arms]
    return np.array([*holds, False])[model.mesh.arm_group]


def _springs_and_wires(model: Model, w: np.ndarray, exact: bool) -> tuple[list[Part], np.ndarray]:
    """Stiffness of wires, supports and clamps, and the load of relaxed supports.

    ``w`` is the number of each node's height; that of its slope follows. A support is a spring
    relaxed at its height: it gives way under the line's weight. Supports that hold a wire at the
    height wanted do so by an unknown force. Arms are without force at rest.
    """
    line, parts = model.problem.line, wire_parts(model, w, exact)
    load = np.zeros(2 * model.mesh.n_nodes)
    for supports, nodes in model.supports_by_group():
        if supports.holds:
            continue
        dofs = w[nodes]
        alike = np.zeros(dofs.size, dtype=np.int64)
        parts.append(Part(dofs[:, None], np.full((1, 1, 1), supports.stiffness), alike))
        relaxed = line.wire(supports.wire).points(np.array(supports.x))[:, 2]
        np.add.at(load, dofs, supports.stiffness * relaxed)
    parts += clamp_parts(model, w)
    return parts, load


def _given_heights(model: Model) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes with a given height, droppers' lower ends first, the heights [m], and the nodes at
    which the forces act by which they are held."""
    mesh, line = model.mesh, model.problem.line
    nodes, heights = [mesh.droppers[:, 1]], [np.zeros(mesh.droppers.shape[0])]
    for group, mine in model.droppers_by_group():
        heights[0][mine] = _wanted(model, line.wire(group.lower), mesh.droppers[mine, 1])
    for arms, mine in model.arms_by_group():
        if arms.kind.holds_height:
            nodes.append(mesh.steady_arms[mine])
            heights.append(_wanted(model, line.wire(arms.wire), nodes[-1]))
    for wire in line.wires:
        nodes.append(mesh.anchors[np.isin(mesh.anchors, mesh.wires[wire.name])])
        if wire.profile is None:
            heights.append(np.array(wire.held_heights))
        else:
            heights.append(_wanted(model, wire, nodes[-1]))
    held_at = list(nodes)
    for supports, own in model.supports_by_group():
        if supports.holds:
            held_at.append(own)
            chain = mesh.wires[supports.holds]
            nodes.append(chain[np.searchsorted(mesh.x(chain), mesh.x(held_at[-1]) - SAME_PLACE)])
            heights.append(_wanted(model, line.wire(supports.holds), nodes[-1]))
    given = np.concatenate(nodes)
    _refuse_twice(mesh, given)
    return given, np.concatenate(heights), np.concatenate(held_at)


def _refuse_twice(mesh: LineMesh, given: np.ndarray) -> None:
    """Refuse heights that two parts are to hold: their forces would not be unique."""
    twice = np.flatnonzero(np.bincount(given) > 1)
    if twice.size:
        node = int(twice[0])
        name = next(name for name, nodes in mesh.wires.items() if node in nodes)
        raise InputError(
            "the line has no static equilibrium: two of its parts are to hold the height of "
            f"{name} at {mesh.points[node, 0]:g} m, such as an end and a support with holds, or a "
            "dropper and an arm with holds_height; leave one of them out"
        )


def _wanted(model: Model, wire: Wire, nodes: np.ndarray) -> np.ndarray:
    """Heights that nodes of a wire are to have, (n,) [m]."""
    return model.simulated.target_height(wire, model.mesh.x(nodes))


def _check(line: Line, mesh: LineMesh, form: Equilibrium, pushing: bool, lifted: bool) -> None:
    """Refuse droppers without length, and slack ones unless they may be ``pushing``; ``lifted``
    says whether steady arms lift the wires."""
    length = form.height[mesh.droppers[:, 0]] - form.height[mesh.droppers[:, 1]]
    _refuse(line, mesh, length <= 0, lambda i: f"would have a length of {length[i] + 0.0:.3g} m")
    cut, force = form.dropper_length, form.dropper_force
    _refuse(
        line,
        mesh,
        cut <= 0,
        lambda i: f"would have a length of {cut[i]:.3f} m before {force[i]:.0f} N stretch it",
    )
    slack = (force <= 0) & (force.any() and not pushing)
    _refuse(
        line,
        mesh,
        slack,
        # Digits as they matter, so that a small force is not rounded to a zero with a sign.
        lambda i: f"would be slack at rest (force {force[i] + 0.0:.3g} N)",
        ", or the inclination of the steady arms, which lift the wire" if lifted else "",
    )


def _refuse(
    line: Line,
    mesh: LineMesh,
    bad: np.ndarray,
    what: Callable[[int], str],
    more_to_change: str = "",
) -> None:
    found = np.flatnonzero(bad)
    if found.size == 0:
        return
    x = mesh.x(mesh.droppers[found, 1])
    masts = line.support_positions
    span = np.clip(np.searchsorted(masts, x, side="right") - 1, 0, line.n_spans - 1)
    place = f"span {span[0] + 1} at {x[0] - masts[span[0]]:.2f} m from its left support"
    more = f", and so would {found.size - 1} more" if found.size > 1 else ""
    raise InputError(
        f"the dropper in {place} {what(int(found[0]))}{more}: change line.dropper.pre_sag_mm, the "
        "dropper positions, line.encumbrance_m, the tensions or the droppers' stiffness"
        + more_to_change
    )


def lateral_shape(
    model: Model, form: Equilibrium, moments: np.ndarray | None = None
) -> LateralShape:
    """The line at rest in the lateral plane. Not collective.

    Parameters
    ----------
    model : Model
        Discrete line.
    form : Equilibrium
        The line at rest in the vertical plane, whose forces of droppers are vertical ones.
    moments : ndarray, optional
        ``exact_moments`` where elements bend as tensioned beams do, None where they do by
        Hermite's functions as in motion.

    Raises
    ------
    InputError
        If an arm that holds its wire's height has too small a radial force to carry it.
    """
    mesh, at = model.mesh, 2 * model.row_of_node
    upper, lower = mesh.droppers.T
    rise = form.height[upper] - form.height[lower]
    parts = wire_parts(model, at, exact=moments is not None) + clamp_parts(model, at)
    parts.append(springs_between(at[mesh.droppers], form.dropper_force / rise))
    pulls = dead_loads(model) + curve_load(model, form)
    if moments is not None:
        pulls += moments
    (nodes, places), repeated = _held(model), repeated_ends(model)
    slopes, level = at[repeated.ends] + 1, np.zeros(repeated.ends.size)
    given = np.concatenate([at[nodes], slopes])
    plane = PlaneAtRest(
        parts,
        given,
        np.concatenate([places, level]),
        given,
        at[mesh.droppers[:0]],
        Followed(slopes, at[repeated.masts[1]] + 1, level),
        2 * mesh.n_nodes,
    )
    course, held = plane.solve(_in_plane(model, pulls, LEVEL))
    held_by = held[np.searchsorted(nodes, mesh.steady_arms)]
    lift = _carried(model, held_by, form.arm_lift)
    arm_force = np.column_stack([held_by, lift, np.zeros(held_by.size)])
    return LateralShape(course[at], course[at + 1], arm_force)


def _in_plane(model: Model, loads: np.ndarray, plane: tuple[str, str]) -> np.ndarray:
    """Loads (n_dofs,) on the unknowns of a plane, deflection and slope of each node in turn."""
    every, at = np.arange(model.mesh.n_nodes), 2 * model.row_of_node
    load = np.zeros(2 * every.size)
    for number, name in enumerate(plane):
        load[at + number] = loads[model.dofs(every, name)]
    return load


def _held(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Nodes that arms, supports and anchors hold sideways, and where [m]; each node once."""
    mesh, line = model.mesh, model.problem.line
    nodes: list[np.ndarray] = []
    places: list[np.ndarray] = []
    held = [(mesh.steady_arms[mine], arms.wire) for arms, mine in model.arms_by_group()]
    held += [(own, supports.wire) for supports, own in model.supports_by_group()]
    for what, name in held:
        nodes.append(what)
        places.append(line.wire(name).points(mesh.x(what))[:, 1])
    for wire in line.wires:
        nodes.append(mesh.anchors[np.isin(mesh.anchors, mesh.wires[wire.name])])
        places.append(wire.points(mesh.x(nodes[-1]))[:, 1])
    each, first = np.unique(np.concatenate(nodes), return_index=True)
    return each, np.concatenate(places)[first]


def _carried(model: Model, radial: np.ndarray, arm_lift: np.ndarray) -> np.ndarray:
    """Vertical force of each arm on its wire, (n_arms,) [N]; ``radial`` (n_arms,) is the lateral
    one [N]."""
    mesh, force = model.mesh, np.zeros(radial.size)
    for arms, mine in model.arms_by_group():
        kind, pull = arms.kind, np.abs(radial[mine])
        if kind.length == 0.0:
            continue
        if kind.inclination is not None:
            force[mine] = pull * np.tan(kind.inclination)
        elif kind.holds_height:
            force[mine] = arm_lift[mine]
            _check_slope(arms, pull, arm_lift[mine], mesh.x(mesh.steady_arms[mine]))
        else:
            weight = model.simulated.gravity * model.hanging_at_arms[mine]
            force[mine] = np.minimum(weight, pull * np.tan(STEEPEST))
    return force


def _check_slope(arms: SteadyArms, pull: np.ndarray, lift: np.ndarray, x: np.ndarray) -> None:
    steep = np.flatnonzero(np.abs(lift) > pull * np.tan(_UPRIGHT))
    if steep.size:
        i = steep[0]
        raise InputError(
            f"the steady arm at {x[i]:.2f} m is to hold the {arms.wire.replace('_', ' ')} with "
            f"{lift[i]:.0f} N upwards at a radial force of {pull[i]:.0f} N, which is steeper than "
            f"{np.rad2deg(_UPRIGHT):.0f} degrees: make line.stagger_m greater, or take "
            "line.steady_arm.holds_height off"
        )
