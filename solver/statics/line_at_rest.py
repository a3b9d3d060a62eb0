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
from catenary.solver.model.model import Model, same_matrices
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.changed_line.rest_nearby import StiffLine
from catenary.solver.statics.elasticity import Elasticity, elasticity, middle_span
from catenary.solver.statics.form_finding.equilibrium import Equilibrium, find_form, sound_form
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
        """Return this line with the train and the contact law of another problem."""
        own = replace(self.problem, train=problem.train, contact=problem.contact)
        model = replace(self.model, problem=own, simulated=simulated(own))
        return LineAtRest(own, model, self.form, self.lift)


class SoundLine(NamedTuple):
    """The line for which droppers are cut; lines that differ in errors of their lengths alone share
    it.

    Attributes
    ----------
    model, form : the discrete line, and its shape at rest
    stiff : its stiffness, factored
    lift : elasticity as that of a ``LineAtRest``
    """

    model: Model
    form: Equilibrium
    stiff: StiffLine
    lift: Elasticity


def sound_line(problem: Problem, mesh: LineMesh) -> SoundLine:
    """The sound line of a problem. Not collective; raises InputError as ``line_at_rest``."""
    model, form = sound_form(problem, mesh)
    return SoundLine(model, form, StiffLine(model), _lift_of(model))


def _lift_of(model: Model) -> Elasticity:
    return elasticity(model, *middle_span(model.problem.line))


def stable_form(
    problem: Problem, mesh: LineMesh, sound: SoundLine | None = None
) -> tuple[Model, Equilibrium]:
    """``find_form``, of a rest that is stable. Not collective.

    Raises
    ------
    InputError
        As ``find_form``, and if the rest is unstable.
    """
    own = None if sound is None else (sound.model, sound.form, sound.stiff)
    model, form = find_form(problem, mesh, own)
    refuse_unstable(model)
    return model, form


def line_at_rest(problem: Problem, mesh: LineMesh, sound: SoundLine | None = None) -> LineAtRest:
    """The line of a problem at rest, found by this process. Not collective.

    ``sound`` is the sound line of a problem that differs only in errors of dropper length, if it
    has been found.

    Raises
    ------
    InputError
        If there is no equilibrium with all droppers taut, or if it is unstable.
    """
    model, form = stable_form(problem, mesh, sound)
    give_back(model.n_unknowns)
    is_sound = sound is not None and same_matrices(sound.model, model)
    lift = sound.lift if sound is not None and is_sound else _lift_of(model)
    return LineAtRest(model.problem, model, form, lift)


def line_at_rest_on_all(
    problem: Problem,
    mesh: LineMesh,
    comm: Any,
    alone: Callable[[Callable[[], Any]], Callable[[], Any]] = lambda work: work,
) -> LineAtRest:
    """Find the line at rest on rank 0, and send it to all ranks. Collective.

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
