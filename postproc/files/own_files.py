"""Names of all files that a run and its report leave in their folder.

A run that replaces another removes these and nothing else: a user's own files stay.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import time
from pathlib import Path

from catenary.solver.time_loop.views.channels import CHANNELS, ENERGIES

logger = logging.getLogger("catenary.record")

RUN_FILE = "run.h5"
FIELD_FILES = ("fields.h5", "fields.xdmf")
_PICTURES = (
    *("contact_force", "strip_forces", "wire_forces", "statistics", "histogram", "uplift"),
    *("droppers", "static", "plan_view", "energy"),
    *(
        f"channel_{channel.name}"
        for channel in (*CHANNELS.values(), *ENERGIES.values())
        if (channel.values or channel.energy) and not channel.own_picture
    ),
)
REPORT_FILES = (
    *("summary.json", "report.html", "droppers.csv", "registration.csv"),
    *(f"{name}.png" for name in _PICTURES),
)
_OF_FULL_REPORTS = (
    *("lateral_place", "spectrum", "contact_height", "space_time", "line"),
    *("worst_span", "worst_dropper", "longest_slack"),
    *(f"pantograph_{n}" for n in range(1, 17)),
)
# What `catenary report` leaves besides, but for its input.toml, which a user may have changed.
FULL_REPORT_FILES = (
    *("report.pdf", "report_interactive.html"),
    *(f"{name}.svg" for name in (*_PICTURES, *_OF_FULL_REPORTS)),
)
# What a sweep leaves beside a run's files.
VARIANT_FILE = "variant.json"
OWN_FILES = (RUN_FILE, *FIELD_FILES, *REPORT_FILES, *FULL_REPORT_FILES, VARIANT_FILE)

_PART = re.compile(r"\.(?P<name>.+)\.\d+\.part")
# A report may be written beside a run; its files are made in less [s].
_MAKING = 600.0


def part_of(path: Path, process: int) -> Path:
    """Name under which a process makes a file that is to appear whole."""
    return path.with_name(f".{path.name}.{process}.part")


def new_part(path: Path) -> Path:
    """The name for this process, free to be written: a file of a dead process with the same number,
    or a link, is removed."""
    part = part_of(path, os.getpid())
    part.unlink(missing_ok=True)
    return part


def remove_stale(folder: Path) -> None:
    """Remove what an earlier run left beside its result file, which is replaced already."""
    for name in OWN_FILES:
        if name == RUN_FILE:
            continue
        try:
            (folder / name).unlink(missing_ok=True)
        except OSError as error:  # a folder of this name is not ours
            logger.warning(
                "%s of an earlier run could not be removed (%s)", folder / name, error.strerror
            )


def remove_parts(folder: Path) -> None:
    """Remove parts of files that dead runs left. Only who holds the folder's lock may."""
    with contextlib.suppress(OSError):
        for path in folder.iterdir():
            part = _PART.fullmatch(path.name)
            if part is None or part["name"] not in OWN_FILES:
                continue
            with contextlib.suppress(OSError):
                old = time.time() - path.lstat().st_mtime > _MAKING
                if old or part["name"] in (RUN_FILE, *FIELD_FILES):
                    path.unlink()
