"""Times the march of a long line on the ranks it is started on, and prints a line of JSON.

mpirun -n 2 python -m mpi4py step_cost.py SPANS STEPS
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from floor import LIBRARIES
from mpi4py import MPI

from catenary.base.parallel import on_root
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.load import load_scene
from catenary.cases.scene.scene import problem_of
from catenary.solver.integrators.line_integrator import make_line
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import line_at_rest_on_all
from catenary.solver.time_loop.march import March

CHUNKS, ROUNDS = 5, 20
# The fastest of the libraries on short lines and on long ones.
FASTEST = ("PETSc, Cholesky in blocks of stations", "PETSc, LU of nodes in nested dissection")


def main(n_spans: int, n_steps: int) -> None:
    comm = MPI.COMM_WORLD
    begin = time.perf_counter()
    # Since the benchmark started this process, on the clock that processes share.
    imported = time.time() - float(os.environ.get("STARTED_AT", time.time()))
    scene = load_scene("ambrosio2012", [f"line.n_spans={n_spans}", *room(n_spans)])
    problem = problem_of(scene)
    mesh = on_root(comm, lambda: mesh_of(scene))
    _, model, form, lift = line_at_rest_on_all(problem, mesh, comm)
    at_rest = time.perf_counter()
    walls: list[float] = []
    for chunk in range(CHUNKS + 1):
        train = problem.train
        length = n_steps * problem.numerics.dt * train.speed
        march = March(
            comm,
            replace(problem, train=replace(train, end=train.start + length)),
            model,
            form,
            lift,
        )
        if chunk == 0:
            ready = time.perf_counter()
        comm.Barrier()
        outcome = march.run([])
        walls.append(outcome.wall / outcome.n_steps)
        march.destroy()
    traffic = outcome.traffic or (0.0, 0.0)
    peak = comm.reduce(peak_memory(), MPI.SUM)
    # Only now: a library's factors take more memory than all of a march.
    least = floor(problem, model) if comm.size == 1 else None
    if comm.rank == 0:
        print(
            json.dumps(
                {
                    "spans": n_spans,
                    "unknowns": model.n_dofs,
                    "ranks": comm.size,
                    "rest_s": imported + at_rest - begin,
                    "ready_s": imported + ready - begin,
                    # The first march pays for pages and caches.
                    "us_per_step": 1e6 * float(np.median(walls[1:])),
                    "us_fastest": 1e6 * min(walls[1:]),
                    "us_floor": least and 1e6 * least,
                    "us_streamed": 1e6 * streaming(model.n_dofs // comm.size),
                    "peak_bytes": peak,
                    "messages": traffic[0],
                    "message_bytes": traffic[1],
                }
            )
        )


def floor(problem: Problem, model: Model) -> float:
    """Fastest time [s] of one exact solve by a library and one product with K."""
    line = make_line(MPI.COMM_SELF, model, distribute(model, 1, 0), problem.numerics)
    solves = [fastest(LIBRARIES[name](line, model)) for name in FASTEST]
    product = fastest(line.internal_forces)
    line.destroy()
    return min(solves) + product


def fastest(call: Callable[[], object]) -> float:
    """Fastest time [s] of some rounds."""
    times = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return min(times)


def streaming(n: int) -> float:
    """Fastest time [s] in which NumPy walks through a state (n,) as a step's two passes must: one
    of its three arrays read and another written, then all three changed."""
    x, y, z = np.ones((3, n))
    repeats = max(2, 1_000_000 // n)
    times = []
    for _ in range(ROUNDS):
        begin = time.perf_counter()
        for _ in range(repeats):
            np.copyto(z, x)
            for array in (x, y, z):
                array += 1.0
        times.append((time.perf_counter() - begin) / repeats)
    return min(times)


def peak_memory() -> float:
    """Most memory that this process ever held [bytes].

    Of Linux's two counts that of the address space: ``ru_maxrss`` begins with what the process that
    started this one held.
    """
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return 1024.0 * int(status.split("VmHWM:", 1)[1].split()[0])


def room(n_spans: int) -> list[str]:
    """Where a train runs on a line of this many spans: in its middle, so that all ranks see it."""
    if n_spans <= 25:
        return ["evaluation.from_m=160", "evaluation.to_m=200"]
    middle = 54 * (n_spans // 2)
    return [
        f"train.start_m={middle - 60}",
        f"evaluation.from_m={middle}",
        f"evaluation.to_m={middle + 60}",
    ]


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
