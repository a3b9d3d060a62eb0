"""Pantographs of bodies that cannot go on: all ranks are told.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from rank_histories import scene_on_all

from catenary import RunBroken
from catenary.base.errors import NotConverged
from catenary.meshgen.mesh import LineMesh
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March

SCENE = [
    "line.n_spans=8",
    "train.start_m=120",
    "train.end_m=150",
    "train.raise_time_s=0.1",
    "evaluation.from_m=130",
    "evaluation.to_m=150",
    "pantographs.seven_body.motion=all_bodies",
]


@pytest.fixture(scope="module")
def case() -> tuple[Problem, LineMesh]:
    return scene_on_all("ambrosio2012", SCENE)


def outcome(problem: Problem, mesh: LineMesh) -> str:
    """How a march on all ranks ended. Collective."""
    with March(MPI.COMM_WORLD, *line_at_rest(problem, mesh)) as march:
        return march.run([]).outcome


@pytest.mark.parametrize("motion", ["all bodies", "reduced"])
@pytest.mark.parametrize("scheme", ["one_solve", "fixed_point"])
def test_a_pantograph_that_cannot_go_on_ends_the_run_on_all_ranks(
    case: tuple[Problem, LineMesh], scheme: str, motion: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rank 0 alone moves it, and the others must not wait for what it cannot tell."""
    from catenary.mbs.mechanism.full_pantograph import FullPantograph
    from catenary.mbs.mechanism.reduction import RaisingPantograph

    if MPI.COMM_WORLD.size == 1 and (scheme, motion) == ("one_solve", "reduced"):
        pytest.skip("on one rank the compiled loop of steps moves it")
    problem, mesh = case
    kind: Any = FullPantograph
    method = "_predict"  # which its compiled head calls
    if motion == "reduced":
        kind, method = RaisingPantograph, "predict"
        (place,) = problem.train.placements
        place = replace(place, data=replace(place.data, all_bodies=None))  # type: ignore[arg-type]
        problem = replace(problem, train=replace(problem.train, placements=(place,)))
    problem = replace(problem, numerics=replace(problem.numerics, scheme=scheme))
    predict = getattr(kind, method)

    def lost(self: Any, time: float) -> Any:
        if time > 0.0105:
            raise RunBroken("lost its way")
        return predict(self, time)

    monkeypatch.setattr(kind, method, lost)
    with March(MPI.COMM_WORLD, *line_at_rest(problem, mesh)) as march:
        ended = march.run([])
    assert "lost its way" in ended.outcome
    assert ended.n_steps == 10


def test_joints_that_do_not_close_end_the_run_on_all_ranks(
    case: tuple[Problem, LineMesh], monkeypatch: pytest.MonkeyPatch
) -> None:
    from catenary.mbs.mechanism.full_pantograph import FullPantograph

    problem, mesh = case

    def stuck(self: Any, time: float, contact_force: np.ndarray) -> None:
        raise NotConverged("joints cannot be kept closed")

    monkeypatch.setattr(FullPantograph, "_advance", stuck)
    place = problem.train.start + problem.train.speed * problem.numerics.dt
    step = f"the step to t = {problem.numerics.dt:.4f} s with the train at {place:.1f} m"
    assert outcome(problem, mesh) == f"{step}: joints cannot be kept closed"


def test_a_wire_out_of_reach_is_told_on_all_ranks(case: tuple[Problem, LineMesh]) -> None:
    problem, mesh = case
    (place,) = problem.train.placements
    high = replace(place, nominal_height=9.0)
    problem = replace(problem, train=replace(problem.train, placements=(high,)))
    with pytest.raises(RunBroken, match="does not reach a wire at a height of 5"):
        outcome(problem, mesh)
