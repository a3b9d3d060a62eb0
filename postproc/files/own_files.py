"""Names of all files that a run and its report leave in their folder.

A run that replaces another removes these and nothing else: a user's own files stay.
"""

from __future__ import annotations

import contextlib
import logging
import re
import time
from collections.abc import Iterable
from pathlib import Path

from catenary.solver.time_loop.views.channels import CHANNELS, ENERGIES

logger = logging.getLogger("catenary.record")

RUN_FILE = "run.h5"
FIELD_FILES = ("fields.h5", "fields.xdmf")
# Pictures that each section of a report may have, without their ends; a report refuses others.
PICTURES: dict[str, tuple[str, ...]] = {
    "force": (
        *("contact_force", "strip_forces", "wire_forces", "lateral_place", "statistics"),
        "histogram",
    ),
    "spectrum": ("spectrum", "contact_height"),
    "waves": ("space_time",),
    "motion": ("uplift", "droppers", "energy"),
    "worst": ("worst_span", "worst_dropper", "longest_slack"),
    "rest": ("static",),
    "line": ("line",),
    "above": ("plan_view",),
    "pantographs": tuple(f"pantograph_{n}" for n in range(1, 17)),
}
CHANNEL_PICTURE = "channel_"  # and the name of a channel without a picture of its own
_OF_CHANNELS = tuple(
    f"{CHANNEL_PICTURE}{channel.name}"
    for channel in (*CHANNELS.values(), *ENERGIES.values())
    if (channel.values or channel.energy) and not channel.own_picture
)
# Names of earlier versions.
_EARLIER = ("worst_support",)
# All but input.toml, which a user may have changed.
REPORT_FILES = (
    *("summary.json", "droppers.csv", "registration.csv"),
    *("report.html", "report_interactive.html", "report.pdf"),
    *(
        f"{name}.{kind}"
        for names in (*PICTURES.values(), _OF_CHANNELS, _EARLIER)
        for name in names
        for kind in ("png", "svg")
    ),
)
MP4, GIF = "film.mp4", "film.gif"
# Files of a sweep beside those of a run.
VARIANT_FILE = "variant.json"
OWN_FILES = (RUN_FILE, *FIELD_FILES, *REPORT_FILES, MP4, GIF, VARIANT_FILE)

_PART = re.compile(r"\.(.+)\.(\d{1,9})\.part")
# A report may be written beside a run; its files are made in less [s].
_MAKING = 600.0


def remove_stale(folder: Path, names: Iterable[str] = OWN_FILES[1:]) -> None:
    """Remove files that an earlier run or report left.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    names : iterable of str, optional
        The files; all but the result file without it.
    """
    for name in names:
        try:
            (folder / name).unlink(missing_ok=True)
        except OSError as error:  # a folder of this name is not ours
            logger.warning(
                "%s of earlier results could not be removed (%s)", folder / name, error.strerror
            )


def remove_parts(folder: Path) -> None:
    """Remove parts of files that dead runs left. Only who holds the folder's lock may."""
    for path, name, _ in parts_in(folder):
        with contextlib.suppress(OSError):
            old = time.time() - path.lstat().st_mtime > _MAKING
            if name in OWN_FILES and (old or name in (RUN_FILE, *FIELD_FILES)):
                path.unlink()


def parts_in(folder: Path) -> list[tuple[Path, str, int]]:
    """Parts of files in a folder, each with the file's name and the number of its process; none if
    the folder cannot be read."""
    try:
        found = [(path, _PART.fullmatch(path.name)) for path in folder.iterdir()]
    except OSError:
        return []
    return [(path, part[1], int(part[2])) for path, part in found if part is not None]
