"""Ends that go on, on one rank and on all; a run that goes on from amid it on the other number.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``; on one rank it compares a run with
itself.
"""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI
from rank_histories import Watching
from scenes import load_scene, mesh_of, problem_of

from catenary.base.parallel import on_root
from catenary.solver.statics.line_at_rest import line_at_rest_on_all
from catenary.solver.time_loop.march import March

WORLD = MPI.COMM_WORLD
# See test_same_answers.py.
TOLERANCE = 1e-9
# Near the end of the line, so that it moves.
SCENE = (
    "line.n_spans=5",
    "line.ends.start.kind=periodic",
    "line.ends.end.kind=periodic",
    "train.start_m=240",
    "train.end_m=285",
    "train.raise_time_s=0.1",
    "evaluation.from_m=260",
    "evaluation.to_m=280",
    "numerics.dt_s=2e-3",
)
KEPT = 150


# Long elements make the overlap of ranks long: several solve for what stands at an end.
@pytest.mark.parametrize("elements", [1, 4])
def test_ends_go_on_the_same_on_all_ranks(elements: int) -> None:
    scene = load_scene("en50318_2002", [*SCENE, f"mesh.elements_per_gap={elements}"])
    problem = problem_of(scene)
    mesh = on_root(WORLD, lambda: mesh_of(scene))
    rest = line_at_rest_on_all(problem, mesh, WORLD)
    found = []
    for comm in (MPI.COMM_SELF, WORLD):
        watching = Watching(KEPT)
        with March(comm, *rest) as march:
            march.run([watching])
        found.append(watching)
    again = Watching(KEPT)
    with March(WORLD, *rest) as march:
        assert found[0].checkpoint is not None  # of one rank
        march.restore(found[0].checkpoint)
        march.run([again])
    alone, shared = (np.array(watching.rows) for watching in found)
    assert WORLD.rank > 0 or np.ptp(shared[:, 0]) > 50.0
    # Contact forces are rank 0's, energies the line's.
    own = slice(0 if WORLD.rank == 0 else 1, None)
    scale = np.abs(alone).max(axis=0)
    assert (np.abs(alone - shared).max(axis=0) < TOLERANCE * scale)[own].all()
    rest_of = np.array(again.rows) - shared[KEPT:]
    assert (np.abs(rest_of).max(axis=0) < TOLERANCE * scale)[own].all()
