"""Parameters of a case from a measurement: least squares with priors, by Levenberg-Marquardt.

The sum of squares of data residuals, made independent, and of the parameters' distances from the
means of their priors in deviations of these is made least: the most probable parameters under
normal distributions. The Jacobian is that of the march's tangents.

A march under changed parameters is compared as the passage was measured: filtered, and at the same
places.

Source: A. Tarantola, *Inverse Problem Theory* (2005), section 3.2; J. J. Moré, *The
Levenberg-Marquardt algorithm* (1978), which SciPy's MINPACK follows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import OptimizeResult, least_squares

from catenary.base.errors import CatenaryError, InputError
from catenary.cases.run.at_rest import sound_rest
from catenary.cases.scene.scene import Scene, problem_of
from catenary.cases.studies.measured import read_table
from catenary.cases.studies.parameters.derivatives import change_by, parts_of
from catenary.cases.studies.parameters.measurement import (
    FORCE,
    HEIGHT,
    UNITS,
    Measurement,
    Signal,
    Task,
)
from catenary.cases.studies.parameters.parameters import ChangedScenes, Parameter
from catenary.cases.studies.parameters.posterior import (
    Judged,
    Posterior,
    innovations_of,
    is_doubtful,
    judge,
    posterior_of,
)
from catenary.postproc.evaluate.filters import check_sampling
from catenary.postproc.evaluate.wording import counted
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.tangents.march import Tangents, march_with_tangents
from catenary.solver.tangents.set_up import Change, SetUp, set_up_of

# The search ends when a step makes the sum of squares, which is near the number n of samples, less
# by less than this part. What is left of the sum is the squared distance to the best parameters in
# posterior deviations: some 0.01 of n = 100.
_TOLERANCE = 1e-4
_MOST_MARCHES = 60  # of a search
_SEED = 0  # of the draws from which further searches start
# Means of a signal and of its march differ by such a factor only if columns or units, whose factors
# are 10 to 1000, are not as stated, or by a zero of so many deviations of its bias.
_OTHER_UNIT, _LARGE_BIAS = 8.0, 5.0
_SEARCHES_IN_DOUBT = 3  # where the task names no number and the first leaves an unlikely residual


class Unknown(NamedTuple):
    """Parameter that is identified, or a bias of the data, with its prior.

    Attributes
    ----------
    name : a key of the scene, or "bias of ..."
    unit : of the values
    mean, deviation : of the prior
    parameter : of the scene, None of a bias
    """

    name: str
    unit: str
    mean: float
    deviation: float
    parameter: Parameter | None = None


@dataclass(frozen=True)
class Identification:
    """Parameters found from a measurement.

    Attributes
    ----------
    unknowns : (m) parameters of the scene, then biases of signals
    values : (m,) found
    posterior : their uncertainty, in deviations of the priors
    place : (n,) of the samples of each signal [m]
    signals : that were measured
    modelled : of each signal the samples (n,) of the march that was found, without biases
    by_priors, marched : of each signal places and values (2, k) of the steps of the march with the
        means of the priors, and of the march that was found, without biases
    judged : the residuals of each signal and of "all"
    n_marches, n_jacobians : how many were made
    sums : least sum of squares of each search that came to an end, the best first
    has_converged : whether the search ended by itself
    """

    unknowns: list[Unknown]
    values: np.ndarray
    posterior: Posterior
    place: np.ndarray
    signals: list[Signal]
    modelled: list[np.ndarray]
    by_priors: list[np.ndarray]
    marched: list[np.ndarray]
    judged: dict[str, Judged]
    n_marches: int
    n_jacobians: int
    sums: list[float]
    has_converged: bool

    @property
    def widths(self) -> np.ndarray:
        """Posterior standard deviations (m,) in the units of the unknowns."""
        return self.posterior.widths * np.array([one.deviation for one in self.unknowns])

    @property
    def biases(self) -> list[float]:
        """Constant that was found in each signal [N or m], zero where none was looked for."""
        by_name = dict(zip((one.name for one in self.unknowns), self.values, strict=True))
        return [one.factor * float(by_name.get(_bias_of(one.name), 0.0)) for one in self.signals]


def identify(
    scene: Scene,
    measured: Path | pd.DataFrame,
    task: Task,
    comm: Any,
    progress: Callable[[str], None] = lambda line: None,
) -> Identification:
    """Find parameters of a scene from a measurement. Not collective: one process.

    Parameters
    ----------
    scene : checked
    measured : CSV file, or the table of one
    task : description of its columns, and the parameters to be identified
    comm : mpi4py communicator of this process alone
    progress : called with a line on each march and search

    Raises
    ------
    InputError
        If file, task and scene do not fit together, or if a march has no derivatives.
    RunBroken
        If a march breaks.
    """
    check_sampling(scene.numerics.dt_s, task.measured.filter_Hz)
    scenes = ChangedScenes(scene)
    sought, measurement = _sought(scenes, task), _measurement(scene, measured, task)
    march = FittedMarch(scenes, sought, measurement, comm, progress)
    searches = _searches(march, task.starts, progress)
    found, unknowns = searches[0], march.unknowns
    march.residual(found.x)  # the march that was found
    deviations = np.array([one.deviation for one in unknowns])
    return Identification(
        unknowns,
        np.array([one.mean for one in unknowns]) + found.x * deviations,
        posterior_of(march.jacobian(found.x)),
        measurement.place,
        measurement.signals,
        march.modelled,
        march.by_priors,
        march.marched,
        march.judged(found),
        march.n_marches,
        march.n_jacobians,
        [2.0 * one.cost for one in searches],
        bool(found.status > 0),
    )


def _searches(
    march: FittedMarch, starts: int | None, progress: Callable[[str], None]
) -> list[OptimizeResult]:
    """Searches from the priors' means and from draws of the priors, the best first.

    Droppers that slacken make kinks, between which a search may be caught. A draw whose line cannot
    hang, or whose march breaks, is left out.
    """
    m = len(march.unknowns)
    rng, found = np.random.default_rng(_SEED), [_search(march, np.zeros(m))]
    if starts is None:
        starts = _SEARCHES_IN_DOUBT if is_doubtful(march.judged(found[0])) else 1
    if starts > 1:
        progress(f"search 1 of {starts}: sum of squares {2.0 * found[0].cost:.1f}")
    for number in range(2, starts + 1):
        try:
            found.append(_search(march, rng.normal(size=m)))
        except CatenaryError as error:
            progress(f"search {number} of {starts} broke: {error}")
            continue
        progress(f"search {number} of {starts}: sum of squares {2.0 * found[-1].cost:.1f}")
    return sorted(found, key=lambda one: float(one.cost))


def _search(march: FittedMarch, start: np.ndarray) -> OptimizeResult:
    return least_squares(
        lambda at: np.concatenate([march.residual(at), at]),
        start,
        lambda at: np.concatenate([-march.jacobian(at), np.eye(start.size)]),
        method="lm",
        ftol=_TOLERANCE,
        xtol=_TOLERANCE,
        gtol=_TOLERANCE,
        max_nfev=_MOST_MARCHES,
    )


def _refuse_other_units(signals: Sequence[Signal], expected: Sequence[np.ndarray]) -> None:
    """Refuse signals that are so far from the march of the priors as ones in another unit are."""
    for one, modelled in zip(signals, expected, strict=True):
        own, by_priors = float(one.values.mean()), float(modelled.mean())
        if by_priors / _OTHER_UNIT < own < by_priors * _OTHER_UNIT:
            continue
        if abs(own - by_priors) > _LARGE_BIAS * one.bias:
            unit = UNITS[one.name]
            raise InputError(
                f"the measured {one.name} is {own:.4g} {unit} on average, and that of the march "
                f"with the priors' means {by_priors:.4g} {unit}: check column, unit and zero of "
                f"measured.{one.name.replace(' ', '_')}"
            )


def _measurement(scene: Scene, measured: Path | pd.DataFrame, task: Task) -> Measurement:
    problem = problem_of(scene)
    train, number = problem.train, task.measured.pantograph
    if number > len(train.placements):
        raise InputError(
            f"measured.pantograph is {number}; it must be from 1 to {len(train.placements)}, the "
            "number of pantographs of the scene's train"
        )
    start = train.start - train.placements[number - 1].behind
    table, name = measured, "the measurement"
    if isinstance(measured, Path):
        table, name = read_table(measured), str(measured)
    return Measurement(table, name, task.measured, train.speed, start, problem.evaluation)


def _bias_of(signal: str) -> str:
    return f"bias of {signal}"


def _origin(parameter: Parameter) -> float:
    """The value from which a parameter is counted: its own, of a list zero."""
    return parameter.values[0] if len(parameter.values) == 1 else 0.0


def _sought(scenes: ChangedScenes, task: Task) -> list[Unknown]:
    """The parameters of the scene that are looked for, and their priors."""
    found = []
    for number, one in enumerate(task.parameters):
        parameter = scenes.parameter(one.key, f"in parameters.{number}.key of the task")
        if one.mean is not None and len(parameter.values) > 1:
            raise InputError(
                f"parameters.{number}.mean must be left out: {one.key} is a list whose entries "
                "change together from the scene's values"
            )
        mean = _origin(parameter) if one.mean is None else one.mean
        found.append(Unknown(one.key, parameter.unit, mean, one.deviation, parameter))
    of_shape = []
    if task.droppers is not None:
        of_shape.append((scenes.droppers_of(task.droppers.spans), task.droppers.deviation_mm))
    if task.heights is not None:
        of_shape.append((scenes.heights_at(task.heights.supports), task.heights.deviation_mm))
    for several, deviation in of_shape:
        found += [Unknown(own.key, own.unit, own.values[0], deviation, own) for own in several]
    keys = [one.name for one in found]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"the task names {key} twice; name it once")
    return found


class FittedMarch:
    """The march of a scene whose parameters are changed, compared with a measurement.

    Residuals and Jacobians are in deviations of noise and priors. Not collective: one process.

    Attributes
    ----------
    unknowns : parameters of the scene, and biases of the signals
    modelled : of each signal the samples (n,) of the latest march, without biases
    by_priors, marched : of each signal places and values (2, k) of the steps of the first march,
        with the priors' means, and of the latest one
    n_marches, n_jacobians : how many were made

    Parameters
    ----------
    scenes : the scene, unchanged
    sought : m parameters of it
    measurement : which samples of a march are compared
    comm : mpi4py communicator of this process alone
    progress : called with a line on each march
    """

    def __init__(
        self,
        scenes: ChangedScenes,
        sought: Sequence[Unknown],
        measurement: Measurement,
        comm: Any,
        progress: Callable[[str], None] = lambda line: None,
    ) -> None:
        self._scenes, self._measurement, self._comm = scenes, measurement, comm
        self._progress, self._signals = progress, measurement.signals
        self._parameters = [one.parameter for one in sought if one.parameter is not None]
        origins = [_origin(one) for one in self._parameters]
        self._offsets = np.array([one.mean for one in sought]) - origins
        self._deviations = np.array([one.deviation for one in sought])
        biased = [number for number, one in enumerate(self._signals) if one.bias]
        self.unknowns = [*sought]
        for one in (self._signals[number] for number in biased):
            self.unknowns.append(Unknown(_bias_of(one.name), one.unit, 0.0, one.bias / one.factor))
        # Derivatives of all samples of a signal by the unknowns that are biases.
        self._by_bias = np.zeros((len(self._signals), len(self.unknowns)))
        self._by_bias[biased, len(sought) :] = np.diag([self._signals[k].bias for k in biased])
        self._kept: dict[str, Change] = {}
        self.n_marches, self.n_jacobians = 0, 0
        self.modelled: list[np.ndarray] = []
        self.by_priors: list[np.ndarray] = []
        self.marched: list[np.ndarray] = []
        # Searches ask for the latest ones several times.
        self._residual = lru_cache(1)(self._made_residual)
        self._jacobian = lru_cache(1)(self._made_jacobian)

    def residual(self, at: np.ndarray) -> np.ndarray:
        """Measured less modelled samples of all signals, made independent.

        Raises InputError if the scene refuses the values, RunBroken if the march breaks.
        """
        return self._residual(at.tobytes())

    def jacobian(self, at: np.ndarray) -> np.ndarray:
        """Derivatives of the modelled samples, made independent."""
        return self._jacobian(at.tobytes())

    def judged(self, found: OptimizeResult) -> dict[str, Judged]:
        """Residuals of each signal and of "all" where a search came to."""
        n = len(found.fun) - len(self.unknowns)
        own = n // len(self._signals)
        moved = innovations_of(found.fun[:n], -found.jac[:n], found.x)
        names = {one.name: slice(k * own, (k + 1) * own) for k, one in enumerate(self._signals)}
        return judge(moved, names)

    def derivatives(self, by: Sequence[float]) -> list[np.ndarray]:
        """Derivatives (n, m) of the samples of each signal by the parameters, per their units,
        which are changed ``by`` (m,) in these.

        Raises InputError if a parameter is none that a march can be differentiated by.
        """
        scene = self._changed(by)
        at_rest = sound_rest(scene)
        now = set_up_of(self._comm, at_rest)
        changes = self._changes(ChangedScenes(scene), at_rest, now)
        parts = []
        for part in parts_of(changes, at_rest, now):
            marched = march_with_tangents(self._comm, at_rest, changes[part])
            own = {FORCE: marched.by_force, HEIGHT: marched.by_head_height}
            parts.append(self._of_march(marched, own, self._measurement.of_march))
        return [np.concatenate(own, axis=1) for own in zip(*parts, strict=True)]

    def _made_residual(self, key: bytes) -> np.ndarray:
        at = np.frombuffer(key)
        self.n_marches += 1
        at_rest = sound_rest(self._changed(self._by(at)))
        marched = march_with_tangents(self._comm, at_rest, [])
        own = {FORCE: marched.force, HEIGHT: marched.head_height}
        self.modelled = self._of_march(marched, own, self._measurement.of_march)
        self.marched = self._of_march(marched, own, self._measurement.curve_of_march)
        if not self.by_priors:
            self.by_priors = self.marched
            _refuse_other_units(self._signals, self.modelled)
        of_all = zip(self._signals, self.modelled, self._by_bias @ at, strict=True)
        found = np.concatenate(
            [one.whitening.of(one.values - modelled - bias) for one, modelled, bias in of_all]
        )
        self._progress(f"march {self.n_marches}: sum of squares {found @ found + at @ at:.1f}")
        return found

    def _made_jacobian(self, key: bytes) -> np.ndarray:
        self.n_jacobians += 1
        m, n = self._offsets.size, self._measurement.place.size
        found = [np.tile(by_bias, (n, 1)) for by_bias in self._by_bias]
        if m:
            self._progress(f"derivatives by {counted(m, 'parameter')}")
            by = self.derivatives(self._by(np.frombuffer(key)))
            for columns, own in zip(found, by, strict=True):
                columns[:, :m] = own * self._deviations
        whitened = zip(self._signals, found, strict=True)
        return np.concatenate([one.whitening.of(columns) for one, columns in whitened])

    def _of_march(
        self,
        marched: Tangents,
        values: Mapping[str, np.ndarray],
        taken: Callable[[np.ndarray, np.ndarray, float], np.ndarray],
    ) -> list[np.ndarray]:
        """What is ``taken`` of the values of a march, (n_steps, ..., n_pantographs), for each
        signal."""
        number = self._measurement.pantograph
        position = marched.position[:, number]
        return [taken(position, values[one.name][..., number], marched.dt) for one in self._signals]

    def _by(self, at: np.ndarray) -> list[float]:
        """Changes of the parameters of the scene, in their units."""
        return list(self._offsets + self._deviations * at[: self._offsets.size])

    def _changed(self, by: Sequence[float]) -> Scene:
        try:
            return self._scenes.all_changed(list(zip(self._parameters, by, strict=True)))
        except InputError as error:
            raise InputError(
                f"the search comes to a value that the scene refuses: {error}; mean or "
                "deviation of its prior may be too large"
            ) from error

    def _changes(self, scenes: ChangedScenes, at_rest: LineAtRest, now: SetUp) -> list[Change]:
        """Derivatives of the set-up. Those in which the line at rest is linear are kept from the
        first ones."""
        changes = []
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
