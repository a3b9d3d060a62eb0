"""Incidents on one rank and all: a dropper at the cut breaks, tension goes, a head is lowered.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``; on one rank it compares a run with
itself.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rank_histories import WORLD, check_ranks, scene_on_all

from catenary.base.parallel import on_root
from catenary.mbs.head.stepping import Lowering
from catenary.meshgen.line import DropperPlace
from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.model.partition import distribute
from catenary.solver.problem.defects import DropperBreak, TensionLoss
from catenary.solver.statics.form_finding import find_form
from catenary.solver.statics.line_at_rest import line_at_rest_on_all

# An odd number of spans of nine droppers: one of them stands where two ranks are cut apart.
WORDS = [
    "line.n_spans=7", "train.start_m=120", "train.end_m=180", "train.raise_time_s=0.2",
    "evaluation.from_m=150", "evaluation.to_m=170",
]  # fmt: skip
BREAKS, LOWERED = 200, 440  # steps of 1 ms


@pytest.mark.parametrize(
    "scheme", ["one_solve", pytest.param("fixed_point", marks=pytest.mark.study)]
)
def test_all_ranks_give_the_answer_of_one(scheme: str) -> None:
    """Also from states before, at and between incidents."""
    problem, mesh = scene_on_all("en50318_2002", WORDS)

    def dropper_at_cut() -> tuple[int, float]:
        """Next to the cut between the first two ranks."""
        model, _ = find_form(problem, mesh)
        x = mesh.x(mesh.droppers[:, 1])
        nodes = mesh.wires[CONTACT_WIRE]
        mine = distribute(model, max(2, WORLD.size), 0).owned(model.dofs(nodes))
        cut = float(mesh.x(nodes[mine]).max())
        nearest = int(np.argmin(np.abs(x - cut)))
        assert WORLD.size != 2 or abs(x[nearest] - cut) < 1.5  # an element
        return nearest, float(x[nearest])

    at, place = on_root(WORLD, dropper_at_cut)
    (placement,) = problem.train.placements
    lowered = replace(placement, lowering=Lowering(1e-3 * LOWERED, -60.0, 0.2, 0.3))
    problem = replace(
        problem,
        numerics=replace(problem.numerics, scheme=scheme, eps_d=1e-13, eps_v=1e-10),
        train=replace(problem.train, placements=(lowered,)),
        incidents=(
            DropperBreak(1e-3 * BREAKS, DropperPlace(place)),
            TensionLoss(0.28, CONTACT_WIRE, 0.8),
            TensionLoss(0.36, "messenger_wire", 0.9),
        ),
    )
    kept = [160, BREAKS, 320] if scheme == "one_solve" else []
    shown = check_ranks(line_at_rest_on_all(problem, mesh, WORLD), *kept).channels
    assert shown["dropper_force"][BREAKS, at] > 10.0
    assert (shown["dropper_force"][BREAKS + 1 :, at] == 0.0).all()
    gone = shown["contact_force"][LOWERED + 400 :]
    assert gone.size > 10 and (gone == 0.0).all()
