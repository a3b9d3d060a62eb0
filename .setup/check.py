"""Import what Catenary stands on; say in one line what was found, or in a sentence what fails."""

import re
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # python -I does not

import versions  # noqa: E402

OLDEST_PETSC = (3, 18)


def missing_libraries_of_gmsh() -> list[str]:
    """Names of the shared libraries that gmsh's own library asks for and the system lacks."""
    missing: list[str] = []
    for library in Path(sys.prefix, "lib").glob("libgmsh.so*"):
        listing = subprocess.run(["ldd", str(library)], capture_output=True, text=True).stdout
        missing += re.findall(r"^\s*(\S+) => not found", listing, re.MULTILINE)
    return missing


def main() -> None:
    """Check versions and that every compiled package loads."""
    import h5py
    import mpi4py
    import numpy
    import scipy
    from petsc4py import PETSc

    if not hasattr(h5py, "File"):
        raise SystemExit("h5py is installed in part only: a folder, but no module (python3-h5py).")
    version = PETSc.Sys.getVersion()
    if version[:2] < OLDEST_PETSC:
        raise SystemExit(
            f"PETSc {'.'.join(map(str, version))} is too old: Catenary needs 3.18 or newer "
            "(Debian 12, Ubuntu 24.04 or newer, or conda-forge)."
        )
    if PETSc.ScalarType is not numpy.float64:
        raise SystemExit("PETSc was built with another scalar type than real double precision.")
    try:
        import gmsh
    except OSError as error:
        lacking = ", ".join(missing_libraries_of_gmsh()) or str(error)
        raise SystemExit(f"gmsh cannot be loaded, the system lacks: {lacking}") from None
    try:
        import catenary.solver.kernels.native  # noqa: F401
    except ImportError as error:
        raise SystemExit(f"the compiled kernels cannot be loaded: {error}") from None
    print(
        f"catenary is ready in .venv: PETSc {'.'.join(map(str, version))}, "
        f"mpi4py {mpi4py.__version__}, h5py {h5py.__version__}, numpy {numpy.__version__}, "
        f"scipy {scipy.__version__}, gmsh {gmsh.__version__}"
    )
    if remark := versions.remark():
        print(remark)


main()
