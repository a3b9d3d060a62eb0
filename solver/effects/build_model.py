"""The model of a problem on a mesh: each active effect adds its terms."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.meshgen.mesh import LineMesh
from catenary.solver.effects import all_effects as effects
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.unknowns import Unknowns, along_the_track, number_unknowns
from catenary.solver.problem.problem import Problem


def build(
    problem: Problem,
    mesh: LineMesh,
    dropper_lengths: np.ndarray,
    broken: np.ndarray | None = None,
    form: Equilibrium | None = None,
    gap: np.ndarray | None = None,
    before: Model | None = None,
    apart: bool = False,
    cut_lengths: np.ndarray | None = None,
) -> Model:
    """The model of a problem on a mesh, for given dropper lengths. Not collective.

    Parameters
    ----------
    problem : Problem
        Problem whose active effects add their terms.
    mesh : LineMesh
        Mesh of the line.
    dropper_lengths : ndarray, shape (n_droppers,)
        Unstretched lengths [m].
    broken : ndarray of bool, shape (n_droppers,), optional
        Further droppers without force, beside the defective ones of the problem.
    form : Equilibrium, optional
        Shape at rest; without it wires are straight and droppers upright.
    gap : ndarray, shape (n_droppers,), optional
        Stretch that slack droppers lack to be taut at rest [m]; zero if not given.
    before : Model, optional
        Model of the same problem, mesh and ``form``, whose numbering and wires are taken over.
    apart : bool, optional
        Whether wires that move together get unknowns of their own.
    cut_lengths : ndarray, shape (n_droppers,), optional
        Lengths without errors of the installation [m]; ``dropper_lengths`` if not given.

    Raises
    ------
    InputError
        If wires that move together do not have their nodes, droppers and hardware side by side.
    """
    active = effects.active(problem)
    if before is None:
        numbering = numbering_of(problem, mesh, apart)
        row_of_node = np.empty(mesh.n_nodes, dtype=np.int64)
        row_of_node[along_the_track(mesh)] = np.arange(mesh.n_nodes)
    else:
        numbering, row_of_node = before.numbering, before.row_of_node
    model = Model(
        problem,
        effects.simulated(problem) if before is None else before.simulated,
        mesh,
        numbering,
        row_of_node,
        dropper_lengths,
        dropper_lengths if cut_lengths is None else cut_lengths,
    )
    model.form = form
    model.hanging_at_arms = np.zeros(mesh.steady_arms.size)
    model.missing, model.broken = np.zeros((2, mesh.droppers.shape[0]), dtype=bool)
    model.missing[model.droppers_at(model.simulated.missing)] = True
    model.broken[model.droppers_at(model.simulated.loose)] = True
    model.broken |= model.missing if broken is None else model.missing | broken
    model.dropper_gap = np.zeros(mesh.droppers.shape[0]) if gap is None else gap
    model.terms_of = {effect.name: 0 for effect in active}
    builder = ModelBuilder(model, before)
    for effect in active:
        if effect.build is not None:
            effect.build(builder)
        model.terms_of[effect.name] = builder.take_count() + effect.n_laws
    return builder.finish()


def numbering_of(problem: Problem, mesh: LineMesh, apart: bool = False) -> Unknowns:
    """The unknowns that the effects of a problem need on a mesh; of ``apart`` see ``build``. Not
    collective."""
    groups = effects.unknown_groups(effects.active(problem), problem.line.wires)
    return number_unknowns(mesh, groups, together={} if apart else effects.move_together(problem))


def with_wires_apart(model: Model) -> Model:
    """The model with unknowns of its own for each wire: itself, if no wires move together. Not
    collective."""
    if not effects.move_together(model.problem):
        return model
    return rebuilt(model, apart=True)


def rebuilt(model: Model, **other: Any) -> Model:
    """The model as it was built, but for ``other`` arguments of ``build``. Not collective."""
    same = dict(
        problem=model.problem,
        mesh=model.mesh,
        dropper_lengths=model.dropper_lengths,
        broken=model.broken,
        form=model.form,
        gap=model.dropper_gap,
        cut_lengths=model.cut_lengths,
    )
    return build(**{**same, **other})
