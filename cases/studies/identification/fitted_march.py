"""A march under changed parameters as measured, and its derivatives by these."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.identification.measurement import FORCE, Measurement
from catenary.cases.studies.sensitivity.parameters import ChangedScenes, Parameter
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.statics.stability_of_rest import refuse_lost_wire
from catenary.solver.tangents.march import Tangents, march_with_tangents
from catenary.solver.tangents.set_up import Change, SetUp, differentiate, set_up_of

# What derivatives of all steps may take before the march is made again for the next parameters [B].
_BYTES = 2**28


class FittedMarch:
    """Marches of a scene whose parameters are changed. Not collective: one process.

    Parameters
    ----------
    scenes : the scene, unchanged
    parameters : m of it
    measurement : which samples of a march are compared
    comm : mpi4py communicator of this process alone
    progress : called with a line for each parameter and march
    """

    def __init__(
        self,
        scenes: ChangedScenes,
        parameters: Sequence[Parameter],
        measurement: Measurement,
        comm: Any,
        progress: Callable[[str], None],
    ) -> None:
        self._scenes, self._parameters = scenes, parameters
        self._measurement, self._comm, self._progress = measurement, comm, progress
        self._kept: dict[str, Change] = {}

    def values(self, by: Sequence[float]) -> list[np.ndarray]:
        """Samples (n,) of each signal, with the parameters changed ``by`` (m,) in their units.

        Raises
        ------
        InputError
            If the scene refuses these values.
        RunBroken
            If the march breaks.
        """
        self._progress("march")
        marched = march_with_tangents(self._comm, self._at_rest(by), [])
        return [
            self._measurement.of_march(marched.position[:, self._number], of_all, marched.dt)
            for of_all, _ in self._signals(marched)
        ]

    def derivatives(self, by: Sequence[float]) -> list[np.ndarray]:
        """Derivatives (n, m) of the samples of each signal by the parameters, per their units.

        Raises
        ------
        InputError
            Also if a parameter is none that a march can be differentiated by.
        """
        at_rest = self._at_rest(by)
        now = set_up_of(self._comm, at_rest)
        changes = self._changes(by, at_rest, now)
        n_results = 2 * len(now.heads) + at_rest.mesh.steady_arms.size
        most = max(1, _BYTES // (8 * len(now.drives) * n_results))
        parts: list[list[np.ndarray]] = []
        for first in range(0, len(changes), most):
            self._progress("march with tangents")
            marched = march_with_tangents(self._comm, at_rest, changes[first : first + most])
            position = marched.position[:, self._number]
            parts.append(
                [
                    self._measurement.of_march(position, by_parameters, marched.dt)
                    for _, by_parameters in self._signals(marched)
                ]
            )
        return [np.concatenate(own, axis=1) for own in zip(*parts, strict=True)]

    @property
    def _number(self) -> int:
        return self._measurement.pantograph

    def _signals(self, marched: Tangents) -> list[tuple[np.ndarray, np.ndarray]]:
        """Of each signal the values of all steps, and their derivatives (n_steps, m)."""
        number, found = self._number, []
        for signal in self._measurement.signals:
            if signal.name == FORCE:
                pair = (marched.force[:, number], marched.by_force[:, :, number])
            else:
                pair = (marched.head_height[:, number], marched.by_head_height[:, :, number])
            found.append(pair)
        return found

    def _changed(self, by: Sequence[float]) -> Scene:
        pairs = list(zip(self._parameters, by, strict=True))
        try:
            return self._scenes.all_changed(pairs)
        except InputError as error:
            raise InputError(
                f"the search comes to a value that the scene refuses: {error}; the deviation of "
                "its prior may be too large"
            ) from error

    def _at_rest(self, by: Sequence[float]) -> LineAtRest:
        found = _at_rest_of(self._changed(by))
        refuse_lost_wire(found.model, found.form)
        return found

    def _changes(self, by: Sequence[float], at_rest: LineAtRest, now: SetUp) -> list[Change]:
        """Derivatives of the set-up. Those by lengths of droppers, in which the line at rest is
        linear, are kept from the first ones."""
        scenes, changes = ChangedScenes(self._changed(by)), []
        for parameter in self._parameters:
            key = parameter.key
            change = self._kept.get(key)
            if change is None:
                self._progress(key)
                own = scenes.parameter(key)

                def set_up(step: float, own: Parameter = own) -> SetUp:
                    changed = scenes.changed(own, step)
                    if own.is_of_train:
                        problem = problem_of(changed)
                        return set_up_of(self._comm, at_rest.under(problem), len(now.drives), now)
                    return set_up_of(self._comm, _at_rest_of(changed), len(now.drives))

                change = differentiate(set_up, now, own.step, key)
                if change.start.size or change.speed:
                    raise InputError(
                        f"{key} moves the pantograph along the track: where it was is measured, "
                        "and no parameter of an identification"
                    )
                if parameter.is_dropper:
                    self._kept[key] = change
            changes.append(change)
        return changes


def _at_rest_of(scene: Scene) -> LineAtRest:
    return line_at_rest(problem_of(scene), mesh_of(scene))
