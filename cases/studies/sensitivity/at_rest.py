"""The line of a scene at rest, differentiated by its parameters: shape and elasticity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.run.prepared import sound_rest
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.sensitivity.parameters import ChangedScenes, Parameter, parameters_of
from catenary.cases.terminal.terminal_text import elasticity_text
from catenary.meshgen.wires import Role
from catenary.postproc.report.study_table import Column, StudyTable
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.tangents.set_up import derivative

_MM = 1e3
# Half of the last digit of a height's change [mm]: a smaller one is round-off, which has no place.
_SEEN = 0.5e-3


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
    left_out: dict[str, str] = field(default_factory=dict)

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
    now = _numbers(at_rest)
    parameters, found, left_out = [], [], {}
    for parameter in parameters_of(scenes, keys, droppers):
        if parameter.is_of_train and not named:
            continue
        try:
            own = _derivative(parameter, scenes, at_rest)
        except InputError as error:
            if named:
                raise
            left_out[parameter.key] = str(error)
            continue
        if named or np.nan_to_num(own).any():  # damping changes nothing at rest
            parameters.append(parameter)
            found.append(own)
    derivatives = np.array(found).reshape(-1, *now.shape)
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


def _numbers(at_rest: LineAtRest) -> np.ndarray:
    """Heights of the contact wires and elasticity at the places of the latter, (n, w + 1)."""
    mesh, x = at_rest.mesh, at_rest.lift.x
    columns = [
        np.interp(x, mesh.x(nodes), at_rest.form.height[nodes], left=np.nan, right=np.nan)
        for nodes in at_rest.model.nodes_of(Role.CONTACT)
    ]
    return np.stack([*columns, at_rest.lift.lift], axis=1)


def _derivative(parameter: Parameter, scenes: ChangedScenes, at_rest: LineAtRest) -> np.ndarray:
    """Derivatives of ``_numbers`` per unit of a parameter."""
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
        return _numbers(rest)

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
            "parameter": parameter.key,
            "unit": parameter.unit,
            "change": parameter.change,
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


def summary(found: RestSensitivity) -> StudyTable:
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
        place, wire = np.unravel_index(np.abs(moved).argmax(), moved.shape)
        change = parameter.change
        height = _MM * change * float(moved[place, wire])
        rows.append(
            {
                "parameter": parameter.key,
                "shown": parameter.text,
                "unit": parameter.unit,
                "change": change,
                "height": height,
                "at": float(found.x[place]) if abs(height) >= _SEEN else None,
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
        summary(found).text(),
    ]
    lines += [f"{key} is left out: {why}" for key, why in found.left_out.items()]
    return "\n".join(lines)
