"""Pairs of numbers that stand in CSV files, put into the scene in place of the files' names.

A result then holds the numbers themselves, and does not change with the file.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError
from catenary.cases.scene.input.faults import Fault, Origin, shown
from catenary.cases.scene.input.plain_text import decode, read_whole

_LONGEST_NAME = 1000


def take_in_files(
    raw: dict[str, Any], origin: Origin, folder: Path | None
) -> tuple[Origin, list[Fault]]:
    """Replace keys ``..._file`` of a raw scene by the pairs that the files hold, in place.

    Returns where all keys were written then, and faults: a file is not there, holds no pairs of
    numbers, or stands beside the pairs themselves.

    Names in the case file are relative to its ``folder``, those of the command line to the working
    directory.
    """
    taken, faults = list(origin.taken_in), []
    for where, table, key in _places(raw):
        name = table.get(f"{key}_file") if isinstance(table, dict) else None
        if not isinstance(name, str) or not name:
            continue
        file_key, pairs_key = f"{where}.{key}_file", f"{where}.{key}"
        del table[f"{key}_file"]
        own = origin.is_overridden(file_key) or folder is None
        path = (Path.cwd() if own else folder or Path()) / name
        try:
            if key in table:
                raise InputError(
                    f"{file_key} is {shown(name)} {origin.of(file_key)}; {pairs_key} is given too: "
                    "take one of them away"
                )
            table[key] = _pairs(path, f"{file_key} is {_named(name)} {origin.of(file_key)}")
            taken.append((pairs_key, str(path)))
        except InputError as error:
            faults.append(Fault(where, str(error)))
    return replace(origin, taken_in=tuple(taken)), faults


def absolute_names(raw: dict[str, Any], folder_of: Callable[[str], Path]) -> None:
    """Write every name of a file with pairs as a path from the root, in place; by its key
    ``folder_of`` says to which folder it is relative."""
    for where, table, key in _places(raw):
        name = table.get(f"{key}_file") if isinstance(table, dict) else None
        if isinstance(name, str) and name:
            table[f"{key}_file"] = str(folder_of(f"{where}.{key}_file") / name)


def _places(raw: dict[str, Any]) -> Iterator[tuple[str, Any, str]]:
    """Tables that may name files: their keys, they themselves, and the key of the pairs."""

    def below(table: Any, name: str) -> Any:
        return table.get(name) if isinstance(table, dict) else None

    vehicle, line = raw.get("vehicle"), raw.get("line")
    for direction in ("vertical", "lateral"):
        for course in ("by_time", "by_place"):
            yield f"vehicle.{direction}", below(vehicle, direction), course
    yield "line.dropper", below(line, "dropper"), "curve"
    auxiliary = below(line, "auxiliary_wire")
    yield "line.auxiliary_wire.dropper", below(auxiliary, "dropper"), "curve"
    links = below(line, "links")
    for number, link in enumerate(links if isinstance(links, list) else ()):
        yield f"line.links.{number}", link, "curve"


def _pairs(path: Path, where: str) -> list[list[float]]:
    """Two columns of numbers; comments after #, and one line of names before the numbers."""
    text = decode(read_whole(path, f"{where}; it"), f"{where}; it")
    pairs: list[list[float]] = []
    named = False
    for number, cells in enumerate(csv.reader(text.splitlines()), start=1):
        line = [cell.strip() for cell in ",".join(cells).split("#")[0].split(",")]
        if line == [""]:
            continue
        try:
            values = [float(cell) for cell in line]
        except ValueError:
            values = []
        if len(values) == 2:
            pairs.append(values)
        elif pairs or named:
            raise InputError(
                f"{where}; its line {number} must hold two numbers and a comma between"
            )
        else:
            named = True
    if not pairs:
        raise InputError(f"{where}; it holds no pairs of numbers")
    return pairs


def _named(name: str) -> str:
    """A file's name, whole if it can be one, otherwise its end."""
    return f'"{name}"' if len(name) <= _LONGEST_NAME and name.isprintable() else shown(name)
