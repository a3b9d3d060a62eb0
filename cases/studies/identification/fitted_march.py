"""A march under changed parameters as measured, and its derivatives by these."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.run.prepared import sound_rest
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.identification.measurement import FORCE, Measurement
from catenary.cases.studies.sensitivity.parameters import ChangedScenes, Parameter
from catenary.cases.studies.sensitivity.study import change_by, parts_of
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.tangents.march import Tangents, march_with_tangents
from catenary.solver.tangents.set_up import Change, SetUp, set_up_of


class FittedMarch:
    """Marches of a scene whose parameters are changed. Not collective: one process.

    Parameters
    ----------
    scenes : the scene, unchanged
    parameters : m of it
    measurement : which samples of a march are compared
    comm : mpi4py communicator of this process alone
    """

    def __init__(
        self,
        scenes: ChangedScenes,
        parameters: Sequence[Parameter],
        measurement: Measurement,
        comm: Any,
    ) -> None:
        self._scenes, self._parameters = scenes, parameters
        self._measurement, self._comm = measurement, comm
        self._kept: dict[str, Change] = {}

    def values(self, by: Sequence[float]) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Samples (n,) of each signal, with the parameters changed ``by`` (m,) in their units, and
        the places and values (2, k) of its steps between them.

        Raises
        ------
        InputError
            If the scene refuses these values.
        RunBroken
            If the march breaks.
        """
        marched = march_with_tangents(self._comm, self._at_rest(by), [])
        position, dt = marched.position[:, self._number], marched.dt
        of_all = [values for values, _ in self._signals(marched)]
        samples = [self._measurement.of_march(position, one, dt) for one in of_all]
        return samples, [self._measurement.curve_of_march(position, one, dt) for one in of_all]

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
        parts: list[list[np.ndarray]] = []
        for part in parts_of(changes, at_rest, now):
            marched = march_with_tangents(self._comm, at_rest, changes[part])
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
        """Values of each signal in all steps, and their derivatives (n_steps, m)."""
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
                f"the search comes to a value that the scene refuses: {error}; mean or "
                "deviation of its prior may be too large"
            ) from error

    def _at_rest(self, by: Sequence[float]) -> LineAtRest:
        return sound_rest(self._changed(by))

    def _changes(self, by: Sequence[float], at_rest: LineAtRest, now: SetUp) -> list[Change]:
        """Derivatives of the set-up. Those in which the line at rest is linear are kept from the
        first ones."""
        scenes, changes = ChangedScenes(self._changed(by)), []
        for parameter in self._parameters:
            key = parameter.key
            change = self._kept.get(key)
            if change is None:
                change = change_by(scenes.parameter(key), scenes, at_rest, now, self._comm)
                if change.start.size or change.speed:
                    raise InputError(
                        f"{key} moves the pantograph along the track: where it was is measured, "
                        "and no parameter of an identification"
                    )
                if parameter.is_of_shape:
                    self._kept[key] = change
            changes.append(change)
        return changes
