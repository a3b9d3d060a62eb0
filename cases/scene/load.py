"""Loading a scene: the one way in, after which types, bounds, geometry and effects are sound."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from catenary.base.errors import InputError
from catenary.cases.scene.checks.scene import check
from catenary.cases.scene.input.case_files import (
    Assigned,
    assign,
    find_case,
    parse_assignment,
    read_toml,
    value_at,
)
from catenary.cases.scene.input.csv_files import absolute_names, take_in_files
from catenary.cases.scene.input.faults import Origin, SceneError, shown, text_faults
from catenary.cases.scene.input.plain_text import refuse_deep
from catenary.cases.scene.keys.keys import (
    is_known,
    known_keys,
    list_of,
    names_value,
    place_of,
    schema_faults,
    unknown_key,
)
from catenary.cases.scene.scene import Scene

# Tables that are filled in: with the name and the folder of the case, and with what files hold.
_FILLED_IN = ("case", "mesh", "vehicle", "evaluation", "line", "irregularities")


@dataclass(frozen=True)
class Draft:
    """A scene as it is written, not checked. Nothing changes it: ``assigned`` makes others.

    Attributes
    ----------
    raw : the nested table
    file : where it stands, for sentences
    folder : of the file, to which its own paths are relative; None of a table without a file
    given : pairs of a key that was assigned, and the place of that
    recorded : whether a result recorded it
    """

    raw: dict[str, Any]
    file: str
    folder: Path | None = None
    given: tuple[tuple[str, str], ...] = ()
    recorded: bool = False

    def assigned(self, values: Iterable[tuple[str, Any, str]]) -> Draft:
        """This scene with further values: dotted key, value (``REMOVED`` deletes the key) and, for
        messages, the place where it was written.

        Raises
        ------
        InputError
            If no scene has such a key, or if it leads through something that is no table.
        """
        values = list(values)
        if not values:
            return self
        raw, given = dict(self.raw), list(self.given)
        for key, value, where in values:
            known = known_keys(Scene)
            if not names_value(key, known):
                near = known_keys(Scene, place_of(key.split("."), raw, Scene).location)
                raise InputError(unknown_key(key, where, near))
            if not is_known(key, known):
                _refuse_without_entry(raw, key, where)
            assign(raw, key, value, where)
            given.append((key, where))
        return replace(self, raw=raw, given=tuple(given))

    def with_words(self, words: Iterable[Assigned]) -> Draft:
        """This scene with further values in words, such as those of a command; as ``assigned``."""
        return self.assigned((*parse_assignment(one.text, one.option), one.where) for one in words)

    def shortened(self) -> Draft:
        """Return the draft with the values of its ``[test]`` table."""
        raw = dict(self.raw)
        if isinstance(raw.get("test"), dict):
            for key, value in raw["test"].items():
                assign(raw, key, value, f"in the [test] table of {self.file}")
        return replace(self, raw=raw)

    def scene(self) -> Scene:
        """The checked scene.

        Raises
        ------
        InputError
            As ``load_scene``.
        """
        origin = Origin(self.file, self.given, recorded=self.recorded)
        return scene_from(self.raw, origin, self.folder)

    def table(self) -> dict[str, Any]:
        """The nested table with the name of its case, and with paths that hold everywhere."""
        refuse_deep(self.raw, self.file)
        raw, given = copy.deepcopy(self.raw), {key for key, _ in self.given}
        if self.folder is not None:
            _fill_in(raw, self.folder, "mesh.file" in given)
        absolute_names(raw, lambda key: Path.cwd() if key in given else self.folder or Path.cwd())
        return raw


def _refuse_without_entry(raw: dict[str, Any], key: str, where: str) -> None:
    """Raise InputError unless the entry of a list that a key names is written in the case."""
    entries = value_at(raw, list_of(key))
    name = shown(list_of(key))[1:-1]
    if not isinstance(entries, list):
        what = "has no list in the case" if entries is None else f"is {shown(entries)} and no list"
    elif int(key.rpartition(".")[2]) >= len(entries):
        what = f"has {len(entries)} entries, which count from 0"
    else:
        return
    raise InputError(f"{shown(key)[1:-1]} cannot be set {where}: {name} {what}")


def read_draft(case: str | Path, overrides: Sequence[str] = (), shortened: bool = False) -> Draft:
    """The scene of a shipped case's name, a case file or its folder, not checked.

    Parameters
    ----------
    overrides, shortened : as of ``load_scene``

    Raises
    ------
    InputError
        If there is none, if it is no TOML, or if no scene has a key that is assigned.
    """
    path = find_case(str(case)).absolute()
    draft = Draft(read_toml(path), str(path), path.parent)
    draft = draft.shortened() if shortened else draft
    return draft.with_words(map(Assigned, overrides))


def load_scene(case: str | Path, overrides: Sequence[str] = (), shortened: bool = False) -> Scene:
    """The checked scene of a shipped case's name or a case file. Not collective.

    Parameters
    ----------
    case : name, file or folder
    overrides : ``key=value`` each, value in TOML; they replace values of the file; ``key=`` removes
        a key
    shortened : apply the case's ``[test]`` table before the overrides

    Raises
    ------
    InputError
        If anything is wrong: a ``SceneError`` with all faults of the scene, or one sentence.
    """
    return read_draft(case, overrides, shortened).scene()


def scene_from(raw: dict[str, Any], origin: Origin, folder: Path | None = None) -> Scene:
    """The checked scene of a nested table, such as ``scene.resolved`` gives.

    ``raw`` are the tables, ``origin`` the places where keys were written, for messages. ``folder``
    is the base of a relative ``mesh.file`` in the case file (on the command line it is the working
    directory); its name is that of an unnamed case.
    """
    refuse_deep(raw, origin.file)
    faults, more = text_faults(raw, origin), 0
    raw = raw | {name: copy.deepcopy(raw[name]) for name in _FILLED_IN if name in raw}
    _fill_in(raw, folder, origin.is_overridden("mesh.file"))
    origin, of_files = take_in_files(raw, origin, folder)
    faults += of_files
    try:
        scene = Scene.model_validate(raw)
    except ValidationError as failed:
        of_schema, more = schema_faults(failed, raw, Scene, origin)
        known = {fault.key for fault in faults}
        faults += [fault for fault in of_schema if fault.key not in known]
    if faults:
        raise SceneError(faults, more)
    scene._origin = origin
    check(scene)
    return scene


def recorded_scene(config: dict[str, Any], file: Path) -> Scene:
    """The scene that a result ``file`` has recorded as ``config``.

    Raises
    ------
    InputError
        If it is not one of this version.
    """
    return scene_from(config, Origin(str(file), recorded=True))


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
