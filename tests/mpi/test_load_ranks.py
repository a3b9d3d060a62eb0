"""A line under loads of all kinds, on one rank and on all; a run that goes on from amid them.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``; on one rank it compares a run with
itself.
"""

from __future__ import annotations

import numpy as np
from measuring import registered
from mpi4py import MPI
from rank_histories import check_ranks
from scenes import load_scene, mesh_of, problem_of

from catenary.base.parallel import on_root
from catenary.meshgen.line import DropperPlace
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.solver.effects.effect import Effect
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.loads import FieldLoad, FunctionLoad, ShapeLoad, harmonics
from catenary.solver.problem.defects import DropperBreak
from catenary.solver.statics.line_at_rest import line_at_rest_on_all
from catenary.solver.wind import forces_along

WORLD = MPI.COMM_WORLD
SCENE = (
    "line.n_spans=7",
    "train.start_m=120",
    "train.end_m=155",
    "train.raise_time_s=0.1",
    "numerics.dt_s=2e-3",
    "evaluation.from_m=140",
    "evaluation.to_m=150",
)


def blow(builder: ModelBuilder) -> None:
    """One load of each kind, along all of both wires."""
    for wire in (CONTACT_WIRE, MESSENGER_WIRE):
        x = builder.mesh.x(builder.mesh.wires[wire])
        unknowns, weights = forces_along(builder.model, wire, ("w", "theta_y"))
        builder.add_load(ShapeLoad(unknowns, weights @ np.full(x.size, 2.0)))
        builder.add_load(
            ShapeLoad(unknowns, weights @ np.cos(0.1 * x), harmonics([2.0], [3.0], [0.0]))
        )

        def fill(first: int, part: slice, slices: np.ndarray, x: np.ndarray = x) -> None:
            times = 0.02 * (first + np.arange(slices.shape[0]))
            slices[:] = np.sin(0.3 * x[part] - 20.0 * times[:, None])

        builder.add_load(FieldLoad(unknowns, weights, 0.02, fill))
    at = builder.model.dofs(builder.mesh.droppers[:, 1])
    pull = np.linspace(1.0, 5.0, at.size)
    builder.add_load(FunctionLoad("function", at, lambda time: pull * np.sin(30.0 * time)))


def test_loads_in_time_on_all_ranks() -> None:
    scene = load_scene("en50318_2002", list(SCENE))
    problem = problem_of(scene)
    effects = problem.effects | {"loads", "dropper_break"}
    mesh = on_root(WORLD, lambda: mesh_of(scene))
    changed = {"effects": effects, "incidents": (DropperBreak(0.2, DropperPlace(180.0)),)}
    problem = problem.__class__(**{**problem.__dict__, **changed})
    with registered(Effect("loads", "loads", "loads", "test", False, build=blow)):
        rest = line_at_rest_on_all(problem, mesh, WORLD)
        check_ranks(rest)
