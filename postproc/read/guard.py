"""Checks a result file for damage in a process of its own: HDF5 crashes at some damaged tables,
and runs in circles at others.

Not collective. ``python -m catenary.postproc.read.guard FILE`` prints what it found as JSON.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

from catenary.base.errors import InputError
from catenary.base.files import is_file, is_folder
from catenary.postproc.files.own_files import RUN_FILE
from catenary.postproc.read.result_tables import ValidatedFile
from catenary.postproc.read.validation import Records

# Time limit of reading a file: so long, and a second for each part of this size [s], [B].
LIMIT, PER_SECOND = 30.0, 10e6
# The process is to be no rank of a run, with its launcher's variables.
_OF_LAUNCHERS = ("OMPI_", "PMIX_", "PMI_")
# A file that is refused is so again, with a sentence, by who opens it next.
_WALK = """
import sys
from pathlib import Path
from catenary.postproc.files.hdf5 import open_own
from catenary.base.errors import InputError
try:
    file = open_own(Path(sys.argv[1]), locking=False)
except InputError:
    sys.exit()
with file:
    file.visititems(lambda name, item: print(name, getattr(item, "shape", None)))
"""


def examined(path: Path) -> Records | None:
    """Valid records of a result file; None if there is no file.

    Parameters
    ----------
    path : Path
        Result file, or the folder that holds it as ``run.h5``.

    Raises
    ------
    InputError
        If it is no result file, or damaged so that no report can be made of it; also where HDF5
        crashes at it or does not come to an end.
    """
    path = path / RUN_FILE if is_folder(path) else path
    if not is_file(path):
        return None
    limit = LIMIT + path.stat().st_size / PER_SECOND
    try:
        done = _child(["-m", __name__, str(path)], limit)
    except subprocess.TimeoutExpired as error:
        raise InputError(
            f"{path} is damaged: HDF5 does not come to an end of reading it within {limit:.0f} s; "
            "nothing in it can be used"
        ) from error
    if done.returncode < 0:
        name = signal.Signals(-done.returncode).name
        raise InputError(
            f"{path} is damaged: HDF5 crashes at its tables ({name}); nothing in it can be used"
        )
    try:
        found = json.loads(done.stdout)
    except ValueError as error:
        last = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["no word"]
        raise InputError(
            f"{path} is damaged: it cannot be examined ({last[0]}); nothing in it can be used"
        ) from error
    if "refused" in found:
        raise InputError(found["refused"])
    return Records(**found)


def _child(words: list[str], limit: float) -> subprocess.CompletedProcess[bytes]:
    """Run Python with ``words`` in a process of its own, for ``limit`` [s] at most."""
    return subprocess.run(
        [sys.executable, "-P", *words],
        env=_environment(),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=limit,
        check=False,
    )


def survives(path: Path) -> bool:
    """Whether HDF5 opens every dataset of a file, without a crash and within ``LIMIT``."""
    try:
        done = _child(["-c", _WALK, str(path)], LIMIT)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def _environment() -> dict[str, str]:
    return {k: v for k, v in os.environ.items() if not k.startswith(_OF_LAUNCHERS)}


def examine(path: Path) -> str:
    """Examine a file; returns the fields of ``Records``, or the refusal, as JSON."""
    try:
        file = ValidatedFile(path)
        found = file.records
        file.read_states()
        file.close()
    except InputError as error:
        return json.dumps({"refused": str(error)})
    return json.dumps(found._asdict())


if __name__ == "__main__":
    sys.stdout.write(examine(Path(sys.argv[1])))
