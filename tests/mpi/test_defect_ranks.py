"""A line with defects of all kinds on one rank and on all; a run that goes on from amid them.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``; on one rank it compares a run with
itself.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from rank_histories import check_ranks
from scenes import load_scene, mesh_of, problem_of

from catenary.base.parallel import on_root
from catenary.solver.statics.line_at_rest import line_at_rest_on_all

WORLD = MPI.COMM_WORLD
# The train passes the middle of the line, where two ranks meet; a slack dropper breaks there, too.
SCENE = (
    "line.n_spans=7",
    "train.start_m=180",
    "train.end_m=230",
    "train.raise_time_s=0.1",
    "numerics.dt_s=2e-3",
    "evaluation.from_m=210",
    "evaluation.to_m=220",
    "irregularities.contact_wire_height.standard_deviation_mm=10",
    "irregularities.running_surface.standard_deviation_mm=0.2",
    "irregularities.dropper_lengths={standard_deviation_mm=5,by_dropper=[[4,5,60],[4,9,60]]}",
    "defects=[{type='missing_dropper',span=4,dropper=3},{type='loose_clamp',span=5,dropper=2},"
    "{type='worn_wire',from_m=190,to_m=215,lost_share=0.2},"
    "{type='wrong_tension',wire='messenger_wire',factor=0.9},"
    "{type='hard_spot',at_m=205.3,mass_kg=5,stiffness_N_per_m=500},"
    "{type='kink',at_m=212.0,angle_deg=0.3}]",
    "line.fittings=[{kind='splice',at_m=209.4,mass_kg=1.2}]",
    "incidents=[{type='dropper_break',at_s=0.45,span=4,dropper=9}]",
)


def test_defects_on_all_ranks_and_after_a_restart() -> None:
    problem = problem_of(load_scene("en50318_2002", list(SCENE)))
    mesh = on_root(WORLD, lambda: mesh_of(load_scene("en50318_2002", list(SCENE))))
    rest = line_at_rest_on_all(problem, mesh, WORLD)
    assert np.count_nonzero(rest.model.dropper_gap) >= 2
    check_ranks(rest)
