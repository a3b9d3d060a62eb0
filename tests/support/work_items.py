"""Work for the processes of ``cases/process/workers.py``, in a module that they can import."""

from __future__ import annotations

import logging
import os
import signal
import time
from pathlib import Path
from typing import Any

from catenary import InputError
from catenary.cases.process.workers import each
from catenary.postproc.read.results import Results

N_SLEEPERS = 2
LIMIT = 240.0  # for what others begin or end, on a busy machine [s]


def work(item: Any, comm: Any) -> Any:
    """Do what ``item`` says, else double it."""
    if item == "be killed":
        os.kill(os.getpid(), signal.SIGKILL)
    if item == "leave":
        os._exit(7)
    if item == "refuse":
        raise InputError("the item is wrong")
    if item == "fail":
        raise ZeroDivisionError("a mistake of the program")
    if item == "log":
        logging.getLogger("catenary.runner").warning("from item %s", item)
    if item == "describe":
        return os.getpid(), comm.size, os.environ["OMP_NUM_THREADS"]
    return 2 * item


def sleep(folder: Path, comm: Any) -> None:
    """Leave this process' number in a folder, and sleep for longer than any test takes."""
    (folder / str(os.getpid())).touch()
    time.sleep(600.0)


def sleepers(folder: Path) -> list[int]:
    """Numbers of the processes that sleep, once all do."""
    begin = time.monotonic()
    while len(found := [int(path.name) for path in folder.iterdir()]) < N_SLEEPERS:
        assert time.monotonic() < begin + LIMIT
        time.sleep(0.05)
    return found


def wait_for_end(numbers: list[int]) -> None:
    """Wait until processes, which need not be children of this one, have ended."""
    begin = time.monotonic()
    while any(_lives(number) for number in numbers):
        assert time.monotonic() < begin + LIMIT
        time.sleep(0.05)


def _lives(number: int) -> bool:
    """Whether a process is there that is no zombie, which nobody may have waited for."""
    try:
        status = Path(f"/proc/{number}/stat").read_text(encoding="utf-8")
    except OSError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"


def measure_steps(results: Results) -> dict[str, Any]:
    """A figure of a run."""
    return {"n_steps": results.n_steps}


def die_at_275(results: Results) -> dict[str, Any]:
    """The same, at 275 km/h the end of the process."""
    if results.attributes["config"]["train"]["speed_km_h"] == 275:
        os._exit(9)
    return measure_steps(results)


class Count:
    """Counts the items that this process had: what a function keeps stays in its process."""

    def __init__(self) -> None:
        self.n_items = 0

    def __call__(self, item: Any, comm: Any) -> int:
        """How many there were."""
        self.n_items += 1
        return self.n_items


def sleep_in_processes(folder: str) -> None:
    """What a program does that is to be killed."""
    from mpi4py import MPI

    for _ in each(sleep, [Path(folder)] * N_SLEEPERS, N_SLEEPERS, MPI.COMM_SELF):
        pass
