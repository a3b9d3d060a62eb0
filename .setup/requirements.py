"""Print what pip is to install, read from pyproject.toml: the one place that states versions.

Packages of the system are left out: they share its MPI library and its numpy ABI, and Debian's
MPI build of h5py carries a name that pip does not recognise.
"""

import re
import sys
import tomllib

FROM_SYSTEM = {"numpy", "scipy", "h5py", "mpi4py", "petsc4py"}


def name_of(requirement: str) -> str:
    """Name of the distribution that a requirement asks for."""
    match = re.match(r"[A-Za-z0-9._-]+", requirement)
    if match is None:
        raise SystemExit(f"pyproject.toml: {requirement!r} is not a requirement")
    return match.group().lower()


def main() -> None:
    """Print one requirement a line: build, program, films, tables, reports; with ``tests`` those
    of tests, lint and documentation too."""
    with open(sys.argv[1], "rb") as file:
        settings = tomllib.load(file)
    project = settings["project"]
    extras = ["film", "parquet", "report", *(["docs", "test"] if "tests" in sys.argv[2:] else [])]
    wanted = [
        *settings["build-system"]["requires"],
        *(r for r in project["dependencies"] if name_of(r) not in FROM_SYSTEM),
        *(one for extra in extras for one in project["optional-dependencies"][extra]),
    ]
    print("\n".join(wanted))


main()
