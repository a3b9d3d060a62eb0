"""Libraries: their settings before they are loaded, memory to load them, and their versions.

``choose_settings`` is for the program, not for other people's Python programs.

Pictures have the program's own style, and Matplotlib a folder for its cache. At its import it reads
a ``matplotlibrc``: that in the working directory, else that of ``MATPLOTLIBRC``, else that of the
user. One that is no text ends the import.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import logging
import os
import platform
import resource
import stat
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from importlib import metadata
from pathlib import Path

# Address space that program and libraries take before any data, with a margin; a report of a short
# run was written within 0.7 GB, and OpenBLAS tries for ever to get memory within 0.45 GB [B].
LEAST_MEMORY = 700_000_000
CACHE_VARIABLE = "MPLCONFIGDIR"
_MATPLOTLIBRC, _MATPLOTLIBRC_HERE = "MATPLOTLIBRC", Path("matplotlibrc")
# Python packages that leave a record of their version, in the order in which they are printed.
_PACKAGES = ("numpy", "scipy", "gmsh", "meshio", "pydantic", "typer")


def choose_settings() -> None:
    """Set what Python and libraries read when they are loaded. Not collective."""
    # Modules, tables and pictures make many objects and little garbage: a short run ends before the
    # first collection, which takes 0.15 s of it otherwise. A long series of runs has some.
    gc.set_threshold(500_000, 3, 10)
    # The end of the process frees all memory at once: Python need not look through it for garbage
    # several times before, which takes a fifth of a whole run.
    atexit.register(gc.freeze)
    # Functions of libraries are looked up when they are first called: of all that PETSc, MPI and
    # SciPy have a run calls few.
    sys.setdlopenflags(os.RTLD_LAZY)
    # One thread a process unless the user says otherwise, before a library reads it: matrices are
    # small here, and MPI is what runs in parallel.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    # No package checks scenes but Pydantic itself: it need not look through all that are installed.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # A crash ends the process: Open MPI's handler, which prints a trace, may wait for ever.
    os.environ.setdefault("OMPI_MCA_opal_signal", "")


def too_little_memory() -> str:
    """Sentence if this process's limit leaves too little memory, else "". Not collective."""
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY or limit >= LEAST_MEMORY:
        return ""
    return (
        f"this process may take {limit / 1e6:.0f} MB of memory (ulimit -v), and the program with "
        f"its libraries needs {LEAST_MEMORY / 1e6:.0f} MB before any data; raise the limit"
    )


def leave_out_matplotlibrc() -> None:
    """See to it, before Matplotlib is imported, that it reads no ``matplotlibrc`` of a user's.

    Where the working directory has one it is imported here, from a folder that has none.
    """
    os.environ[_MATPLOTLIBRC] = os.devnull
    if os.path.lexists(_MATPLOTLIBRC_HERE):
        with contextlib.chdir(Path(__file__).parent):
            import matplotlib  # noqa: F401


def choose_matplotlib_folder() -> None:
    """Set the folder of its cache, before it is imported, where the user has no home that can be
    written."""
    if CACHE_VARIABLE in os.environ or _may_be_made(_default_folder()):
        return
    for base in _cache_folders():
        if _is_writable(base):
            os.environ[CACHE_VARIABLE] = str(base / "matplotlib")
            return
    # It takes a temporary folder for this process; its warning is not needed.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)


def _default_folder() -> Path:
    try:
        return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "matplotlib"
    except RuntimeError:  # a user without a home
        return Path("/nonexistent")


def _may_be_made(path: Path) -> bool:
    """Whether a folder is there and can be written, or can be made."""
    try:
        there = next((one for one in (path, *path.parents) if one.exists()), None)
    except OSError:  # a home that this user may not search, as that of who called sudo
        return False
    return there is not None and there.is_dir() and os.access(there, os.W_OK | os.X_OK)


def _cache_folders() -> Iterator[Path]:
    """Folders to try for what is kept between runs, the best first."""
    if chosen := os.environ.get("XDG_CACHE_HOME"):
        yield Path(chosen).absolute() / "catenary"
    with contextlib.suppress(OSError):  # no folder for temporary files, or one of another user
        temporary = Path(tempfile.gettempdir()) / f"catenary-{os.geteuid()}"
        temporary.mkdir(mode=0o700, exist_ok=True)
        if _is_private(temporary):
            yield temporary


def _is_private(path: Path) -> bool:
    """Whether a folder is this user's and nobody else may write."""
    status = path.lstat()
    owned = status.st_uid == os.geteuid()
    return owned and stat.S_ISDIR(status.st_mode) and not status.st_mode & 0o077


def _is_writable(path: Path) -> bool:
    """Whether files can be made in a folder, which is made if need be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=path).close()
        return True
    except OSError:
        return False


@cache
def versions() -> dict[str, str]:
    """Versions by name: Catenary, libraries with their Python packages, Python. Not collective.

    Those of PETSc, MPI and HDF5 are those that the loaded libraries report.
    """
    import h5py
    import mpi4py
    import petsc4py

    from catenary.base.mpi import MPI
    from catenary.base.petsc import PETSc

    hdf5 = ".".join(str(part) for part in h5py.h5.get_libversion())
    petsc = ".".join(str(part) for part in PETSc.Sys.getVersion())
    standard = ".".join(str(part) for part in MPI.Get_version())
    library = MPI.Get_library_version().replace("\0", "").splitlines()[0].split(",")[0].strip()
    found = {
        "catenary": metadata.version("catenary"),
        "PETSc": f"{petsc} (petsc4py {petsc4py.__version__})",
        "MPI": f"{standard}, {library} (mpi4py {mpi4py.__version__})",
        "HDF5": f"{hdf5} (h5py {h5py.__version__})",
    }
    found |= {name: metadata.version(name) for name in _PACKAGES}
    found["Python"] = platform.python_version()
    return found


def versions_text() -> str:
    """A line for each version, Catenary's first. Not collective."""
    first, *others = versions().items()
    lines = [" ".join(first)]
    width = max(len(name) for name, _ in others)
    return "\n".join([*lines, *(f"  {name:{width}}  {version}" for name, version in others)])
