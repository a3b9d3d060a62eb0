"""Scenes: loaded, looked into, and changed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catenary.base.errors import InputError
from catenary.callers import path_of
from catenary.cases.scene.input.case_files import REMOVED, titles, value_at
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.input.plain_text import DEEPEST
from catenary.cases.scene.keys.keys import is_known, known_keys, unknown_key
from catenary.cases.scene.load import Draft, read_draft
from catenary.cases.scene.scene import Scene as CheckedScene
from catenary.cases.scene.scene import resolved

if TYPE_CHECKING:
    import pandas as pd


class Scene:
    """A checked line with a train and a run, from ``load``. A scene does not change.

    Scenes are equal where the same values hold, and can be keys of dictionaries.

    Keys are those of ``case.toml``, dotted: ``catenary list --keys`` lists them with unit, bounds
    and meaning. A unit stands at the end of a key; a key without one has no unit.

    Examples
    --------
    >>> scene = catenary.load("en50318_2002")
    >>> scene["train.speed_km_h"]
    250.0
    >>> scene.replace(train={"speed_km_h": 275})["train.speed_km_h"]
    275.0
    """

    __slots__ = ("_checked", "_draft")  # what has no such name cannot be set by mistake
    __iter__: None = None  # not from the numbers on for which ``__getitem__`` has a value

    def __init__(self, draft: Draft) -> None:
        self._draft = draft
        self._checked = draft.scene()

    @property
    def name(self) -> str:
        """Name of the case.

        Examples
        --------
        >>> catenary.load("ac_simple").name
        'ac_simple'
        """
        return self._checked.case.name

    @property
    def title(self) -> str:
        """Title of the case, one line.

        Examples
        --------
        >>> catenary.load("en50318_2002").title
        'Reference model of EN 50318:2002'
        """
        return self._checked.case.title

    def replace(
        self, changes: Mapping[str, Any] | pd.Series | None = None, /, **tables: Any
    ) -> Scene:
        """This scene with other values, checked at once. Not collective.

        Parameters
        ----------
        changes : mapping or pandas.Series, optional
            Values by dotted keys, such as ``{"train.speed_km_h": 275}``. A table changes the keys
            that it names and no others; a list replaces the whole list, unless its number is part
            of the key (``train.pantographs.1.behind_m``). ``None`` takes a key away, so that its
            default holds.
        **tables : Any
            The same by tables: ``train={"speed_km_h": 275}``; they hold where both name a key.

        Returns
        -------
        Scene
            Another one; this one stays as it is.

        Raises
        ------
        InputError
            With the sentence that ``catenary check`` prints; ``faults`` has all of them.

        Examples
        --------
        >>> scene = catenary.load("en50318_2002")
        >>> other = scene.replace({"line.contact_wire.tension_N": 25e3}, train={"speed_km_h": 300})
        >>> other["line.contact_wire.tension_N"], other["train.speed_km_h"]
        (25000.0, 300.0)
        >>> scene.replace(train={"sped_km_h": 300})
        Traceback (most recent call last):
        catenary.base.errors.InputError: train.sped_km_h in replace() is unknown; did you mean train.speed_km_h?
        """  # noqa: E501
        table: Any = {} if changes is None else changes
        if hasattr(table, "to_dict"):  # a row of a table of pandas
            table = table.to_dict()
        if not isinstance(table, Mapping):
            raise InputError(f"replace() has {shown(table)}; it takes a table of values by keys")
        given = (table, tables)
        return Scene(self._draft.assigned(v for own in given for v in _values(own, "in replace()")))

    def __getitem__(self, key: str) -> Any:
        """The value that holds of a dotted key, None where none does.

        Tables are dictionaries, and the number of an entry of a list is part of the key.
        """
        if not isinstance(key, str):
            raise InputError(f"{shown(key)} is no key; a key is a text, as in train.speed_km_h")
        value, known = value_at(resolved(self._checked), key), known_keys(CheckedScene)
        if value is None and not is_known(key, known):
            raise InputError(unknown_key(key, "in the scene", known))
        return value

    def to_dict(self) -> dict[str, Any]:
        """The scene as it is written, with what was replaced, as nested dictionaries.

        ``load`` takes them for the same scene. Defaults are not among them: see ``scene[key]``.

        Examples
        --------
        >>> faster = catenary.load("en50318_2002").replace(train={"speed_km_h": 275})
        >>> faster.to_dict()["train"]["speed_km_h"]
        275
        >>> catenary.load(faster.to_dict())["train.speed_km_h"]
        275.0
        """
        return self._draft.table()

    def __eq__(self, other: object) -> bool:
        """Whether the same values hold, wherever they were written."""
        if not isinstance(other, Scene):
            return NotImplemented
        return self is other or resolved(self._checked) == resolved(other._checked)

    def __hash__(self) -> int:
        return hash(_frozen(resolved(self._checked)))

    def __repr__(self) -> str:
        return f"<catenary.Scene {self.name}: {self.title}>"


def _frozen(value: Any) -> Any:
    """A value of a scene that can be hashed; whole numbers have the hash of their floats."""
    if isinstance(value, dict):
        return frozenset((key, _frozen(own)) for key, own in value.items())
    return tuple(map(_frozen, value)) if isinstance(value, list) else value


# Types that every function of a scene accepts.
SceneLike = Scene | str | Path | Mapping[str, Any]


def load(scene: SceneLike, *, short: bool = False) -> Scene:
    """Load a scene and check it. Not collective.

    Parameters
    ----------
    scene : str, Path, mapping or Scene
        The name of a shipped case (``catenary list``), a case file or its folder, or the tables of
        a scene as nested dictionaries. Paths in these are relative to the working directory. A
        scene that was loaded stands for itself.
    short : bool
        Whether to apply the ``[test]`` table of the case, which shortens its run to seconds.

    Returns
    -------
    Scene

    Raises
    ------
    InputError
        With the sentence that ``catenary check`` prints; ``faults`` has all of them.

    Examples
    --------
    >>> catenary.load("en50318_2002", short=True)["line.n_spans"]
    16
    >>> try:
    ...     catenary.load({"line": {"n_spans": 0}, "train": {}})
    ... except catenary.InputError as error:
    ...     print(len(error.faults) > 1, error.faults[0].key)
    True line.n_spans
    """
    if isinstance(scene, Scene):
        draft = scene._draft
    elif isinstance(scene, Mapping):
        raw = plain_value(scene, "the scene")
        case = raw.setdefault("case", {})
        if isinstance(case, dict):
            case.setdefault("name", "scene")
        draft = Draft(raw, "the table given to load()")
    elif isinstance(scene, str | PathLike):
        draft = read_draft(fspath(scene))
    else:
        raise InputError(
            f"the scene is {shown(scene)}; it must be a name, a path, its tables or a Scene"
        )
    return Scene(draft.shortened() if short else draft)


def shipped_cases() -> dict[str, str]:
    """The cases that come with the program. Not collective.

    Returns
    -------
    dict
        Title of each case by the name that ``load`` takes, in alphabetical order.

    Examples
    --------
    >>> catenary.shipped_cases()["en50318_2002"]
    'Reference model of EN 50318:2002'
    """
    return titles()


def scene_of(scene: SceneLike) -> Scene:
    """A scene, loaded unless it is one."""
    return scene if isinstance(scene, Scene) else load(scene)


def checked(scene: SceneLike) -> CheckedScene:
    """The tables of a scene."""
    return scene_of(scene)._checked


def draft_of(scene: SceneLike) -> Draft:
    """A scene as it is written."""
    return scene_of(scene)._draft


def _values(
    table: Mapping[str, Any], where: str, above: str = ""
) -> Iterator[tuple[str, Any, str]]:
    """Dotted key, value and place of all that a nested table names."""
    for name, value in table.items():
        key = f"{above}{name}"
        if key.count(".") >= DEEPEST:
            raise InputError(f"{shown(key)[1:-1]} {where} has more than {DEEPEST} parts")
        if isinstance(value, Mapping) and value:
            yield from _values(value, where, f"{key}.")
        else:
            yield key, REMOVED if value is None else plain_value(value, f"{key} {where}"), where


def tables_or_file(given: Any, argument: str) -> dict[str, Any] | Path:
    """The tables of an argument as TOML would give them, or the file that has them.

    Raises InputError if it is neither.
    """
    if isinstance(given, Mapping):
        tables: dict[str, Any] = plain_value(given, argument)
        return tables
    return path_of(given, argument, "a file, or its tables")


def plain_value(value: Any, where: str, depth: int = 0) -> Any:
    """A value as TOML would give it: numbers, texts, lists and tables of Python."""
    if depth > DEEPEST:
        raise InputError(f"{where} is nested too deeply")
    if isinstance(value, Mapping):
        return {
            str(key): plain_value(own, f"{where}.{key}", depth + 1) for key, own in value.items()
        }
    if hasattr(value, "to_numpy"):  # arrays of xarray, series of pandas
        value = value.to_numpy()
    if hasattr(value, "tolist"):  # arrays and scalars of NumPy
        value = value.tolist()
    if isinstance(value, list | tuple | range):
        return [plain_value(own, where, depth + 1) for own in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, bool | int | float | str):
        return value
    kind = type(value).__name__
    raise InputError(
        f"{where} is of the type {kind}; it must be a number, a text, a list or a table"
    )
