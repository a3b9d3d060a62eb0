"""Agreement of all ranks: errors, one-rank work, abort on unforeseen errors. A leaf module."""

from __future__ import annotations

import logging
import os
import sys
import time
import traceback
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

from catenary.base.errors import CatenaryError, RunBroken

if TYPE_CHECKING:
    import numpy as np

T = TypeVar("T")

# Between two looks of a rank that waits for long work [s].
_NAP = 2e-3

NO_MEMORY = (
    "there is not enough memory left by the machine or a limit of the process; `catenary plan` "
    "tells what a run takes, and what was written stays readable"
)


def on_root(comm: Any, work: Callable[[], T], *, takes_long: bool = False) -> T:
    """Result of ``work()`` run on rank 0 only, given to all ranks; they all raise its error.

    Collective. Used for everything that touches files or gmsh: after a failure all
    ranks raise the same error, so that none waits for another.

    Parameters
    ----------
    comm : mpi4py communicator
        Communicator of the ranks.
    work : callable
        Function without arguments, whose result can be pickled.
    takes_long : bool, optional
        Whether the work takes far more than milliseconds: the other ranks then sleep until
        it is done, where MPI would keep their cores busy.

    Raises
    ------
    CatenaryError
        The same one on all ranks, of a lack of memory too; any other exception of rank 0 becomes a
        RuntimeError elsewhere.
    """
    result: Any = None
    error: BaseException | None = None
    if comm.rank == 0:
        try:
            result = work()
        except MemoryError:
            error = RunBroken(NO_MEMORY)
        except Exception as caught:  # every error must reach all ranks
            error = caught
    if comm.size > 1:
        if takes_long:
            wait_for_all(comm)
        result, carried = comm.bcast((result, _portable(error)), root=0)
        if carried is not None:
            raise error if error is not None else carried
    elif error is not None:
        raise error
    return result


def wait_for_all(comm: Any) -> None:
    """Sleep until all ranks have come here. Collective."""
    arrival = comm.Ibarrier()
    while not arrival.Test():
        time.sleep(_NAP)


def total(comm: Any, parts: np.ndarray) -> np.ndarray:
    """The sums of what ranks have, element by element, on all of them. Collective.

    ``parts`` (n,) of this rank; the array itself on one rank.
    """
    if comm.size > 1:
        from mpi4py import MPI  # not for answers without MPI, such as --help

        comm.Allreduce(MPI.IN_PLACE, parts, op=MPI.SUM)
    return parts


def _portable(error: BaseException | None) -> BaseException | None:
    if error is None or isinstance(error, CatenaryError):
        return error
    return RuntimeError(f"rank 0 failed: {type(error).__name__}: {error}")


def abort_on_unforeseen_error(comm: Any) -> None:
    """Install an exception hook that ends all ranks when one dies of an unforeseen error.

    Not collective to trigger: a single rank's traceback aborts the communicator. One rank alone
    ends at once too, with code 1: freeing what the traceback holds may need what has ended already.
    """

    def hook(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        traceback.print_exception(kind, error, trace)
        sys.stdout.flush()
        sys.stderr.flush()
        if comm.size > 1:
            comm.Abort(1)
        os._exit(1)

    sys.excepthook = hook


def set_up_logging(comm: Any, verbose: bool = False, quiet: bool = False) -> None:
    """Send log records to standard error on rank 0 and nowhere on the others. Not collective.

    ``verbose`` lets more through than warnings and progress, ``quiet`` errors only.
    """
    root = logging.getLogger("catenary")
    root.handlers.clear()
    root.propagate = False
    if comm.rank == 0:
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter("%(message)s"))
        root.addHandler(handler)
    else:
        root.addHandler(logging.NullHandler())
    root.setLevel(logging.ERROR if quiet else logging.DEBUG if verbose else logging.INFO)


def launched_by_mpirun() -> bool:
    """Whether this process was started by an MPI launcher. Not collective."""
    if os.environ.get("OMPI_MCA_ess") == "singleton":
        return False  # but by a process that has started MPI without one, and hands its rank down
    return any(name in os.environ for name in ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"))
