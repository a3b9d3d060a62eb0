"""The scene: everything a run is made of, as it is written in ``case.toml``.

``load_scene`` is the one way in. A loaded scene is sound: types, bounds, geometry and effects
have been checked, so that what follows meets no surprise.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import Field, PrivateAttr, ValidationError

from catenary.cases.scene.case_files import find_case
from catenary.cases.scene.error_sentences import Origin, schema_faults, unknown_key
from catenary.cases.scene.faults import Fault, SceneError
from catenary.cases.scene.keys import is_known, known_keys, with_kinds
from catenary.cases.scene.plain_text import refuse_deep, text_faults
from catenary.cases.scene.table import Table
from catenary.cases.scene.tables.contact import ContactTable
from catenary.cases.scene.tables.incidents import Incident
from catenary.cases.scene.tables.line import LineTable, MeshTable
from catenary.cases.scene.tables.mechanism import Name
from catenary.cases.scene.tables.pantograph import PantographTable
from catenary.cases.scene.tables.petsc import PetscTable
from catenary.cases.scene.tables.run import (
    CaseTable,
    EvaluationTable,
    NumericsTable,
    OutputTable,
    TrainTable,
)
from catenary.cases.scene.tables.vehicle import VehicleTable
from catenary.cases.scene.toml_input import Assigned, assign, parse_assignment, read_toml
from catenary.cases.scene.vehicle_files import take_in_files
from catenary.solver.base.errors import InputError
from catenary.solver.effects import effect as effect_registry

if TYPE_CHECKING:
    from catenary.meshgen.line import Line
    from catenary.solver.problem.problem import Problem


class Scene(Table):
    """All tables of a case."""

    case: CaseTable = Field(default_factory=CaseTable, description="what the case is")
    line: LineTable = Field(description="the line from anchor to anchor")
    mesh: MeshTable = Field(default_factory=MeshTable, description="the finite-element mesh")
    pantographs: dict[Name, PantographTable] = Field(
        min_length=1, max_length=100, description="the kinds of pantograph, by name"
    )
    train: TrainTable = Field(description="the train and its pantographs")
    vehicle: VehicleTable | None = Field(
        None, description="how the vehicle moves its pantographs' bases"
    )
    contact: ContactTable = Field(
        default_factory=ContactTable, description="contact between head and wire"
    )
    numerics: NumericsTable = Field(default_factory=NumericsTable, description="time stepping")
    evaluation: EvaluationTable = Field(description="the stretch whose statistics are judged")
    incidents: list[Incident] = Field(
        default_factory=list, max_length=1000, description="what happens during the run"
    )
    output: OutputTable = Field(default_factory=OutputTable, description="what is written")
    effects: dict[str, bool] = Field(
        default_factory=dict, description="what is simulated; see `catenary plan`"
    )
    petsc: PetscTable = Field(
        default_factory=PetscTable, description="PETSc's solver options; those after -- win"
    )
    test: dict[str, Any] = Field(
        default_factory=dict, description="keys and values that shorten the case for tests"
    )

    _origin: Origin = PrivateAttr(default=Origin("the scene"))

    @property
    def origin(self) -> Origin:
        """Where the keys were written, for sentences about them."""
        return self._origin

    def switches(self) -> dict[str, bool]:
        """Every effect of the registry and whether it is on, in the registry's order."""
        return {
            name: effect.always or self.effects.get(name, effect.default)
            for name, effect in effect_registry.registry().items()
        }

    @property
    def end_m(self) -> float:
        """Where the leading pantograph stops [m]: ``train.end_m`` or what stands for it."""
        if self.train.end_m is not None:
            return self.train.end_m
        line = self.to_line()
        running_end = line.running_range[1]
        behind = max(placement.behind_m for placement in self.train.pantographs)
        run_out = sum(line.span_lengths) / line.n_spans
        # The foremost strip must not leave the line either.
        running_end -= max(self.strips_ahead())
        return float(min(running_end, self.evaluation.to_m + behind + run_out))

    def strips_ahead(self) -> list[float]:
        """How far the outer strips of each pantograph are from its middle, along the track [m]."""
        kinds = (self.pantographs.get(place.name) for place in self.train.pantographs)
        return [0.0 if kind is None else kind.strips.ahead for kind in kinds]

    def to_line(self) -> Line:
        """The line in SI units. Not collective."""
        from catenary.cases.scene.convert.problem import line_of

        return line_of(self)

    def to_problem(self) -> Problem:
        """Everything a run needs, in SI units. Not collective."""
        from catenary.cases.scene.convert.problem import problem_of

        return problem_of(self)

    def mesh_file(self) -> Path | None:
        """The user's own mesh, None if the mesh is made from the line."""
        return None if self.mesh.file is None else Path(self.mesh.file)

    def resolved(self) -> dict[str, Any]:
        """All keys with the values that hold, plain enough for JSON; loads to the same scene."""
        plain: dict[str, Any] = self.model_dump(mode="json", exclude_none=True)
        plain["train"]["end_m"] = self.end_m
        plain["effects"] = self.switches()
        if self.mesh.file is not None:
            plain["mesh"] = {"file": self.mesh.file}
        return plain


def load_scene(
    case: str | Path,
    overrides: Sequence[str] = (),
    shortened: bool = False,
    varied: Sequence[Assigned] = (),
) -> Scene:
    """The checked scene of a shipped case's name or a case file. Not collective.

    Parameters
    ----------
    case : name, file or folder
    overrides : ``key=value`` each, value in TOML; they win over the file; ``key=`` removes a key
    shortened : apply the case's ``[test]`` table before the overrides
    varied : further assignments, which come last, and where they were written

    Raises
    ------
    InputError
        If anything is wrong: a ``SceneError`` with all faults of the scene, or one sentence.
    """
    path = find_case(str(case)).absolute()
    raw = read_toml(path)
    known = known_keys(Scene)
    if shortened and isinstance(raw.get("test"), dict):
        for key, value in raw["test"].items():
            assign(raw, key, value, f"in the [test] table of {path}")
    given = []
    for assigned in (*(Assigned(text) for text in overrides), *varied):
        key, value = parse_assignment(assigned.text, assigned.option)
        if not is_known(key, known):
            near = known_keys(Scene, with_kinds(key, raw, Scene))
            raise InputError(unknown_key(key, assigned.where, near))
        assign(raw, key, value, assigned.where)
        given.append((key, assigned.where))
    return scene_from(raw, Origin(str(path), tuple(given)), folder=path.parent)


def scene_from(raw: dict[str, Any], origin: Origin, folder: Path | None = None) -> Scene:
    """The checked scene of a nested table, such as ``Scene.resolved()`` gives.

    ``folder`` is where a relative ``mesh.file`` of the case file is looked for (one of the command
    line is relative to the working directory) and whose name an unnamed case takes.
    """
    from catenary.cases.scene.checks.scene import check

    refuse_deep(raw, origin.file)
    raw = copy.deepcopy(raw)
    faults, more = text_faults(raw, origin), 0
    _fill_in(raw, folder, origin.is_overridden("mesh.file"))
    try:
        origin = take_in_files(raw, origin, folder)
    except InputError as error:
        faults.append(Fault("vehicle", str(error)))
        del raw["vehicle"]
    try:
        scene = Scene.model_validate(raw)
    except ValidationError as failed:
        of_schema, more = schema_faults(failed, raw, Scene, origin)
        told = {fault.key for fault in faults}
        faults += [fault for fault in of_schema if fault.key not in told]
    if faults:
        raise SceneError(faults, more)
    scene._origin = origin
    check(scene)
    return scene


def _fill_in(raw: dict[str, Any], folder: Path | None, own_path: bool) -> None:
    if folder is None:
        return
    case = raw.setdefault("case", {})
    if isinstance(case, dict):
        case.setdefault("name", folder.name)
    mesh = raw.get("mesh")
    if isinstance(mesh, dict) and isinstance(mesh.get("file"), str) and mesh["file"]:
        base = Path.cwd() if own_path else folder
        mesh["file"] = str(base / mesh["file"])
