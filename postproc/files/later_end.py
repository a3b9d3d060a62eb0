"""The head of a result file whose run is to go on beyond its end. Not collective.

The file is changed in a copy, which takes its place when it is whole: what breaks leaves the run
as it was.
"""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import h5py

from catenary.base.errors import RunBroken
from catenary.base.whole_files import appears_whole
from catenary.postproc.channels.header import Header
from catenary.postproc.files.disk import MARGIN, as_attribute, opened, reserve
from catenary.postproc.files.disk_errors import reason
from catenary.postproc.files.hdf5.checked import (
    ATTRIBUTE_SUMS,
    put_array,
    seal_arrays,
    seal_attributes,
    set_attribute,
    text_of,
)
from catenary.postproc.files.run_schema import INTERRUPTED

# Steps of the run as it was begun: what is recorded follows from them.
BEGUN_FOR = "n_steps_begun_for"
# Attributes that a later end leaves: who wrote the rows that are there, how, and who chose effects.
_KEPT = ("versions", "petsc_options", "effects_on", "effects_off")
# Tables that it changes beside attributes and facts.
CHANGED = ("line/evaluation_range",)


def extend_run(path: Path, header: Header, n_steps: int) -> None:
    """Turn a result file into that of a run of ``n_steps`` interrupted where it has ended.

    Parameters
    ----------
    path : Path
        Path of the result file.
    header : Header
        Header of the run with its later end.
    n_steps : int
        Number of steps up to the later end.

    Raises
    ------
    RunBroken
        If the file cannot be written; it is as it was.
    """
    try:
        with appears_whole(path) as made_as:
            shutil.copyfile(path, made_as, follow_symlinks=False)
            with opened(made_as, "r+") as file:
                _change(file, header, n_steps)
    except (OSError, RuntimeError) as error:
        raise RunBroken(
            f"{path} cannot be given a later end ({reason(error)}); it is as it was"
        ) from error


def _change(file: h5py.File, header: Header, n_steps: int) -> None:
    known = {
        name: as_attribute(value)
        for name, value in {**header.attributes, "n_steps_planned": n_steps}.items()
        if name not in _KEPT
    }
    reserve(file, MARGIN + sum(len(str(value).encode()) for value in known.values()))
    # A file whose checksums were taken away gets none.
    has_sums = ATTRIBUTE_SUMS in file.attrs
    sealed = list(json.loads(text_of(file.attrs[ATTRIBUTE_SUMS]))) if has_sums else []
    if BEGUN_FOR not in file.attrs:
        set_attribute(file, BEGUN_FOR, file.attrs["n_steps_planned"])
        sealed.append(BEGUN_FOR)
    for name, value in known.items():
        set_attribute(file, name, value)
    if has_sums:
        seal_attributes(file, sealed)
    set_attribute(file, "outcome", INTERRUPTED)
    for name in CHANGED:
        file[name][...] = header.datasets[name]
    for name, value in header.facts.items():
        put_array(file["facts"], name, value)
    seal_arrays(file["facts"], header.facts)
