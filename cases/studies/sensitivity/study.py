"""The statistics of a case differentiated by its parameters, in one march."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.run.prepared import sound_rest
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.sensitivity.parameters import ChangedScenes, Parameter, parameters_of
from catenary.cases.terminal.runs_bar import RunsBar
from catenary.postproc.channels.places_on_train import places_on_train
from catenary.postproc.evaluate import derivatives, filters
from catenary.postproc.evaluate.derivatives import ForceDerivatives
from catenary.postproc.evaluate.statistics import covers
from catenary.solver.model.model import same_matrices
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.tangents.march import Tangents, march_with_tangents
from catenary.solver.tangents.set_up import (
    Change,
    SetUp,
    differentiate,
    set_up_of,
)

# Memory for derivatives of all steps; for further parameters the march is made again [B].
_BYTES = 2**28


@dataclass
class Sensitivity:
    """A case differentiated by parameters.

    Attributes
    ----------
    names : of the pantographs
    statistics : "mean", "std", "max" and "min" of the force of each of them below 20 Hz in the
        evaluated stretch [N]
    max_uplift : largest uplift of evaluated arms [m], NaN if there are none
    parameters : by which it was differentiated
    by_force : of each parameter, for each pantograph, derivatives of its statistics per unit of the
        parameter's key
    by_uplift : of each parameter that of the largest uplift [m]
    n_steps : of the march
    step_m : what it runs in a step
    contact_switches, link_switches : see ``Tangents``
    left_out : keys of usual parameters by which it cannot be differentiated, and why
    """

    names: list[str]
    statistics: list[dict[str, float]]
    max_uplift: float
    n_steps: int
    step_m: float
    contact_switches: int
    link_switches: int
    parameters: list[Parameter] = field(default_factory=list)
    by_force: list[list[ForceDerivatives]] = field(default_factory=list)
    by_uplift: list[float] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)


def sensitivity_of(
    scene: Scene,
    keys: Sequence[str],
    comm: Any,
    *,
    droppers: bool = False,
    shows: bool = False,
) -> Sensitivity:
    """Differentiate the statistics of a scene. Not collective: one process.

    Parameters
    ----------
    scene : checked
    keys : of the parameters; the usual ones if there are none and ``droppers`` is not set
    droppers : whether the length of each dropper in the evaluated stretch is a parameter
    comm : mpi4py communicator of this process alone
    shows : whether a bar counts set-ups and tangents, if somebody looks on

    Raises
    ------
    InputError
        If the march has parts without derivatives, or by a parameter that was named.
    RunBroken
        If the march breaks.
    """
    filters.check_sampling(scene.numerics.dt_s)
    scenes = ChangedScenes(scene)
    parameters = parameters_of(scenes, keys, droppers)
    at_rest = sound_rest(scenes.scene)
    now = set_up_of(comm, at_rest)
    changes: list[Change] = []
    kept, left_out = [], {}
    found: Sensitivity | None = None
    steps = 2 * len(parameters) if shows else 0
    with RunsBar(steps, lambda line: None, what="set-ups and tangents") as bar:
        for parameter in parameters:
            try:
                changes.append(change_by(parameter, scenes, at_rest, now, comm))
            except InputError as error:
                if keys or droppers:
                    raise
                left_out[parameter.key] = str(error)
            else:
                kept.append(parameter)
            bar.ended()
        for part in parts_of(changes, at_rest, now):
            marched = march_with_tangents(comm, at_rest, changes[part])
            if found is None:
                found = _without_parameters(marched, at_rest)
            _add(found, marched, at_rest, kept[part])
            bar.ended(len(kept[part]))
    assert found is not None
    found.left_out = left_out
    return found


def change_by(
    parameter: Parameter, scenes: ChangedScenes, at_rest: LineAtRest, now: SetUp, comm: Any
) -> Change:
    """The derivative of a march's set-up by a parameter. Not collective.

    Parameters
    ----------
    scenes : the scene, unchanged
    at_rest, now : its line and set-up

    Raises
    ------
    InputError
        If there is none.
    """

    def set_up(by: float) -> SetUp:
        try:
            if parameter.is_of_train:
                rest = at_rest.under(problem_of(scenes.changed(parameter, by)))
            else:
                rest = scenes.rest(parameter, by)
        except InputError as error:
            raise InputError(
                f"{parameter.key} is at a bound of what is allowed, where a march has no "
                f"derivative to both sides: {error}"
            ) from error
        # Of a shape that changes no matrix, these are taken over.
        same = parameter.is_of_shape and same_matrices(rest.model, at_rest.model)
        same = same or parameter.is_of_train
        return set_up_of(comm, rest, len(now.drives), now if same else None)

    return differentiate(set_up, now, parameter.step, parameter.key)


def parts_of(changes: Sequence[Change], at_rest: LineAtRest, now: SetUp) -> Iterator[slice]:
    """Changes by parts for each of which a march is made: all at once need too much memory. One
    part, empty, without changes."""
    n_results = 2 * len(now.heads) + at_rest.mesh.steady_arms.size
    most = max(1, _BYTES // (8 * len(now.drives) * n_results))
    for first in range(0, max(1, len(changes)), most):
        yield slice(first, first + most)


def _without_parameters(marched: Tangents, at_rest: LineAtRest) -> Sensitivity:
    statistics = []
    for number, within in _within(marched, at_rest):
        force = filters.low_pass(marched.force[:, number], marched.dt)[within]
        figures = ("mean", "std", "max", "min")
        statistics.append({name: float(getattr(force, name)()) for name in figures})
    n = len(statistics)
    names = places_on_train(n)
    order = np.argsort([place.behind for place in at_rest.problem.train.placements], kind="stable")
    return Sensitivity(
        [names[int(place)] for place in np.argsort(order)],
        statistics,
        float(marched.uplift.max()) if marched.uplift.size else float("nan"),
        len(marched.force),
        marched.speed * marched.dt,
        marched.contact_switches,
        marched.link_switches,
    )


def _within(marched: Tangents, at_rest: LineAtRest) -> Iterator[tuple[int, np.ndarray]]:
    """Each pantograph's number, and which steps it is in the evaluated stretch."""
    first, last = at_rest.problem.evaluation
    for number in range(marched.force.shape[1]):
        position = marched.position[:, number]
        if not covers(position, (first, last)):
            raise InputError(
                f"a pantograph runs from {position[0]:.0f} to {position[-1]:.0f} m, and not "
                f"through the evaluation stretch from {first:.0f} to {last:.0f} m"
            )
        yield number, (position >= first) & (position <= last)


def _add(
    found: Sensitivity, marched: Tangents, at_rest: LineAtRest, parameters: list[Parameter]
) -> None:
    """Add the derivatives of a march by some parameters."""
    by_place = marched.by_position / marched.speed
    of_all = [
        derivatives.of_force(
            marched.force[:, number],
            marched.by_force[:, :, number],
            within,
            marched.dt,
            by_place[:, :, number],
        )
        for number, within in _within(marched, at_rest)
    ]
    by_uplift = derivatives.of_largest(marched.uplift, marched.by_uplift)
    for place, parameter in enumerate(parameters):
        found.parameters.append(parameter)
        found.by_force.append(
            [ForceDerivatives(*(values[place] for values in own)) for own in of_all]
        )
        found.by_uplift.append(float(by_uplift[place]))
