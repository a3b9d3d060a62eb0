"""The same run on one rank and on all ranks: contact force, uplift and dropper forces agree.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``; on one rank it compares a run with
itself.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI
from rank_histories import largest_difference
from scenes import load_scene, mesh_of, problem_of
from small_lines import bare_wires

from catenary.base.parallel import on_root
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.solver.model.partition import distribute
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.form_finding import find_form

# The parallel solve leaves a relative residual of 1e-16 a step; over some thousand steps of a
# lightly damped line that grows at most in proportion, and 1e-9 leaves room for a run ten times
# as long with droppers that switch at round-off.
TOLERANCE = 1e-9

# Two pantographs 31 m apart that cross the cuts between 2 and between 3 ranks, with slackening
# droppers, viscous contact and losses of contact while they are raised.
SCENE = (
    "line.n_spans=10",
    "train.start_m=150",
    "train.end_m=460",
    "evaluation.from_m=240",
    "evaluation.to_m=400",
    "train.pantographs=[{name='reference'},{name='reference',behind_m=31.0}]",
    "effects.contact_damping=true",
    "contact.damping_N_s_per_m=50",
    "numerics.dt_s=2e-3",
)


@pytest.fixture(scope="module")
def case() -> tuple[Problem, LineMesh]:
    def make() -> tuple[Problem, LineMesh]:
        scene = load_scene("en50318_2002", SCENE)
        return problem_of(scene), mesh_of(scene)

    return on_root(MPI.COMM_WORLD, make)


@pytest.mark.parametrize("scheme", ["one_solve", "fixed_point"])
def test_all_ranks_give_the_answer_of_one(case: tuple[Problem, LineMesh], scheme: str) -> None:
    problem, mesh = case
    # The correction stops at its own tolerance, which a round-off may cross one iteration earlier.
    numerics = replace(problem.numerics, scheme=scheme, eps_d=1e-13, eps_v=1e-10)
    train = problem.train
    if scheme == "fixed_point":
        # It takes a step some ten solves: a way about the cut between the first two ranks.
        cut = float(np.ptp(mesh.points[:, 0])) / max(2, MPI.COMM_WORLD.size)
        train = replace(train, start=cut - 9.0, end=cut + 9.0, raise_time=0.1)
    found = largest_difference(replace(problem, numerics=numerics, train=train), mesh)
    if MPI.COMM_WORLD.rank == 0:
        print(f"{MPI.COMM_WORLD.size} ranks, {scheme}: {found}, expected below {TOLERANCE}")
    assert set(found) == {"force", "arms", "droppers"}
    assert max(found.values()) < TOLERANCE


def test_dampers_of_slack_droppers_act_on_all_ranks(case: tuple[Problem, LineMesh]) -> None:
    """With the paper's average damping, and its law of a slack dropper."""
    problem, mesh = case
    train = replace(problem.train, end=problem.train.start + 120.0)
    damping = replace(problem.damping, alpha=0.0275, beta=0.0)
    kept = replace(problem, train=train, damping=damping, slack_dampers_act=True)
    found = largest_difference(kept, mesh, slackens=True)
    if MPI.COMM_WORLD.rank == 0:
        print(f"{MPI.COMM_WORLD.size} ranks: {found}, expected below {TOLERANCE}")
    assert max(found.values()) < TOLERANCE


@pytest.mark.parametrize(
    "integrator", [pytest.param("hht", marks=pytest.mark.study), "generalized_alpha"]
)
def test_methods_with_numerical_damping_in_parallel(
    case: tuple[Problem, LineMesh], integrator: str
) -> None:
    problem, mesh = case
    numerics = replace(problem.numerics, integrator=integrator, spectral_radius=0.7)
    train = replace(problem.train, end=problem.train.start + 80.0)
    found = largest_difference(replace(problem, numerics=numerics, train=train), mesh)
    assert max(found.values()) < TOLERANCE


@pytest.mark.parametrize(
    "scheme", ["one_solve", pytest.param("fixed_point", marks=pytest.mark.study)]
)
def test_steps_that_adapt_do_so_on_all_ranks(case: tuple[Problem, LineMesh], scheme: str) -> None:
    """Decisions are rank 0's. A size that round-off decides would show as an error of the order of
    the tolerance, far above what is allowed."""
    problem, mesh = case
    numerics = replace(
        problem.numerics, dt=1e-3, scheme=scheme, eps_d=1e-13, eps_v=1e-10,
        adaptive_tolerance=0.02, smallest_dt=2.5e-4,
    )  # fmt: skip
    # Half of it is the raising, in which sizes change most.
    train = replace(problem.train, end=problem.train.start + 20.0, raise_time=0.15)
    found = largest_difference(replace(problem, numerics=numerics, train=train), mesh)
    assert max(found.values()) < TOLERANCE


def test_damping_by_component_in_parallel(case: tuple[Problem, LineMesh]) -> None:
    problem, mesh = case
    damping = replace(problem.damping, per_component={"droppers": (0.0, 0.0)})
    train = replace(problem.train, end=problem.train.start + 80.0)
    found = largest_difference(replace(problem, damping=damping, train=train), mesh)
    assert max(found.values()) < TOLERANCE


@pytest.mark.skipif(MPI.COMM_WORLD.size > 3, reason="a longer line would be needed")
def test_rank_0_may_have_less_of_a_long_line() -> None:
    """The train crosses the end of rank 0's share."""

    def make() -> tuple[Problem, LineMesh, np.ndarray, float]:
        scene = load_scene("en50318_2002", ["line.n_spans=140"])
        problem, mesh = problem_of(scene), mesh_of(scene)
        model, _ = find_form(problem, mesh)
        ownership = distribute(model, max(2, MPI.COMM_WORLD.size), 0)
        nodes = mesh.wires[CONTACT_WIRE]
        cut = float(mesh.x(nodes[ownership.owned(model.dofs(nodes))]).max())
        return problem, mesh, np.diff(ownership.bounds), cut

    problem, mesh, shares, cut = on_root(MPI.COMM_WORLD, make)
    assert shares[0] < 0.9 * shares[1]
    train = replace(problem.train, start=cut - 30.0, end=cut + 20.0, raise_time=0.2)
    found = largest_difference(replace(problem, train=train), mesh)
    assert max(found.values()) < TOLERANCE


def test_a_rank_without_any_station_is_legal(case: tuple[Problem, LineMesh]) -> None:
    """Two bare wires of one element have two stations: on three ranks one owns nothing."""
    problem, _ = case
    length = 60.0
    mesh = LineMesh(
        points=np.array([[0.0, 0.0, 5.0], [length, 0.0, 5.0], [0.0, 0.0, 6.2], [length, 0.0, 6.2]]),
        wires={CONTACT_WIRE: np.array([0, 1]), MESSENGER_WIRE: np.array([2, 3])},
        droppers=np.zeros((0, 2), dtype=int),
        steady_arms=np.zeros(0, dtype=int),
        supports=np.zeros(0, dtype=int),
        anchors=np.array([0, 1, 2, 3]),
    )
    line = make_line(bare_wires(length))
    train = replace(problem.train, start=5.0, end=50.0, placements=problem.train.placements[:1])
    bare = replace(problem, line=line, train=train)
    model, _ = find_form(bare, mesh)
    owned = np.diff(distribute(model, MPI.COMM_WORLD.size, MPI.COMM_WORLD.rank).bounds)
    assert owned.sum() == model.n_dofs
    if MPI.COMM_WORLD.size > 2:
        assert (owned == 0).any()
    found = largest_difference(bare, mesh)
    assert found["force"] < TOLERANCE
