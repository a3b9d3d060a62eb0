"""The line at rest with defects: droppers keep the lengths to which they were cut."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catenary.base.errors import InputError
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import build
from catenary.solver.model.link_directions import dropper_directions
from catenary.solver.model.model import Model, same_matrices
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.defects import HardSpot
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.changed_line.potential import Potential
from catenary.solver.statics.changed_line.rest_nearby import RestNearby, StiffLine, where
from catenary.solver.statics.rest_loads import dead_loads


def hang(
    problem: Problem, cut: Model, form: Equilibrium, stiff: StiffLine | None = None
) -> tuple[Model, Equilibrium]:
    """The model of a line with its defects, and its equilibrium. Not collective.

    Parameters
    ----------
    problem : Problem
        Problem of the line with its defects, with all its effects.
    cut : Model
        Model of the line for which droppers were cut.
    form : Equilibrium
        Equilibrium of ``cut``; droppers that push there slacken, and others take over their force.
    stiff : StiffLine, optional
        Factors of a line, used if the matrices are the same.

    Raises
    ------
    InputError
        If a dropper would have no length, or there is no rest.
    """
    mesh, errors = cut.mesh, errors_of_length(problem, cut)
    length = cut.dropper_lengths + errors
    if (length <= 0.0).any():
        number = int(np.argmin(length))
        raise InputError(
            f"irregularities.dropper_lengths leaves the dropper at "
            f"{mesh.x(mesh.droppers[number, 1]):g} m a length of {length[number]:.3f} m: "
            "take smaller errors"
        )
    wanted = cut.dropper_lengths
    springless = _without_springs(problem)
    model = build(springless, mesh, length, form=form, cut_lengths=wanted)
    potential = Potential(cut, model, form, form.dropper_length + errors)
    if stiff is not None and not same_matrices(stiff.model, model):
        stiff = None
    load = dead_loads(model) - dead_loads(cut)
    rest = RestNearby(potential, load, stiff=stiff).find()
    if model.simulated.uplift_stops:
        arms = mesh.steady_arms
        rest = rest._replace(
            form=replace(rest.form, arm_raised=rest.form.height[arms] - form.height[arms])
        )
    _refuse_slack_wires(model, rest.form)
    moved_stops = rest.form.arm_raised.any()
    depends = effects.needs_form(problem) or model.droppers_bend or springless is not problem
    if not (depends or rest.gap.any() or moved_stops):
        model.form = rest.form
        if all(map(np.array_equal, dropper_directions(model), model.droppers.direction)):
            return model, rest.form  # no matrix depends on the shape
    hung = build(problem, mesh, length, form=rest.form, gap=rest.gap, cut_lengths=wanted)
    return hung, rest.form


def _without_springs(problem: Problem) -> Problem:
    """The problem without the springs of hard spots, which carry nothing at rest."""
    defects = tuple(
        replace(defect, stiffness=0.0) if isinstance(defect, HardSpot) else defect
        for defect in problem.defects
    )
    return problem if defects == tuple(problem.defects) else replace(problem, defects=defects)


def errors_of_length(problem: Problem, cut: Model) -> np.ndarray:
    """Errors of the droppers' lengths, (n_droppers,) [m]."""
    errors, n = effects.simulated(problem).length_errors, cut.dropper_lengths.size
    if errors is None:
        return np.zeros(n)
    found = errors.of(n)
    np.add.at(
        found, cut.droppers_at([place for place, _ in errors.given]), [e for _, e in errors.given]
    )
    return found


def _refuse_slack_wires(model: Model, form: Equilibrium) -> None:
    for name, gained in form.gained_tension.items():
        wire, pairs = model.problem.line.wire(name), model.mesh.elements(name)
        middle = model.mesh.x(pairs).mean(axis=1)
        left = wire.tension_at(middle) + gained
        if left.min() <= 0.0:
            raise InputError(
                f"{name} would be slack{where(model)} (tension {left.min() + 0.0:.3g} N at "
                f"{middle[left.argmin()]:.1f} m): give its end a tensioner (line.ends, "
                "line.tensioner), or change line.temperature.difference_K"
            )
