"""The line at rest with the droppers that were cut, after what befell it: its profile follows.

From the shape z for which the droppers were cut, with forces N, the line moves by u:

    K u = g + sum_d L_d s_d,      g = w' - w - (K_w' - K_w) z - sum_d L_d (T_d - N_d)

w and K_w are weights and the wires' stiffness, with a prime those of the line as it hangs, K all of
its stiffness with droppers taut. T = k' (N / k - error) is what a dropper of its own length pulls
in the shape z, and R = T + k' L u afterwards. Droppers only pull: with R < 0 one has the
compensation s = -(1 - kept) R. Which ones are slack is found by switching all at once, until
nothing switches; should that go round, one at a time from the first on, which ends always
(K. G. Murty, Linear Algebra Appl. 7, 1974: the matrix of this problem is positive definite).
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from catenary.solver.base.errors import InputError
from catenary.solver.effects.all_effects import simulated
from catenary.solver.effects.build_model import build
from catenary.solver.model import axial_elements
from catenary.solver.model.elements import beam
from catenary.solver.model.model import Model, wire_elements
from catenary.solver.model.rest.rest_shape import Equilibrium
from catenary.solver.problem.problem import Problem

# Passes in which all switch at once, before one at a time does.
_ALL_AT_ONCE = 40
# Forces below this are none [N]: what a dropper of 1e6 N/m pulls when it stretches by 1e-13 m.
_NO_FORCE = 1e-7


def hang(problem: Problem, cut: Model, form: Equilibrium) -> tuple[Model, Equilibrium]:
    """The model of a line as it hangs, and its equilibrium. Not collective.

    Parameters
    ----------
    problem : whose line is the one that hangs, and whose effects are all that it has
    cut : model of the line for which droppers were cut
    form : its equilibrium; droppers that push there slacken, and others take their part

    Raises
    ------
    InputError
        If a dropper would have no length.
    """
    mesh, errors = cut.mesh, _errors_of_length(problem, cut)
    length = cut.dropper_lengths + errors
    if (length <= 0.0).any():
        number = int(np.argmin(length))
        raise InputError(
            f"irregularities.dropper_lengths leaves the dropper at "
            f"{mesh.x(mesh.droppers[number, 1]):g} m a length of {length[number]:.3f} m: "
            "take smaller errors"
        )
    model = build(problem, mesh, length, form=form)
    pull = np.zeros(length.size)
    k, there = model.dropper_stiffness, ~model.broken
    stretch = form.dropper_force / cut.dropper_stiffness - errors
    pull[there] = (k * stretch)[there]
    load = model.weight - cut.weight - _by_wires(cut, model, form)
    assert model.droppers is not None
    unknowns, weights = model.droppers.direction
    np.add.at(load, unknowns, (form.dropper_force - pull)[:, None] * weights)
    load[model.constrained] = 0.0
    moved, reserve = _at_rest(model, load, pull)
    slack = (reserve < -_NO_FORCE) & there & model.simulated.slackening
    kept = model.simulated.kept_ratio
    force = np.where(slack, kept * reserve, np.where(np.abs(reserve) < _NO_FORCE, 0.0, reserve))
    gap = np.zeros(length.size)
    gap[slack] = -reserve[slack] / k[slack]
    hung = replace(
        _moved(model, form, moved),
        dropper_force=np.where(there, force, 0.0),
        dropper_length=form.dropper_length + errors,
    )
    return build(problem, mesh, length, form=hung, gap=gap), hung


def _moved(model: Model, form: Equilibrium, moved: np.ndarray) -> Equilibrium:
    """The shape after a displacement (n_dofs,), with what wires gain of tension by it."""
    every = np.arange(model.mesh.n_nodes)
    changes: dict[str, Any] = {
        "height": form.height + moved[model.dofs(every)],
        "slope": form.slope + moved[model.dofs(every, "theta_y")],
    }
    if form.lateral is not None:
        changes["lateral"] = replace(
            form.lateral,
            y=form.lateral.y + moved[model.dofs(every, "v")],
            slope=form.lateral.slope + moved[model.dofs(every, "theta_z")],
        )
    if form.lateral is not None:
        sideways = moved[model.dofs(every, "v")], moved[model.dofs(every, "theta_z")]
        y, slope = form.lateral.y + sideways[0], form.lateral.slope + sideways[1]
        changes["lateral"] = replace(form.lateral, y=y, slope=slope)
    if "u" in model.unknowns:
        before = form.along if form.along.size else np.zeros(every.size)
        gained = dict(form.gained_tension)
        for wire in model.problem.line.wires:
            of_motion = moved[axial_elements.unknowns_along(model, wire.name)]
            strain = (axial_elements.strain_rows(model, wire.name) * of_motion).sum(axis=1)
            section = wire.left_of(model.mesh.x(model.mesh.elements(wire.name)))[0]
            assert wire.axial_stiffness is not None
            more = wire.axial_stiffness * section * strain
            gained[wire.name] = gained.get(wire.name, np.zeros(more.size)) + more
        changes |= {"along": before + moved[model.dofs(every, "u")], "gained_tension": gained}
    return replace(form, **changes)


def _errors_of_length(problem: Problem, cut: Model) -> np.ndarray:
    """Errors of the droppers' lengths, (n_droppers,) [m]."""
    errors, n = simulated(problem).length_errors, cut.dropper_lengths.size
    if errors is None:
        return np.zeros(n)
    found = errors.of(n)
    for x, error in errors.given:
        found[cut.droppers_at((x,))] += error
    return found


def _by_wires(cut: Model, model: Model, form: Equilibrium) -> np.ndarray:
    """What the wires that hang pull beside those that were cut for, in the same shape."""
    result = np.zeros(model.n_dofs)
    mesh = cut.mesh
    for before, now in zip(cut.problem.line.wires, model.problem.line.wires, strict=True):
        if (before.tension, before.taken, before.worn) == (now.tension, now.taken, now.worn):
            continue
        pairs = mesh.elements(now.name)
        ends = mesh.x(pairs)
        middle = ends.mean(axis=1)
        tension = now.tension_at(middle) - before.tension_at(middle)
        bending = now.left_of(ends)[1] - before.left_of(ends)[1]
        for plane, course, slope in form.planes():
            dofs, length = wire_elements(model, now.name, plane)
            bent = beam.stiffness(length, now.bending_stiffness, 0.0)
            matrices = beam.stiffness(length, 0.0, tension)
            matrices += bending[:, None, None] * bent
            shape = np.stack([course[pairs], slope[pairs]], axis=2).reshape(-1, 4)
            np.add.at(result, dofs, np.einsum("nij,nj->ni", matrices, shape))
    return result


def _at_rest(model: Model, load: np.ndarray, pull: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacement under a load (n_dofs,) [N], [N m], and what droppers would carry there that
    could push, of ``pull`` (n_droppers,) without it [N]."""
    # PETSc is not loaded by a check of a sound line.
    from catenary.solver.model.matrices import stiffness_matrix

    n, k = model.n_dofs, model.dropper_stiffness
    assert model.droppers is not None
    unknowns, weights = model.droppers.direction
    rows = np.repeat(np.arange(k.size), unknowns.shape[1])
    spread = sparse.csr_matrix((weights.ravel(), (rows, unknowns.ravel())), shape=(k.size, n))
    free = np.ones(n)
    free[model.constrained] = 0.0
    spread = spread @ sparse.diags(free)
    stiffness = stiffness_matrix(model)
    released = 1.0 - model.simulated.kept_ratio if model.simulated.slackening else 0.0
    switches = ~model.broken & (released > 0.0)
    slack = switches & (pull < -_NO_FORCE)
    for again in itertools.count():
        gone = sparse.diags(np.where(slack, released * k, 0.0))
        matrix = (stiffness - spread.T @ gone @ spread).tocsc()
        right = load + spread.T @ np.where(slack, released * pull, 0.0)
        moved = sparse_linalg.splu(matrix).solve(right)
        reserve = pull + k * (spread @ moved)
        wrong = switches & np.where(slack, reserve > _NO_FORCE, reserve < -_NO_FORCE)
        if not wrong.any():
            return moved, reserve
        chosen = wrong if again < _ALL_AT_ONCE else np.arange(k.size) == np.argmax(wrong)
        slack = slack ^ chosen
    raise AssertionError("counting ends never")
