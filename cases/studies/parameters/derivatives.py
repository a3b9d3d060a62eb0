"""Sensitivities of a case: its statistics by one march, its line at rest; as tables and text.

Statistics, and the shape and elasticity of a span at rest, are differentiated by parameters of the
scene.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.run.at_rest import sound_rest
from catenary.cases.scene.scene import Scene, problem_of
from catenary.cases.studies.parameters.parameters import ChangedScenes, Parameter, parameters_of
from catenary.cases.terminal.terminal_text import RunsBar, elasticity_text
from catenary.meshgen.wires import Role
from catenary.postproc.evaluate import filters, statistics
from catenary.postproc.evaluate.statistics import ForceDerivatives, covers
from catenary.postproc.files.header import places_on_train
from catenary.postproc.report.study_table import Column, StudyTable
from catenary.solver.model.model import same_matrices
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.tangents.march import Tangents, march_with_tangents
from catenary.solver.tangents.set_up import (
    Change,
    SetUp,
    derivative,
    differentiate,
    set_up_of,
)

T = TypeVar("T")
# Memory for derivatives of all steps; for further parameters the march is made again [B].
_BYTES = 2**28
_MM = 1e3  # in a metre
# Half of the last digit of the last column, which has one more than others.
_SEEN = 0.5e-4
_BY_PERCENT = "std_change_by_percent_N"
_FORCES = {
    "mean_change_N": ("mean", "mean [N]"),
    "std_change_N": ("std", "sigma [N]"),
    "stat_max_change_N": ("stat_max", ""),
    "stat_min_change_N": ("stat_min", "stat. min [N]"),
    "max_change_N": ("maximum", ""),
    "min_change_N": ("minimum", "least [N]"),
}
# Half of the last digit of a height's change [mm]: a smaller one is round-off, which has no place.
_SEEN_HEIGHT_MM = 0.5e-3
# Changes of height are equal within this share: differences of found forms agree to some 1e-8.
_EQUAL = 1e-6


@dataclass
class Sensitivity:
    """A case differentiated by m parameters.

    Attributes
    ----------
    names : of the pantographs
    statistics : "mean", "std", "max" and "min" of the force of each of them below 20 Hz in the
        evaluated stretch [N]
    max_uplift : largest uplift of evaluated arms [m], NaN if there are none
    n_steps : of the march
    step_m : what it runs in a step
    contact_switches, link_switches : see ``Tangents``
    parameters : by which it was differentiated
    by_force : for each pantograph, derivatives (m,) of its statistics per unit of a parameter's key
    by_uplift : (m,) that of the largest uplift [m]
    left_out : keys of usual parameters by which it cannot be differentiated, and why
    """

    names: list[str]
    statistics: list[dict[str, float]]
    max_uplift: float
    n_steps: int
    step_m: float
    contact_switches: int
    link_switches: int
    parameters: list[Parameter]
    by_force: list[ForceDerivatives]
    by_uplift: np.ndarray
    left_out: dict[str, str]


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
    by_force, by_uplift = [], []
    steps = 2 * len(parameters) if shows else 0
    with RunsBar(steps, lambda line: None, what="set-ups and tangents") as bar:

        def change(parameter: Parameter) -> Change:
            try:
                return change_by(parameter, scenes, at_rest, now, comm)
            finally:
                bar.ended()

        kept, changes, left_out = _by_each(parameters, change, bool(keys) or droppers)
        for part in parts_of(changes, at_rest, now):
            marched = march_with_tangents(comm, at_rest, changes[part])
            figures, by_part = _forces(marched, at_rest)
            by_force.append(by_part)
            by_uplift.append(statistics.largest_derivatives(marched.uplift, marched.by_uplift))
            bar.ended(len(changes[part]))
    order = np.argsort([place.behind for place in at_rest.problem.train.placements], kind="stable")
    names = places_on_train(len(order))
    return Sensitivity(
        [names[place] for place in np.argsort(order)],
        figures,
        float(marched.uplift.max()) if marched.uplift.size else float("nan"),
        len(marched.force),
        marched.speed * marched.dt,
        marched.contact_switches,
        marched.link_switches,
        kept,
        [
            ForceDerivatives(*map(np.concatenate, zip(*own, strict=True)))
            for own in zip(*by_force, strict=True)
        ],
        np.concatenate(by_uplift),
        left_out,
    )


def _by_each(
    parameters: Sequence[Parameter], derive: Callable[[Parameter], T], named: bool
) -> tuple[list[Parameter], list[T], dict[str, str]]:
    """The parameters by which ``derive`` finds something, and that; keys of others, and why it
    finds nothing by them, which of ``named`` ones is raised."""
    kept, found, left_out = [], [], {}
    for parameter in parameters:
        try:
            found.append(derive(parameter))
        except InputError as error:
            if named:
                raise
            left_out[parameter.key] = str(error)
        else:
            kept.append(parameter)
    return kept, found, left_out


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


def _forces(
    marched: Tangents, at_rest: LineAtRest
) -> tuple[list[dict[str, float]], list[ForceDerivatives]]:
    """Statistics of the force of each pantograph, and their derivatives."""
    # The filter meets both ends of a record: a run's begins a step earlier, without a force.
    back, by_position = marched.speed * marched.dt, marched.by_position
    positions = np.concatenate([marched.position[:1] - back, marched.position])
    forces, by_forces = (
        np.concatenate([np.zeros_like(own[:1]), own]) for own in (marched.force, marched.by_force)
    )
    by_places = np.concatenate([2.0 * by_position[:1] - by_position[1:2], by_position])
    by_places /= marched.speed
    first, last = at_rest.problem.evaluation
    figures, derivatives = [], []
    for number, (position, force) in enumerate(zip(positions.T, forces.T, strict=True)):
        if not covers(position, (first, last)):
            raise InputError(
                f"a pantograph runs from {position[0]:.0f} to {position[-1]:.0f} m, and not "
                f"through the evaluation stretch from {first:.0f} to {last:.0f} m"
            )
        within = (position >= first) & (position <= last)
        evaluated = filters.low_pass(force, marched.dt)[within]
        names = ("mean", "std", "max", "min")
        figures.append({name: float(getattr(evaluated, name)()) for name in names})
        by_force, by_place = by_forces[:, :, number], by_places[:, :, number]
        derivatives.append(
            statistics.force_derivatives(force, by_force, within, marched.dt, by_place)
        )
    return figures, derivatives


def table_of(found: Sensitivity) -> StudyTable:
    """A row for each parameter and pantograph; first what changes the standard deviation most.

    Figures are changes of the statistics under ``change`` of the parameter, in the unit of its key;
    the last one is that of the standard deviation under a hundredth of the parameter. Both decide
    the order: the latter, or the former of a parameter that is zero.
    """
    several = len(found.names) > 1
    columns = [
        Column("parameter", "parameter"),
        Column("shown", "value", ">", in_files=False),
        Column("value"),
        Column("unit", "unit"),
        Column("pantograph", "pantograph" if several else ""),
        Column("change", "change", ".4g"),
        *(Column(name, head, "+.3f") for name, (_, head) in _FORCES.items()),
        Column("max_uplift_change_mm", "uplift [mm]", "+.3f"),
        Column(_BY_PERCENT, "sigma by 1 % [N]", "+.4f"),
    ]

    def weight(rows: list[dict[str, Any]]) -> float:
        ranked = "std_change_N" if rows[0][_BY_PERCENT] is None else _BY_PERCENT
        return max(abs(row[ranked]) for row in rows)

    ranked = sorted(_rows(found), key=weight, reverse=True)
    return StudyTable(columns, [row for rows in ranked for row in rows])


def _rows(found: Sensitivity) -> list[list[dict[str, Any]]]:
    """Of each parameter a row for each pantograph."""
    every = []
    for number, parameter in enumerate(found.parameters):
        change, uplift = parameter.change, float(found.by_uplift[number])
        moved = None if np.isnan(uplift) else change * uplift * _MM
        head = {**parameter.cells, "max_uplift_change_mm": moved}
        rows = []
        for name, by_force in zip(found.names, found.by_force, strict=True):
            by = {of: float(own[number]) for of, own in by_force._asdict().items()}
            percent = 0.01 * parameter.size * by["std"] if parameter.size else None
            changes = {column: change * by[of] for column, (of, _) in _FORCES.items()}
            rows.append({**head, "pantograph": name, **changes, _BY_PERCENT: percent})
        every.append(rows)
    return every


def as_text(found: Sensitivity) -> str:
    """Text for the terminal: the statistics, the table, and the limits of the derivatives."""
    lines = []
    for name, own in zip(found.names, found.statistics, strict=True):
        lines.append(
            f"{name}: mean {own['mean']:.2f} N, sigma {own['std']:.2f} N, "
            f"statistical minimum {own['mean'] - 3.0 * own['std']:.1f} N, "
            f"least {own['min']:.1f} N, largest {own['max']:.1f} N"
        )
    if not np.isnan(found.max_uplift):
        lines.append(f"largest uplift {found.max_uplift * _MM:.1f} mm")
    lines += ["", "Changes of these under a change of each parameter:", table_of(found).text(), ""]
    lines += _idle(found)
    lines += [_kinks(found), *_early(found)]
    for key, why in found.left_out.items():
        lines.append(f"{key} is left out: {why}")
    return "\n".join(lines)


def _idle(found: Sensitivity) -> list[str]:
    """A sentence on the parameters whose rows have nothing but zeros."""
    figures = [*_FORCES, "max_uplift_change_mm", _BY_PERCENT]
    idle = [
        rows[0]["parameter"]
        for rows in _rows(found)
        if all(abs(row[name] or 0.0) < _SEEN for row in rows for name in figures)
    ]
    return [f"Without effect in the digits above: {', '.join(idle)}.\n"] if idle else []


def _kinks(found: Sensitivity) -> str:
    contacts, links = found.contact_switches, found.link_switches
    return (
        f"In {found.n_steps} steps contacts opened or closed {contacts} times and droppers or "
        f"other links switched {links} times. Derivatives hold for changes that leave all of these "
        "in their steps; those of least and largest values also require that these stay at their "
        "step and arm. Larger changes add the effect of the switches that move."
    )


def _early(found: Sensitivity) -> list[str]:
    """Sentences on parameters that move the train along the track, and so all switches at once."""
    sentences = []
    for one in found.parameters:
        # By so much the train is a step farther at the end of the march.
        if one.key == "train.speed_km_h":
            least = one.size / found.n_steps
        elif one.key == "train.start_m":
            least = found.step_m
        else:
            continue
        sentences.append(
            f"{one.key} already moves some of these by {least:.1g} {one.unit}: for larger "
            "changes its derivative may be wrong in size and even in sign. Run variants of it "
            "(`catenary sweep`)."
        )
    return sentences


@dataclass(frozen=True)
class RestSensitivity:
    """Shape and elasticity of the span in the middle of a line, differentiated by m parameters.

    Attributes
    ----------
    wires : names of the w contact wires
    x : (n,) places of their nodes along the track, ascending [m]
    height : (n, w) of the wires at rest above the rail, NaN where a wire is not [m]
    elasticity : (n,) lift of a head that touches all of them by a unit force [m/N]
    parameters : by which the line was differentiated
    by_height, by_elasticity : (m, n, w) and (m, n) derivatives per unit of each parameter's key
    left_out : keys of usual parameters by which it cannot be differentiated, and why
    """

    wires: list[str]
    x: np.ndarray
    height: np.ndarray
    elasticity: np.ndarray
    parameters: list[Parameter]
    by_height: np.ndarray
    by_elasticity: np.ndarray
    left_out: dict[str, str]

    @property
    def by_non_uniformity(self) -> np.ndarray:
        """Derivatives (m,) of the non-uniformity (max - min) / (max + min) of the elasticity."""
        low, high = self.elasticity.argmin(), self.elasticity.argmax()
        least, most = self.elasticity[low], self.elasticity[high]
        by_least, by_most = self.by_elasticity[:, low], self.by_elasticity[:, high]
        return np.asarray(2.0 * (least * by_most - most * by_least) / (most + least) ** 2)


def rest_sensitivity_of(
    scene: Scene, keys: Sequence[str], *, droppers: bool = False
) -> RestSensitivity:
    """Differentiate the line of a scene at rest. Not collective.

    Lines at rest with the parameter a little lower and higher are compared.

    Parameters
    ----------
    scene : checked
    keys : of the parameters; the usual ones of the line if there are none and ``droppers`` is not
        set
    droppers : whether the length of each dropper in the evaluated stretch is a parameter

    Raises
    ------
    InputError
        If the line cannot hang, or by a parameter that was named.
    """
    scenes = ChangedScenes(scene)
    named = bool(keys) or droppers
    at_rest = sound_rest(scene)
    now = _rest_numbers(at_rest)
    parameters = [
        one for one in parameters_of(scenes, keys, droppers) if named or not one.is_of_train
    ]
    parameters, found, left_out = _by_each(
        parameters, lambda one: _rest_derivative(one, scenes, at_rest), named
    )
    derivatives = np.array(found).reshape(-1, *now.shape)
    if not named:  # damping changes nothing at rest
        moves = np.nan_to_num(derivatives).any(axis=(1, 2))
        parameters = [one for one, does in zip(parameters, moves, strict=True) if does]
        derivatives = derivatives[moves]
    return RestSensitivity(
        [wire.name for wire in at_rest.problem.line.wires_of(Role.CONTACT)],
        at_rest.lift.x,
        now[:, :-1],
        now[:, -1],
        parameters,
        derivatives[..., :-1],
        derivatives[..., -1],
        left_out,
    )


def _rest_numbers(at_rest: LineAtRest) -> np.ndarray:
    """Heights of the contact wires and elasticity at the places of the latter, (n, w + 1)."""
    mesh, x = at_rest.mesh, at_rest.lift.x
    columns = [
        np.interp(x, mesh.x(nodes), at_rest.form.height[nodes], left=np.nan, right=np.nan)
        for nodes in at_rest.model.nodes_of(Role.CONTACT)
    ]
    return np.stack([*columns, at_rest.lift.lift], axis=1)


def _rest_derivative(
    parameter: Parameter, scenes: ChangedScenes, at_rest: LineAtRest
) -> np.ndarray:
    """Derivatives of ``_rest_numbers`` per unit of a parameter."""
    if parameter.is_of_train:
        raise InputError(f"{parameter.key} does not change the line at rest")
    taut = at_rest.form.dropper_force > 0.0

    def numbers(by: float) -> np.ndarray:
        rest = scenes.rest(parameter, by)
        if rest.lift.x.shape != at_rest.lift.x.shape or np.any(rest.lift.x != at_rest.lift.x):
            raise InputError(
                f"{parameter.key} moves nodes of the mesh, by which the line at rest has no "
                "derivative here; take it away"
            )
        if np.any((rest.form.dropper_force > 0.0) != taut):
            raise InputError(
                f"{parameter.key} makes a dropper slack or taut at rest, where the line has no "
                "derivative; take it away"
            )
        return _rest_numbers(rest)

    step = parameter.step
    return derivative(numbers(-step), numbers(step), step)


def along_span(found: RestSensitivity) -> StudyTable:
    """A row for each parameter, contact wire and place: changes under ``change`` of the parameter,
    in the unit of its key."""
    columns = [Column(name) for name in (
        "parameter", "unit", "change", "wire", "x_m", "height_m", "height_change_mm",
        "elasticity_mm_per_N", "elasticity_change_mm_per_N",
    )]  # fmt: skip
    rows = [
        {
            **parameter.cells,
            "wire": wire,
            "x_m": float(found.x[i]),
            "height_m": float(found.height[i, j]),
            "height_change_mm": _MM * parameter.change * float(found.by_height[m, i, j]),
            "elasticity_mm_per_N": _MM * float(found.elasticity[i]),
            "elasticity_change_mm_per_N": _MM * parameter.change * float(found.by_elasticity[m, i]),
        }
        for m, parameter in enumerate(found.parameters)
        for j, wire in enumerate(found.wires)
        for i in np.flatnonzero(np.isfinite(found.height[:, j])).tolist()
    ]
    return StudyTable(columns, rows)


def _rest_table(found: RestSensitivity) -> StudyTable:
    """A row for each parameter: what it changes most in the span; the largest change first."""
    columns = [
        Column("parameter", "parameter"),
        Column("shown", "value", ">"),
        Column("unit", "unit"),
        Column("change", "change", ".4g"),
        Column("height", "height [mm]", "+.3f"),
        Column("at", "at [m]", ".1f"),
        Column("mean", "mean elasticity [%]", "+.4f"),
        Column("non_uniformity", "non-uniformity [%]", "+.4f"),
    ]
    rows = []
    for m, parameter in enumerate(found.parameters):
        moved = np.nan_to_num(found.by_height[m])
        # The first of equal ones: a span may be symmetric, but for round-off.
        largest = np.abs(moved) >= (1.0 - _EQUAL) * np.abs(moved).max()
        place, wire = np.argwhere(largest)[0]
        change = parameter.change
        height = _MM * change * float(moved[place, wire])
        rows.append(
            {
                **parameter.cells,
                "height": height,
                "at": float(found.x[place]) if abs(height) >= _SEEN_HEIGHT_MM else None,
                "mean": 100.0
                * change
                * float(found.by_elasticity[m].sum() / found.elasticity.sum()),
                "non_uniformity": 100.0 * change * float(found.by_non_uniformity[m]),
            }
        )
    return StudyTable(columns, sorted(rows, key=lambda row: -abs(row["height"])))


def rest_text(found: RestSensitivity) -> str:
    """Text for the terminal: the span as it is, and what each parameter changes."""
    lines = [
        elasticity_text(found.x, found.elasticity),
        "",
        "Changes under a change of each parameter; of the height the largest:",
        _rest_table(found).text(),
    ]
    lines += [f"{key} is left out: {why}" for key, why in found.left_out.items()]
    return "\n".join(lines)
