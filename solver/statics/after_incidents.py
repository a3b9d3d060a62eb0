"""A line after incidents: its model, the balance that it lost, and the jump of its acceleration.

Displacements stay those from the first rest shape z, so that nothing that is recorded jumps. With
matrices M, C', K' of the changed line

    M a + C' v + K' d = f + g,      g = -(K' - K) z + sum_b l_b N0_b

where K' - K is the part of the wires whose tension changed, and N0_b the force at rest of the
droppers b that broke. Where matrices depend on the shape (droppers that lean, steady arms as bars,
wires that stretch) K' is that about the rest z + d* that the changed line comes to, found by the
energy of `potential`, and

    g = K' d* - sum_d l_d R_d*

with R* < 0 of droppers that are slack there: it rests at d* exactly, with the tension of its wires,
the forces of its arms and the directions of its links as they are there.

Displacement and velocity go through an incident unchanged; forces jump, and with them the
acceleration:

    M (a+ - a-) = g' - g - (K' - K) d - (C' - C) v + sum (l' s') - sum (l s)

with what slack droppers compensate before and after. Newmark's predictor uses the acceleration at
the start of a step: with a- instead of a+ the step would begin with an error of velocity of order
dt.

The energy of the changed line is that of what it still consists of, counted from the first rest as
before: 1/2 d K' d - g d + e0. At an incident it falls by what left the line, T^2 / 2k of a dropper
and 1/2 (1 - share) T integral of z'^2 of a wire; where K' is about another rest, by what that makes
of d besides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.meshgen.mesh import DROPPERS
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import rebuilt
from catenary.solver.linear.step_operators import LineOperators
from catenary.solver.linear.unit_responses import Windows, reach
from catenary.solver.model import beam
from catenary.solver.model.axial_motion import shape_of, tensioned_ends
from catenary.solver.model.loads import ShapeLoad
from catenary.solver.model.matrices import OperatorBands, iterate_sums, whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.switching_links import switching_links
from catenary.solver.problem.defects import DropperBreak, LineIncident
from catenary.solver.statics.line_at_rest import refuse_unstable
from catenary.solver.statics.potential import Potential, dead_loads
from catenary.solver.statics.rest_nearby import RestNearby


@dataclass(frozen=True)
class ChangedLine:
    """A line on which incidents may have happened; plain arrays, the same on every rank.

    Attributes
    ----------
    model : of the line as it is now; displacements count from the first rest
    form : the first rest, with the tension that droppers of the model have there
    load : (n_dofs,) balance lost [N], [N m], zero at held unknowns
    energy : change of the line's energy at the first rest [J]
    """

    model: Model
    form: Equilibrium
    load: np.ndarray
    energy: float


def unchanged(model: Model, form: Equilibrium) -> ChangedLine:
    """The line before anything has happened."""
    return ChangedLine(model, form, np.broadcast_to(0.0, model.n_dofs), 0.0)


def changed_line(first: Model, form: Equilibrium, incidents: Sequence[LineIncident]) -> ChangedLine:
    """The line after ``incidents``, in order of time, which began as ``first``. Not collective.

    Raises
    ------
    RunBroken
        If it comes to no rest any more.
    """
    mesh, problem = first.mesh, first.problem
    broken = np.zeros(mesh.droppers.shape[0], dtype=bool)
    shares: dict[str, float] = {}
    for incident in incidents:
        if isinstance(incident, DropperBreak):
            broken[first.droppers_at([incident.place])] = True
        else:
            shares[incident.wire] = incident.share
    after = replace(problem, line=problem.line.with_shares(shares))
    model = rebuilt(first, problem=after, broken=broken, form=form)
    load, energy = np.zeros(model.n_dofs), 0.0
    for wire, now in zip(problem.line.wires, after.line.wires, strict=True):
        pairs = mesh.elements(wire.name)
        middle = mesh.middles(wire.name)
        lost = now.tension_at(middle) - wire.tension_at(middle)
        if not lost.any():
            continue
        for plane, course, slope in form.planes():
            dofs, length = first.wire_elements(wire.name, plane)
            shape = shape_of(course, slope, pairs)
            pull = np.einsum("nij,nj->ni", beam.stiffness(length, 0.0, lost), shape)
            np.add.at(load, dofs, -pull)
            energy += 0.5 * float((shape * pull).sum())
    unknowns, weights = (part[broken] for part in model.droppers.direction)
    np.add.at(load, unknowns, form.dropper_force[broken, None] * weights)
    stored = first.dropper_slopes.energy_under(form.dropper_force)
    # One that was slack at rest held the energy of what it keeps of its stiffness.
    keeps = (first.dropper_gap > 0.0) & (stored > 0.0)
    stored[keeps] /= first.simulated.kept_ratio
    energy -= float(stored[broken].sum())
    if effects.needs_form(problem):
        try:
            model, form, load = _about_rest(first, model, form)
            refuse_unstable(model)
        except InputError as error:
            raise RunBroken(f"after an incident {error}") from None
    load[model.constrained] = 0.0
    unbalanced = np.flatnonzero(load)
    if unbalanced.size:
        model.loads.append(ShapeLoad(unbalanced, load[unbalanced]))
    return ChangedLine(model, form, load, energy)


def _about_rest(
    first: Model, changed: Model, form: Equilibrium
) -> tuple[Model, Equilibrium, np.ndarray]:
    """The changed line about the rest that it comes to, the first rest with the tension that its
    droppers have there, and its load (n_dofs,)."""
    potential = Potential(first, changed, form, form.dropper_length)
    loads = dead_loads(changed) - dead_loads(first)
    rest = RestNearby(potential, loads, ends_stay=True).find()
    about = rest.form
    if changed.simulated.tensioner is not None and about.along.size:
        # Stops are where they were: displacements count from the first rest.
        ends, along = [end.node for end in tensioned_ends(first)], about.along.copy()
        along[ends] = form.moved_along(np.array(ends, dtype=int))
        about = replace(about, along=along)
    model = rebuilt(changed, form=about)
    unknowns, weights = model.droppers.direction
    k, moved = model.dropper_stiffness, rest.moved
    stretched = k * (weights * moved[unknowns]).sum(axis=1)
    tension = np.where(changed.broken, 0.0, rest.reserve - stretched)
    now = replace(form, dropper_force=tension)
    load = whole_matrix(model, stiffness=1.0) @ moved
    there = ChangedLine(model, now, load, 0.0)
    push = _compensation(there, moved, np.zeros(moved.size))
    return model, now, load - push


def acceleration_jump(
    comm: Any,
    ownership: Ownership,
    before: ChangedLine,
    after: ChangedLine,
    state: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Change of the acceleration from ``before`` to ``after``, owned part. Collective.

    Parameters
    ----------
    comm : mpi4py communicator
        Communicator of the ranks.
    ownership : Ownership
        Which unknowns this rank owns.
    before : ChangedLine
        The line before the incident.
    after : ChangedLine
        The line after it.
    state : tuple of ndarray
        Owned displacement and velocity, (n_local,) each [m], [m/s].

    Returns
    -------
    ndarray, shape (n_local,) [m/s2], [rad/s2]
    """
    displacement, velocity = (np.concatenate(comm.allgather(part)) for part in state)
    first, last = ownership.first, ownership.last
    force = (after.load - before.load)[first:last]
    for line, sign in ((after, 1.0), (before, -1.0)):
        # No matrix, as it would be multiplied once.
        entries = iterate_sums(line.model, first, last, [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
        for rows, columns, (stiffness, damping) in entries:
            pull = stiffness * displacement[columns] + damping * velocity[columns]
            force -= sign * np.bincount(rows - first, pull, force.size)
        push = _compensation(line, displacement, velocity)
        force += sign * push[first:last]
    held = after.model.constrained[ownership.owned(after.model.constrained)] - first
    force[held] = 0.0
    return divided_by_mass(comm, ownership, after.model, force)


def _compensation(line: ChangedLine, displacement: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Forces (n_dofs,) of switched droppers and their dependents beyond those of K and C [N]."""
    table = switching_links(line.model, line.form.dropper_force)
    unknowns, weights, law = table.arrays
    stretch, rate = (
        (weights * values[unknowns]).sum(axis=1) for values in (displacement, velocity)
    )
    reserve = law["rest"] + law["stiffness"] * stretch + law["damping"] * rate
    # Other links are the same before and after an incident.
    owner = np.where(table.bent >= 0, table.bent, table.leader)
    owner = np.where(table.bent[owner] >= 0, table.bent[owner], owner)  # of dependents of bends
    acts = np.isin(owner, table.of_component(DROPPERS)) & ~table.broken[owner]
    acts &= reserve[table.leader] < 0.0
    total = np.zeros(line.model.n_dofs)
    np.add.at(total, unknowns[acts], (law["released"] * reserve)[acts, None] * weights[acts])
    return total


def divided_by_mass(comm: Any, ownership: Ownership, model: Model, force: np.ndarray) -> np.ndarray:
    """M^-1 ``force``, owned parts (n_local,) [m/s2], [rad/s2] of [N], [N m]. Collective."""
    only_mass = (1.0, 0.0, 0.0)
    windows = Windows(model.numbering, reach(model, OperatorBands(model, only_mass)))
    operators = LineOperators(comm, model, ownership, only_mass, windows)
    try:
        whole = np.concatenate(comm.allgather(force))
        return operators.solve_for(np.arange(whole.size), whole).copy()
    finally:
        operators.destroy()
