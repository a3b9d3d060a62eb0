"""A line in gusts, on one rank and on all, with a pantograph that meets them; a run that goes on.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``; on one rank it compares a run with
itself.
"""

from __future__ import annotations

from mpi4py import MPI
from rank_histories import check_ranks
from scenes import load_scene, mesh_of, problem_of

from catenary.base.parallel import on_root
from catenary.solver.statics.line_at_rest import line_at_rest_on_all

WORLD = MPI.COMM_WORLD
SCENE = (
    "line.n_spans=7",
    "train.start_m=120",
    "train.end_m=155",
    "train.raise_time_s=0.1",
    "numerics.dt_s=2e-3",
    "evaluation.from_m=140",
    "evaluation.to_m=150",
    "line.contact_wire.diameter_mm=14.4",
    "line.messenger_wire.diameter_mm=14",
    "pantographs.reference.aerodynamics={uplift_polynomial=[0, 0, 1e-3], head_share=0.7}",
    "line.tunnels=[{from_m=145, to_m=300, force_factor=1.5}]",
    "wind={speed_m_per_s=30, direction_deg=120, drag='quadratic', gusts={highest_hz=2}}",
)


def test_wind_on_all_ranks() -> None:
    scene = load_scene("en50318_2002", list(SCENE))
    problem = problem_of(scene)
    assert {"wind", "gusts", "pantograph_aerodynamics"} <= problem.effects
    mesh = on_root(WORLD, lambda: mesh_of(scene))
    rest = line_at_rest_on_all(problem, mesh, WORLD)
    check_ranks(rest)
