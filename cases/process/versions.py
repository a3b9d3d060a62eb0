"""Versions of Catenary and of what its results depend on."""

from __future__ import annotations

import platform
from functools import cache
from importlib import metadata

# Python packages that leave a record of their version, in the order in which they are printed.
_PACKAGES = ("numpy", "scipy", "gmsh", "meshio", "pydantic", "typer")


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
