"""The line at rest: what a march, a study and a report start from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from catenary.base.freed_memory import give_back
from catenary.base.parallel import on_root
from catenary.meshgen.mesh import LineMesh
from catenary.solver.effects.all_effects import simulated, with_defects
from catenary.solver.effects.build_model import build
from catenary.solver.model.model import Model
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.elasticity import Elasticity, elasticity, middle_span
from catenary.solver.statics.form_finding.equilibrium import Equilibrium, find_form
from catenary.solver.statics.stability_of_rest import refuse_unstable


class LineAtRest(NamedTuple):
    """A problem with its line in equilibrium; ``March(comm, *rest)`` runs it.

    Attributes
    ----------
    problem : everything that the run is made of, in SI units, with the wires that hang
    model : the discrete line, with the lengths of its droppers
    form : its shape at rest
    lift : elasticity of the running span in the middle of the line
    """

    problem: Problem
    model: Model
    form: Equilibrium
    lift: Elasticity

    @property
    def mesh(self) -> LineMesh:
        """The mesh of the line."""
        return self.model.mesh

    def under(self, problem: Problem) -> LineAtRest:
        """The same line under the train and the contact law of another problem of it."""
        own = replace(self.problem, train=problem.train, contact=problem.contact)
        model = replace(self.model, problem=own, simulated=simulated(own))
        return LineAtRest(own, model, self.form, self.lift)


def stable_form(
    problem: Problem, mesh: LineMesh, sound: tuple[Model, Equilibrium] | None = None
) -> tuple[Model, Equilibrium]:
    """``find_form``, of a rest that is stable. Not collective.

    Raises
    ------
    InputError
        As ``find_form``, and if the rest is unstable.
    """
    model, form = find_form(problem, mesh, sound)
    refuse_unstable(model)
    return model, form


def line_at_rest(
    problem: Problem, mesh: LineMesh, sound: tuple[Model, Equilibrium] | None = None
) -> LineAtRest:
    """The line of a problem at rest, found by this process. Not collective.

    ``sound`` is as for ``find_form``.

    Raises
    ------
    InputError
        If there is no equilibrium with all droppers taut, or if it is unstable.
    """
    model, form = stable_form(problem, mesh, sound)
    give_back()
    return LineAtRest(model.problem, model, form, elasticity(model, *middle_span(problem.line)))


def line_at_rest_on_all(
    problem: Problem,
    mesh: LineMesh,
    comm: Any,
    alone: Callable[[Callable[[], Any]], Callable[[], Any]] = lambda work: work,
) -> LineAtRest:
    """The same on all ranks, found on rank 0. Collective.

    Parameters
    ----------
    problem, mesh : Problem
        Problem and mesh of the line, the same on all ranks.
    comm : mpi4py communicator
        Communicator of the ranks.
    alone : callable, optional
        Function that wraps the work of rank 0, e.g. to end it in good order at a signal.

    Raises
    ------
    InputError
        On all ranks, if there is no equilibrium with all droppers taut.
    """

    if comm.size == 1:
        return on_root(comm, alone(lambda: line_at_rest(problem, mesh)), takes_long=True)

    def work() -> tuple[tuple[np.ndarray, ...], Equilibrium, Elasticity]:
        rest = line_at_rest(problem, mesh)
        own = rest.model
        return (own.dropper_lengths, own.dropper_gap, own.cut_lengths), rest.form, rest.lift

    (lengths, gap, cut), form, lift = on_root(comm, alone(work), takes_long=True)
    hung = with_defects(problem)
    model = build(hung, mesh, lengths, form=form, gap=gap, cut_lengths=cut)
    return LineAtRest(hung, model, form, lift)
