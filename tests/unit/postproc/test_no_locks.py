"""Writing on a file system without locks."""

from __future__ import annotations

import errno
import fcntl
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import pytest

from catenary.postproc.files import disk
from catenary.postproc.files.disk_errors import remedy

# As LD_PRELOAD: a kernel without flock.
NO_FLOCK = "#include <errno.h>\nint flock(int fd, int op) { errno = ENOLCK; return -1; }\n"
WRITE = """
import sys
from pathlib import Path
from catenary.postproc.files.disk import opened
with opened(Path(sys.argv[1]), "w") as file:
    file["x"] = 3.0
with opened(Path(sys.argv[1]), "r+") as file:
    file["x"][...] = 2.0 * file["x"][()]
"""


@pytest.mark.process
def test_a_file_system_without_locks_is_written_to(tmp_path: Path) -> None:
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("a C compiler makes the stand-in of such a file system")
    source, library = tmp_path / "no_flock.c", tmp_path / "no_flock.so"
    source.write_text(NO_FLOCK)
    subprocess.run([compiler, "-shared", "-fPIC", "-o", library, source], check=True, timeout=240)
    subprocess.run(
        [sys.executable, "-c", WRITE, tmp_path / "written.h5"],
        env={"LD_PRELOAD": str(library), "PATH": ""},
        check=True, timeout=240,
    )  # fmt: skip
    with h5py.File(tmp_path / "written.h5") as file:
        assert file["x"][()] == 6.0


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_the_lock_alone_is_given_up(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In HDF5's words, which have the system's number in their text."""
    real = h5py.File

    def without_locks(path: Path, mode: str, locking: bool = True, **how: Any) -> h5py.File:
        if locking:
            raise OSError(f"Unable to create file (unable to lock file, errno = {number})")
        return real(path, mode, locking=locking, **how)

    monkeypatch.setattr(disk.h5py, "File", without_locks)
    disk.open_to_write(tmp_path / "a.h5", "w", libver=disk.FORMAT_BOUNDS).close()
    assert (tmp_path / "a.h5").exists()


def test_a_file_that_another_process_locks_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    h5py.File(path, "w").close()
    with open(path, "rb") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(OSError, match="lock"):
            disk.open_to_write(path, "r+")


def test_the_cure_is_named() -> None:
    """For who forces HDF5 to lock."""
    assert "HDF5_USE_FILE_LOCKING=FALSE" in remedy(OSError(errno.ENOLCK, "No locks available"))
