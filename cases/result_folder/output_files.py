"""Files that a verb writes at the user's request: refused before anything is computed."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.postproc.files.csv_text import csv_text
from catenary.postproc.read.registration import Registration

DROPPER_COLUMNS = ("dropper_span", "dropper_x", "dropper_length", "dropper_force")
DROPPER_WIRES = ("dropper_upper", "dropper_lower")
_DROPPER_HEADS = ("span", "x_m", "length_m", "force_N", "from_wire", "to_wire")


def new_file(path: Path, suffixes: tuple[str, ...], force: bool) -> None:
    """Make the folder of a file; raise ``InputError`` unless ``path`` can be written with one of
    ``suffixes``."""
    if path.suffix not in suffixes:
        raise InputError(f"-o {path} must have a name that ends in {' or '.join(suffixes)}")
    if path.is_dir():
        raise InputError(f"-o {path} is a folder; name a file")
    if path.exists() and not force:
        raise InputError(f"-o {path} exists already; give --force to replace it")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"-o {path} cannot be written: {error.strerror}") from error
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InputError(f"-o {path} cannot be written: permission denied")


def write_static(path: Path, table: Mapping[str, Any], registration: bool = False) -> None:
    """Write the static table: the droppers as CSV, or the ``registration`` instead, or everything
    as JSON, by the file's suffix."""
    wires = [name.removeprefix("wires/") for name in table if name.startswith("wires/")]
    arms = Registration.of(table, wires) if registration else None
    if registration and arms is None:
        raise InputError("--registration: no steady arm pulls a wire sideways; give line.stagger_m")
    try:
        with path.open("w", encoding="utf-8", newline="") as stream:
            if path.suffix == ".json":
                plain = {name: np.asarray(value).tolist() for name, value in table.items()}
                json.dump(plain, stream, indent=1)
                stream.write("\n")
                return
            if arms is not None:
                stream.write(arms.csv())
                return
            columns = [np.asarray(table[name]) for name in (*DROPPER_COLUMNS, *DROPPER_WIRES)]
            rows = (
                (int(span) + 1, f"{x:.4f}", f"{length:.5f}", f"{force:.3f}", upper, lower)
                for span, x, length, force, upper, lower in zip(*columns, strict=True)
            )
            stream.write(csv_text(_DROPPER_HEADS, rows))
    except OSError as error:
        raise RunBroken(f"{path} could not be written: {error.strerror}") from error
