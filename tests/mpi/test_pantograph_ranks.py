"""A pantograph with all its bodies: the same on one rank and on all, errors included.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from rank_histories import on_one
from scenes import load_scene, mesh_of, problem_of

from catenary import RunBroken
from catenary.base.errors import NotConverged
from catenary.base.parallel import on_root
from catenary.meshgen.mesh import LineMesh
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView

# The parallel solve leaves a relative residual of 1e-16 a step, which grows at most in proportion
# over some hundred steps; as in test_same_answers.py.
TOLERANCE = 1e-9
SCENE = (
    "line.n_spans=8",
    "train.start_m=120",
    "train.end_m=150",
    "train.raise_time_s=0.1",
    "evaluation.from_m=130",
    "evaluation.to_m=150",
    "pantographs.seven_body.motion=all_bodies",
)


class Watched(Observer):
    """Observer that keeps forces and open joints on rank 0."""

    def __init__(self) -> None:
        self.force: list[np.ndarray] = []
        self.open: list[np.ndarray] = []

    def start(self, stage: Stage) -> None:
        assert stage.train.joints_in_loop

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        self.force.append(view.contact_force.copy())
        self.open.append(view.constraint_violation.copy())


@pytest.fixture(scope="module")
def case() -> tuple[Problem, LineMesh]:
    def make() -> tuple[Problem, LineMesh]:
        scene = load_scene("ambrosio2012", SCENE)
        return problem_of(scene), mesh_of(scene)

    return on_root(MPI.COMM_WORLD, make)


def marched(comm: Any, problem: Problem, mesh: LineMesh) -> tuple[str, Watched]:
    """March on ``comm``; how it ended, and what was seen. Collective."""
    watched = Watched()
    with March(comm, *line_at_rest(problem, mesh)) as march:
        outcome = march.run([watched]).outcome
    return outcome, watched


@pytest.mark.parametrize("scheme", ["one_solve", "fixed_point"])
def test_all_ranks_give_the_answer_of_one(case: tuple[Problem, LineMesh], scheme: str) -> None:
    problem, mesh = case
    numerics = replace(problem.numerics, scheme=scheme, eps_d=1e-13, eps_v=1e-10)
    problem = replace(problem, numerics=numerics)
    if scheme == "fixed_point":
        problem = replace(problem, train=replace(problem.train, end=problem.train.start + 10.0))
    outcome, together = marched(MPI.COMM_WORLD, problem, mesh)
    assert outcome == "done"
    _, alone = on_one(lambda comm: marched(comm, problem, mesh))
    if MPI.COMM_WORLD.rank == 0:
        reference = np.array(alone.force)
        off = np.abs(np.array(together.force) - reference).max() / reference.max()
        print(f"{MPI.COMM_WORLD.size} ranks, {scheme}: {off:.2e}, expected below {TOLERANCE}")
        assert off < TOLERANCE
        assert 0.0 < np.array(together.open).max() < 1e-9


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
    outcome, _ = marched(MPI.COMM_WORLD, problem, mesh)
    place = problem.train.start + problem.train.speed * problem.numerics.dt
    step = f"the step to t = {problem.numerics.dt:.4f} s with the train at {place:.1f} m"
    assert outcome == f"{step}: joints cannot be kept closed"


def test_a_wire_out_of_reach_is_told_on_all_ranks(case: tuple[Problem, LineMesh]) -> None:
    problem, mesh = case
    (place,) = problem.train.placements
    high = replace(place, nominal_height=9.0)
    problem = replace(problem, train=replace(problem.train, placements=(high,)))
    with pytest.raises(RunBroken, match="does not reach a wire at a height of 5"):
        marched(MPI.COMM_WORLD, problem, mesh)


def test_laws_and_regulators_give_the_answer_of_one_rank() -> None:
    """A limiter, a pneumatic damper, and a lift regulated by the contact force, on a track that
    reaches the base through a car."""

    def make() -> tuple[Problem, LineMesh]:
        kind = "pantographs.reference"
        scene = load_scene(
            "en50318_2002",
            [
                "line.n_spans=6",
                "mesh.elements_per_gap=3",
                "train.start_m=120",
                "train.end_m=150",
                "train.raise_time_s=0.1",
                "evaluation.from_m=130",
                "evaluation.to_m=150",
                f"{kind}.laws=[{{type='limiter',rise_m=0,stiffness_N_per_m=1e4}},"
                "{type='damper',up_N_s_per_m=200,down_N_s_per_m=30}]",
                f"{kind}.regulation={{measures='contact_force',target=140,"
                "gains=[{at=0,error=0.2,integral_per_s=3}],filter_s=0.05,delay_s=0.02}",
                "effects.vehicle_motion=true",
                "vehicle.irregularity.spectrum=fra_5",
                "vehicle.suspension={body_mass_kg=3e4,pitch_inertia_kg_m2=2e6,"
                "stiffness_N_per_m=9e5,damping_N_s_per_m=4e4,bogie_distance_m=19,wheelbase_m=2.5}",
            ],
        )
        return problem_of(scene), mesh_of(scene)

    problem, mesh = on_root(MPI.COMM_WORLD, make)
    forces = []
    for comm in (MPI.COMM_WORLD, MPI.COMM_SELF):
        watched = Forces()
        with March(comm, *line_at_rest(problem, mesh)) as march:
            assert march.run([watched]).outcome == "done"
        forces.append(np.array(watched.force))
    if MPI.COMM_WORLD.rank == 0:
        off = np.abs(forces[0] - forces[1]).max() / forces[1].max()
        print(f"{MPI.COMM_WORLD.size} ranks: {off:.2e}, expected below {TOLERANCE}")
        assert off < TOLERANCE


class Forces(Observer):
    """Observer that keeps contact forces on rank 0."""

    def __init__(self) -> None:
        self.force: list[np.ndarray] = []

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        self.force.append(view.contact_force.copy())
