"""Form finding in the lateral plane: stagger, curve and cant, and what droppers pull sideways.

A dropper that leans pulls its wires sideways by its vertical force times its lateral over its
vertical span. Both of these are those of the vertical plane, in which it does not matter how it
leans: laterally wires are then linear, and one sparse system gives their course.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import linalg as sparse_linalg

from catenary.base.errors import InputError
from catenary.meshgen.hardware import SteadyArms
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium, LateralShape
from catenary.solver.statics.form_finding.sparse_sum import (
    clamp_parts,
    springs_between,
    summed,
    wire_parts,
)
from catenary.solver.statics.repeated_ends import repeated_ends, settled
from catenary.solver.statics.rest_loads import curve_load, dead_loads

# An arm that hangs freely carries its weight up to this inclination, the wire what is beyond [rad].
STEEPEST = np.deg2rad(20.0)
# Arms that hold their wire's height stand no steeper [rad].
_UPRIGHT = np.deg2rad(60.0)


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
    mesh = model.mesh
    at, n = 2 * model.row_of_node, 2 * mesh.n_nodes
    upper, lower = mesh.droppers.T
    rise = form.height[upper] - form.height[lower]
    parts = wire_parts(model, at, exact=moments is not None) + clamp_parts(model, at)
    parts.append(springs_between(at[mesh.droppers], form.dropper_force / rise))
    stiffness, load = summed(parts, n).tocsr(), np.zeros(n)
    every, pulls = np.arange(mesh.n_nodes), dead_loads(model) + curve_load(model, form)
    if moments is not None:
        pulls += moments
    load[at], load[at + 1] = pulls[model.dofs(every, "v")], pulls[model.dofs(every, "theta_z")]
    nodes, places = _held(model)
    given = np.zeros(n, dtype=bool)
    given[at[nodes]] = True
    course = np.zeros(n)
    course[at[nodes]] = places
    repeated = repeated_ends(model)
    slopes, before = at[repeated.ends] + 1, at[repeated.masts[1]] + 1
    given[slopes] = True
    free = np.flatnonzero(~given)
    factors = sparse_linalg.splu(stiffness[free][:, free].tocsc(), permc_spec="NATURAL")

    def turn(values: np.ndarray) -> np.ndarray:
        course[free], course[slopes] = 0.0, values
        course[free] = factors.solve((load - stiffness @ course)[free])
        return np.asarray(course[before])

    settled(turn, np.zeros(slopes.size))
    y, slope = course[at], course[at + 1]
    held_by = (stiffness @ course - load)[at[mesh.steady_arms]]
    lift = _carried(model, held_by, form.arm_lift)
    arm_force = np.column_stack([held_by, lift, np.zeros(held_by.size)])
    return LateralShape(y, slope, arm_force)


def _held(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Nodes that arms, supports and anchors hold sideways, and where [m]; each node once."""
    mesh, line = model.mesh, model.problem.line
    nodes: list[np.ndarray] = []
    places: list[np.ndarray] = []
    held = [(mesh.steady_arms[mesh.arm_group == i], a.wire) for i, a in enumerate(line.steady_arms)]
    held += [(mesh.supports[mesh.support_group == i], s.wire) for i, s in enumerate(line.supports)]
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
    for number, arms in enumerate(model.problem.line.steady_arms):
        mine, kind = mesh.arm_group == number, arms.kind
        pull = np.abs(radial[mine])
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
