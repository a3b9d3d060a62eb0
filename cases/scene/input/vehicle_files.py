"""Courses of a vehicle that stand in CSV files, put into the scene in place of the files' names.

A result then holds the numbers themselves, and does not change with the file.
"""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

from catenary.cases.scene.input.origin import Origin, shown
from catenary.cases.scene.input.plain_text import decode, read_whole
from catenary.solver.base.errors import InputError

_LONGEST_NAME = 1000
_DIRECTIONS, _COURSES = ("vertical", "lateral"), ("by_time", "by_place")


def take_in_files(raw: dict[str, Any], origin: Origin, folder: Path | None) -> Origin:
    """Replace every ``by_..._file`` of a raw scene's vehicle by the pairs that it holds, in place.

    Returns where all keys were written then.

    Names in the case file are relative to its ``folder``, those of the command line to the working
    directory.

    Raises
    ------
    InputError
        A file is not there, holds no pairs of numbers, or stands beside the pairs themselves.
    """
    vehicle = raw.get("vehicle")
    if not isinstance(vehicle, dict):
        return origin
    taken: list[tuple[str, str]] = []
    for direction in _DIRECTIONS:
        table = vehicle.get(direction)
        if not isinstance(table, dict):
            continue
        for course in _COURSES:
            name = table.get(f"{course}_file")
            if not isinstance(name, str) or not name:
                continue
            key = f"vehicle.{direction}.{course}_file"
            if course in table:
                raise InputError(
                    f"{key} is {shown(name)} {origin.of(key)}; vehicle.{direction}.{course} is "
                    "given too: take one of them away"
                )
            own = origin.is_overridden(key) or folder is None
            path = (Path.cwd() if own else folder or Path()) / name
            table[course] = _pairs(path, f"{key} is {_named(name)} {origin.of(key)}")
            del table[f"{course}_file"]
            taken.append((f"vehicle.{direction}.{course}", str(path)))
    return replace(origin, taken_in=tuple(taken))


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
