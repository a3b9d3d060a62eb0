"""Loading a scene: the one way in, after which types, bounds, geometry and effects are sound."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from catenary.cases.scene.checks.scene import check
from catenary.cases.scene.input.case_files import find_case
from catenary.cases.scene.input.faults import SceneError
from catenary.cases.scene.input.origin import Origin
from catenary.cases.scene.input.pair_files import take_in_files
from catenary.cases.scene.input.plain_text import refuse_deep
from catenary.cases.scene.input.text_faults import text_faults
from catenary.cases.scene.input.toml_input import Assigned, assign, parse_assignment, read_toml
from catenary.cases.scene.keys.error_sentences import schema_faults, unknown_key
from catenary.cases.scene.keys.keys import is_known, known_keys, with_kinds
from catenary.cases.scene.scene import Scene
from catenary.solver.base.errors import InputError


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
    """The checked scene of a nested table, such as ``convert.course.resolved`` gives.

    ``folder`` is the folder of a relative ``mesh.file`` of the case file (one of the command
    line is relative to the working directory) and whose name an unnamed case takes.
    """
    refuse_deep(raw, origin.file)
    raw = copy.deepcopy(raw)
    faults, more = text_faults(raw, origin), 0
    _fill_in(raw, folder, origin.is_overridden("mesh.file"))
    origin, of_files = take_in_files(raw, origin, folder)
    faults += of_files
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
