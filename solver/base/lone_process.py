"""MPI in a process that no launcher has started: without what reaches other processes."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from typing import Any

from catenary.base.parallel import launched_by_mpirun

# Open MPI's daemon for processes that this one might start, its networks, and the search for them
# take 0.3 s at the start. hwloc, with which it looks for processors, would call at each display and
# each driver of a graphics card. Its folder for what processes of a job share has one name for all
# that no launcher has started: one that ends would take it from another that starts. Other
# implementations do not read these variables.
SETTINGS = {
    "OMPI_MCA_ess_singleton_isolated": "1",
    "OMPI_MCA_pml": "ob1",
    "OMPI_MCA_btl": "self",
    "OMPI_MCA_orte_create_session_dirs": "0",
    "HWLOC_PLUGINS_BLACKLIST": "hwloc_gl.so,hwloc_opencl.so",
}
# What Open MPI 4 leaves in the environment of a process that no launcher has started, with which no
# launcher starts from there.
_LEFT = ("OMPI_MCA_ess", "OMPI_MCA_pmix")


@contextlib.contextmanager
def settings() -> Iterator[None]:
    """Within the context MPI starts as a single process, unless mpirun started it. Not collective.

    Variables that the environment already sets keep their values. Those set here, and what MPI adds
    of its own, are removed afterwards: a process started later may be a launcher.
    """
    if launched_by_mpirun():
        yield
        return
    added = {name: value for name, value in SETTINGS.items() if name not in os.environ}
    os.environ.update(added)
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]
        for name in _LEFT:
            if name not in os.environ:
                os.unsetenv(name)  # which the process's own environment has, unlike os.environ


def world() -> Any:
    """The communicator of all processes; starts MPI. Not collective."""
    with settings():
        from mpi4py import MPI

    return MPI.COMM_WORLD


def alone() -> Any:
    """The communicator of this process alone; starts MPI. Not collective."""
    world()
    from mpi4py import MPI

    return MPI.COMM_SELF
