"""Parameters of a scene: numbers that a march is differentiated by.

A parameter is a key of the scene with a number, or with a list whose entries change together; the
number of an entry may follow the key. Of a static force that depends on the speed all forces change
together, under the key of the force. The length of a single dropper has the key
``irregularities.dropper_lengths.SPAN.DROPPER``, both counted from 1, and the height of the contact
wire at a support ``irregularities.contact_wire_height.SUPPORT``, counted from 0 at the start of the
line. Between supports heights are those of a cubic spline, and droppers are cut for them.
"""

from __future__ import annotations

import copy
import fnmatch
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.base.options import option
from catenary.cases.run.at_rest import rest_of
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.input.case_files import assign, value_at
from catenary.cases.scene.input.faults import Origin, shown
from catenary.cases.scene.keys.units import length_from_mm, unit_of
from catenary.cases.scene.load import scene_from
from catenary.cases.scene.scene import Scene, line_of, problem_of, resolved
from catenary.cases.studies.sweep.variants import check_key, is_number
from catenary.meshgen.mesh import LineMesh
from catenary.solver.statics.line_at_rest import LineAtRest, SoundLine, line_at_rest, sound_line

# Patterns of the parameters that are taken if none are named, in the order in which they are taken.
USUAL = (
    "pantographs.*.static_force_N",
    "pantographs.*.masses_kg",
    "pantographs.*.bodies.*.mass_kg",
    "pantographs.*.forces.*.stiffness_N_per_m",
    "pantographs.*.forces.*.damping_N_s_per_m",
    "pantographs.*.stiffnesses_N_per_m",
    "pantographs.*.dampings_N_s_per_m",
    "contact.stiffness_N_per_m",
    "contact.damping_N_s_per_m",
    "line.*.tension_N",
    "line.*.mass_kg_per_m",
    "line.*.bending_stiffness_N_m2",
    "line.*.pre_sag_mm",
    "line.*.pre_sag_mid_mm",
    "line.*dropper.stiffness_N_per_m",
    "line.*dropper.axial_stiffness_N",
    "line.*clamp_kg",
    "line.links.*.stiffness_N_per_m",
    "line.damping.alpha_s",
    "line.damping.beta_per_s",
    "line.support.stiffness_N_per_m",
    "line.steady_arm.stiffness_N_per_m",
    "line.steady_arm.length_m",
)
# Of these each entry is a parameter, of other lists all entries together.
_BY_ENTRY = ("masses_kg", "stiffnesses_N_per_m", "dampings_N_s_per_m")
# By how much a table of changes lets a parameter change, by its unit or the end of its key; others
# by a hundredth.
_CHANGES = {"mm": 1.0, "m": 1e-3, "kg": 1.0, "km/h": 1.0}
_CHANGES_OF_FORCES = {"tension_N": 1e3, "force_N": 1.0}
# Step of the central differences by which set-ups are differentiated, in parts of the value. They
# are off by step^2, some 1e-7 of what bends most, tensions, and by round-off over the step, 1e-9 to
# 1e-7. In the length of a dropper a set-up is linear, so that round-off alone counts.
_STEP = 3e-4
_STEP_OF_SHAPE = 1e-3
# Of a height of 5 m, which moves laws of pantographs as a whole: a part of it would lead beyond
# their bends, as a limiter's. In it a set-up is linear, and known to 1e-15 m.
_STEP_OF_HEIGHT = 1e-6
# Of a place along the track [m], however far that is from the start of the line: shape functions
# bend within an element, of some 0.5 m, and are known to 1e-13 m.
_STEP_OF_PLACE = 1e-4
_PLACES = ("at_m", "from_m", "to_m", "start_m", "behind_m")
_STEP_OF_ZERO = {"mm": 0.05}
_USUAL_STEP_OF_ZERO = 1e-4
# Tables without anything of the march.
_OF_EVALUATION = ("case", "evaluation", "output")
# Tables without anything of the line.
_OF_TRAIN = ("pantographs", "train", "contact")
# The length of one dropper, which scenes have as entries of a list.
_LENGTHS = "irregularities.dropper_lengths"
_OF_DROPPER = re.compile(re.escape(_LENGTHS) + r"\.([1-9]\d{0,5})\.([1-9]\d{0,5})")
# The height of the contact wire at a support, an entry of a list as well.
_HEIGHTS = "irregularities.contact_wire_height"
_OF_SUPPORT = re.compile(re.escape(_HEIGHTS) + r"\.(\d{1,6})")
_BY_SPEED, _FORCE = "static_force_by_speed", "static_force_N"


@dataclass(frozen=True)
class Parameter:
    """A number of a scene, or a list of numbers that change together.

    Attributes
    ----------
    key : dotted, with the number of an entry where it is one of a list
    values : its value, or all of a list
    """

    key: str
    values: tuple[float, ...]

    @property
    def unit(self) -> str:
        """Unit that the key names, mm for the length of a dropper and the height at a support."""
        return "mm" if self.is_of_shape else unit_of(self.key)

    @property
    def size(self) -> float:
        """The largest value without its sign."""
        return max(map(abs, self.values))

    @property
    def is_of_shape(self) -> bool:
        """Whether it is the length of a single dropper or the height at a support, in which the
        line at rest is linear."""
        return any(one.fullmatch(self.key) for one in (_OF_DROPPER, _OF_SUPPORT))

    @property
    def is_length(self) -> bool:
        """Whether it is the length of a single dropper."""
        return bool(_OF_DROPPER.fullmatch(self.key))

    @property
    def is_of_train(self) -> bool:
        """Whether it leaves the line at rest as it is."""
        return self.key.split(".")[0] in _OF_TRAIN

    @property
    def step(self) -> float:
        """Step by which it is changed to differentiate set-ups, in its unit."""
        if self.is_of_shape:
            return max(_STEP_OF_SHAPE * self.size, _STEP_OF_ZERO["mm"])
        if self.key.endswith("nominal_height_m"):
            return _STEP_OF_HEIGHT
        parts = self.key.split(".")
        if parts[-1] in _PLACES and parts[0] != "pantographs":
            return _STEP_OF_PLACE
        if self.size > 0.0:
            return _STEP * self.size
        return _STEP_OF_ZERO.get(self.unit, _USUAL_STEP_OF_ZERO)

    @property
    def change(self) -> float:
        """Change of it that a table shows: a millimetre, kilogram or newton, a kilonewton of
        tension, or a hundredth of itself."""
        for end, by in _CHANGES_OF_FORCES.items():
            if self.key.endswith(end) and by < self.size:
                return by
        return _CHANGES.get(self.unit, 0.01 * self.size or 1.0)

    @property
    def cells(self) -> dict[str, Any]:
        """What tables of changes say of it, its value as people read it under "shown"."""
        one = len(self.values) == 1
        return {
            "parameter": self.key,
            "shown": f"{self.values[0]:g}" if one else f"{len(self.values)} values",
            "value": self.values[0] if one else [*self.values],
            "unit": self.unit,
            "change": self.change,
        }


class ChangedScenes:
    """Scenes with one parameter changed. Not collective.

    Their windows do not move, as steps of a part of the line have no derivatives, and numbers may
    be unusual ones.

    Parameters
    ----------
    scene : the checked one
    """

    def __init__(self, scene: Scene) -> None:
        self._raw = resolved(scene)
        self._raw.pop("window", None)
        self._raw["case"]["accept_unusual"] = True
        self.scene = self._checked(self._raw)

    def changed(self, parameter: Parameter, by: float) -> Scene:
        """The scene with all values of a parameter changed ``by`` a number."""
        return self.all_changed([(parameter, by)])

    def all_changed(self, changes: Sequence[tuple[Parameter, float]]) -> Scene:
        """The scene with several parameters changed, each by a number."""
        raw = dict(self._raw)
        for parameter, by in changes:
            key, value = _changed(raw, self.scene, parameter, by)
            assign(raw, key, value)
            if parameter.is_of_shape:
                assign(raw, f"effects.{key.split('.')[1]}", True)
        return self._checked(raw)

    def rest(self, parameter: Parameter, by: float) -> LineAtRest:
        """The line at rest with all values of a parameter changed ``by`` a number.

        Lines that differ in the length of a dropper hang near the same sound line.

        Raises
        ------
        InputError
            If there is none, or the scene refuses the change.
        """
        changed = self.changed(parameter, by)
        if not parameter.is_length:
            return rest_of(changed)
        mesh, sound = self._sound
        return line_at_rest(problem_of(changed), mesh, sound)

    @cached_property
    def _sound(self) -> tuple[LineMesh, SoundLine]:
        """Mesh of the line, and the line for which droppers are cut."""
        mesh = mesh_of(self.scene)
        return mesh, sound_line(problem_of(self.scene), mesh)

    def parameter(self, key: str, where: str = "") -> Parameter:
        """The parameter of a key; ``where`` it was written, for sentences, if not as an option.

        Raises
        ------
        InputError
            If the scene has no number there or a whole one, or if a ready pantograph has it.
        """
        if dropper := _OF_DROPPER.fullmatch(key):
            return self._length_of(key, *map(int, dropper.groups()))
        if support := _OF_SUPPORT.fullmatch(key):
            return self._height_at(key, int(support[1]))
        parts = key.split(".")
        check_key(key, where or f"in {option('--parameter', 'parameters')}")
        if parts[0] == "pantographs" and len(parts) > 2:
            if self._is_ready(parts[1]):
                model = self._raw["pantographs"][parts[1]]["model"]
                raise InputError(
                    f"pantographs.{parts[1]} is the ready {model}, whose numbers stay: "
                    "write its lists in place of model (`catenary list --pantographs`)"
                )
        if parts[0] in _OF_EVALUATION:
            raise InputError(
                f"{key} does not act on the march, but on its evaluation or its files: the march "
                "has no derivative by it"
            )
        values = self._values(key)
        if values is None:
            raise InputError(
                f"{shown(key)[1:-1]} has no number in this scene by which a march could be "
                f"differentiated{self._instead(parts)}"
            )
        if any(isinstance(one, int) for one in values):
            raise InputError(f"{key} is a whole number, by which a march has no derivative")
        return Parameter(key, tuple(map(float, values)))

    def _instead(self, parts: Sequence[str]) -> str:
        """The pantographs or entries that a wrong key could name, for the end of a sentence."""
        if parts[0] == "pantographs" and parts[1:2] not in [[n] for n in self._raw["pantographs"]]:
            return f"; its pantographs are {', '.join(self._raw['pantographs'])}"
        holder = value_at(self._raw, ".".join(parts[:-1]))
        if isinstance(holder, list):
            return f"; the list there has entries from 0 to {len(holder) - 1}"
        return ""

    def droppers(self) -> list[Parameter]:
        """The length of each dropper in the evaluated stretch."""
        evaluation = self.scene.evaluation
        return [
            self.parameter(f"{_LENGTHS}.{span}.{number}")
            for (span, number), x in line_of(self.scene).numbered_droppers.items()
            if evaluation.from_m <= x <= evaluation.to_m
        ]

    def droppers_of(self, spans: Sequence[int]) -> list[Parameter]:
        """The length of each dropper in some spans, counted from 1.

        Raises
        ------
        InputError
            If the line has no such span, or no droppers in it.
        """
        line = line_of(self.scene)
        if max(spans) > line.n_spans:
            raise InputError(f"droppers.spans names span {max(spans)}: the line has {line.n_spans}")
        found = [
            self.parameter(f"{_LENGTHS}.{span}.{number}")
            for span in dict.fromkeys(spans)
            for number in range(1, len(line.droppers_of_span(span - 1)) + 1)
        ]
        if not found:
            raise InputError(f"droppers.spans names {list(spans)}: these spans have no droppers")
        return found

    def heights_at(self, supports: Sequence[int]) -> list[Parameter]:
        """The height of the contact wire at each of some supports, counted from 0.

        Raises
        ------
        InputError
            If the line has no such support, or if the scene has heights at other places.
        """
        return [self.parameter(f"{_HEIGHTS}.{number}") for number in dict.fromkeys(supports)]

    def _height_at(self, key: str, support: int) -> Parameter:
        """The height at a support that the scene adds to that of the line, mostly none."""
        heights = _heights_at_supports(self._raw, self.scene)
        if heights is None:
            raise InputError(
                f"{key} is no parameter of this scene: {_HEIGHTS}.by_place has other places than "
                "all supports"
            )
        if support >= len(heights):
            raise InputError(
                f"{key} names no support: the line has supports from 0 to {len(heights) - 1}"
            )
        return Parameter(key, (1e3 * heights[support][1],))

    def _length_of(self, key: str, span: int, number: int) -> Parameter:
        """The error of a dropper's length that the scene gives, mostly none."""
        line = line_of(self.scene)
        droppers = line.droppers_of_span(span - 1) if span <= line.n_spans else ()
        if number > len(droppers):
            raise InputError(
                f"{key} names no dropper: the line has {line.n_spans} spans"
                + (f", and {len(droppers)} droppers in this one" if span <= line.n_spans else "")
            )
        lengths = self._raw.get("irregularities", {}).get("dropper_lengths", {})
        given = lengths.get("by_dropper", [])
        own = [error for at, place, error in given if (at, place) == (span, number)]
        return Parameter(key, (float(sum(own)),))

    def usual(self) -> list[Parameter]:
        """The parameters of the scene that are taken if none are named, without those that are
        zero."""
        on_train = {place["name"] for place in self._raw["train"]["pantographs"]}
        kept = []
        for key in dict.fromkeys(self._usual_keys()):
            first, second = key.split(".")[:2]
            if first == "pantographs" and (second not in on_train or self._is_ready(second)):
                continue
            values = self._values(key)
            if values is not None and any(values):
                kept.append(Parameter(key, values))
        return kept

    def _is_ready(self, kind: str) -> bool:
        """Whether a kind of pantograph is a ready one, whose numbers the scene has not."""
        return self._raw["pantographs"].get(kind, {}).get("model") is not None

    def _usual_keys(self) -> Iterator[str]:
        every = list(_numbers(self._raw))
        for pattern in USUAL:
            for key in every:
                own = key.replace(_BY_SPEED, _FORCE)
                if not fnmatch.fnmatchcase(own, pattern):
                    continue
                values = self._values(own)
                if own.split(".")[-1] in _BY_ENTRY and values is not None:
                    yield from (f"{own}.{number}" for number in range(len(values)))
                else:
                    yield own

    def _values(self, key: str) -> tuple[float | int, ...] | None:
        above, _, place = key.rpartition(".")
        holder, value = value_at(self._raw, above), value_at(self._raw, key)
        if place == _FORCE and isinstance(holder, dict) and holder.get(_BY_SPEED):
            speeds, forces = np.array(holder[_BY_SPEED]).T
            return (float(np.interp(self._raw["train"]["speed_km_h"], speeds, forces)),)
        values = value if isinstance(value, list) else [value]
        return tuple(values) if values and all(map(is_number, values)) else None

    @staticmethod
    def _checked(raw: dict[str, Any]) -> Scene:
        return scene_from(raw, Origin("the scene", (), recorded=True), folder=Path.cwd())


def _changed(raw: dict[str, Any], scene: Scene, parameter: Parameter, by: float) -> tuple[str, Any]:
    """Key of the tables of a scene under which a parameter stands, and its value changed."""
    key = parameter.key
    above, _, last = key.rpartition(".")
    if dropper := _OF_DROPPER.fullmatch(key):
        place, key = [*map(int, dropper.groups())], f"{_LENGTHS}.by_dropper"
        others = [own for own in value_at(raw, key) or [] if own[:2] != place]
        return key, [*others, [*place, parameter.values[0] + by]]
    if support := _OF_SUPPORT.fullmatch(key):
        heights = copy.deepcopy(_heights_at_supports(raw, scene))
        assert heights is not None
        heights[int(support[1])][1] += length_from_mm(by)
        return f"{_HEIGHTS}.by_place", heights
    if last == _FORCE and (forces := value_at(raw, f"{above}.{_BY_SPEED}")):
        return f"{above}.{_BY_SPEED}", [[speed, force + by] for speed, force in forces]
    value = value_at(raw, key)
    return key, (np.array(value) + by).tolist() if isinstance(value, list) else value + by


def _heights_at_supports(raw: dict[str, Any], scene: Scene) -> list[list[float]] | None:
    """Places of all supports and heights there [m], None if the scene has others by places."""
    places = line_of(scene).support_positions.tolist()
    given = value_at(raw, f"{_HEIGHTS}.by_place") or [[x, 0.0] for x in places]
    return given if [x for x, _ in given] == places else None


def _numbers(raw: Any, prefix: str = "") -> Iterator[str]:
    """Keys of all numbers, and of all lists of what are no tables."""
    if isinstance(raw, dict):
        for name, value in raw.items():
            yield from _numbers(value, f"{prefix}.{name}" if prefix else str(name))
    elif isinstance(raw, list) and raw and isinstance(raw[0], dict):
        for number, value in enumerate(raw):
            yield from _numbers(value, f"{prefix}.{number}")
    elif is_number(raw) or isinstance(raw, list):
        yield prefix


def parameters_of(
    scenes: ChangedScenes, keys: Sequence[str], with_droppers: bool = False
) -> list[Parameter]:
    """The parameters of ``keys``, and with ``with_droppers`` the lengths of all evaluated droppers;
    the usual parameters without either.

    Raises
    ------
    InputError
        As ``ChangedScenes.parameter``, and if there are no such droppers.
    """
    named = [scenes.parameter(key) for key in dict.fromkeys(keys)]
    if with_droppers:
        droppers = scenes.droppers()
        if not droppers:
            raise InputError(
                f"{option('--droppers', 'droppers')}: no dropper lies between evaluation.from_m "
                "and evaluation.to_m"
            )
        named += [one for one in droppers if one.key not in keys]
    return named or scenes.usual()
