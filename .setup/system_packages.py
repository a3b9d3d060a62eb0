"""Link the system's packages that share its MPI and its numpy into the environment, and no others.

Run by the Python that brings them: ``system_packages.py ENVIRONMENT [FOLDER...]``, where folders
are searched before ``sys.path``. An environment that saw all packages of the system would mix
them with its own: Debian's ``mpl_toolkits`` breaks a newer Matplotlib.
"""

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

PACKAGES = ("numpy", "scipy", "h5py", "mpi4py", "petsc4py")

# Catenary's imports of them; run by the environment's Python, without the user's variables.
PROBE = """
import numpy, h5py, mpi4py
import scipy.integrate, scipy.interpolate, scipy.linalg, scipy.optimize, scipy.signal, scipy.sparse
mpi4py.rc.initialize = False
import mpi4py.MPI
from petsc4py import PETSc
"""


def files_of(name: str) -> list[Path]:
    """The package or module ``name`` and its metadata, by which pip and importlib know it."""
    spec = importlib.util.find_spec(name)
    if spec is None or not (spec.submodule_search_locations or spec.origin):
        raise SystemExit(f"setup: {sys.executable} has no module {name}")
    found = Path(next(iter(spec.submodule_search_locations or [str(spec.origin)])))
    # Debian's h5py is described by h5py._debian_h5py_mpi-3.7.0.dist-info.
    metadata = (found.parent.glob(f"{name}{mark}*-info") for mark in "-.")
    return [found, *(path for group in metadata for path in group)]


def missing_module(python: Path) -> str:
    """Top-level name of a module that the linked packages import and lack, empty if none."""
    script = f"try:\n    exec({PROBE!r})\nexcept ModuleNotFoundError as e:\n    print(e.name)"
    done = subprocess.run([str(python), "-I", "-c", script], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"setup: the system's packages cannot be imported\n{done.stderr}")
    return done.stdout.strip().partition(".")[0]


def main() -> None:
    """Make ``system-packages`` beside ``site-packages``, and let the environment read it."""
    environment = Path(sys.argv[1]).absolute()
    sys.path[1:1] = sys.argv[2:]
    python = environment / "bin" / "python"
    ask = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = Path(subprocess.check_output([str(python), "-I", "-c", ask], text=True).strip())
    folder = site.with_name("system-packages")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    (site / "system-packages.pth").write_text(f"../{folder.name}\n")
    wanted = [*PACKAGES]
    for name in wanted:
        for path in files_of(name):
            os.symlink(path, folder / path.name)
        if name == wanted[-1] and (missing := missing_module(python)):
            if missing in wanted:
                raise SystemExit(f"setup: {missing} is linked, but the environment lacks it")
            wanted.append(missing)


main()
