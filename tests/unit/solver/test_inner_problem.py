"""The small problem of a step: forces, slack droppers, links within bounds, zeros of maps."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of

from catenary.solver.contact.forces_on_line import no_links
from catenary.solver.contact.pantographs import Heads
from catenary.solver.contact_problem import coupling
from catenary.solver.contact_problem.coupling import InnerProblem, InnerSolution
from catenary.solver.contact_problem.force_exchange import LineResponse
from catenary.solver.contact_problem.law_tangents import HertzInSteps, LawInSteps
from catenary.solver.kernels import native
from catenary.solver.problem.contact_laws import HertzLaw, LinearLaw
from catenary.solver.schemes.scheme import OneSolve
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March

# --- the small problem of a step ------------------------------------------------------------------


EPS = np.finfo(float).eps


def couplings_of(line: LineResponse) -> tuple[np.ndarray, ...]:
    """Views of the couplings of links with contacts, (m, n) each: reactions, lifts and rises."""
    n = line.n_contacts
    return tuple(line.rows.numbers[:, 2 + k * n : 2 + (k + 1) * n] for k in range(3))


def coupled(coupling: np.ndarray, kept: float = 0.0) -> native.Coupled:
    """Links that slacken with couplings G (m, m) as a band: ``band[e, d - e + half]`` is G_de."""
    m = len(coupling)
    half = max(m - 1, 0)
    band = np.zeros((m, 2 * half + 1))
    for e in range(m):
        band[e, half - e : half - e + m] = coupling[:, e]
    return native.Coupled(
        band, np.full(m, 1.0 - kept), np.ones(m, dtype=bool), np.zeros(m, int), np.zeros(m)
    )


@dataclass
class Case:
    """An inner problem made from a random symmetric system, as a step of a line makes it."""

    law: LinearLaw
    kept: float
    may_lose_contact: bool
    line: LineResponse
    heads: Heads
    coupling: np.ndarray

    def solve(self) -> InnerSolution:
        law = LawInSteps(
            self.heads.height.size,
            self.law.stiffness,
            self.law.damping,
            pulls=not self.may_lose_contact,
        )
        return InnerProblem(law, coupled(self.coupling, self.kept)).solve(self.line, self.heads)

    def violation(self, found: InnerSolution) -> float:
        """Largest difference between the two sides of the definitions in the module's docstring."""
        line, force, slack = self.line, found.contact_force, found.compensation
        # No dropper is pushed where there are no compensations.
        slack = slack if slack.size else np.zeros(line.count)
        free, (reaction, lift, rise) = line.line, couplings_of(line)
        height = free.place + free.by_force @ force - lift.T @ slack
        rate = free.rate + free.rate_by_force @ force - rise.T @ slack
        tension = line.rows.numbers[:, 1] + reaction @ force - self.coupling @ slack
        heads = self.heads
        depth = heads.height - heads.height_compliance @ force - height
        closing = heads.velocity - heads.velocity_compliance @ force - rate
        push = self.law.stiffness * depth + self.law.damping * closing
        if self.may_lose_contact:
            push = np.maximum(0.0, push)
        released = (1.0 - self.kept) * np.maximum(0.0, -tension)
        apart = [force - push, slack - released, found.depth - depth, found.rate - closing]
        return float(np.abs(np.concatenate(apart)).max())


def make_case(
    seed: int, n: int, m: int, damping: float, kept: float, may_lose_contact: bool
) -> Case:
    """Forces act on a line A = A_0 + sum of kappa L L^T, kappa what a dropper adds to a step.

    All numbers are of the order of one, so that absolute errors mean something.
    """
    rng = np.random.default_rng(seed)
    size = n + m + 2
    root = rng.normal(size=(size, size))
    contacts, droppers = rng.normal(size=(size, n)), rng.normal(size=(size, m))
    per_acceleration = rng.uniform(0.0, 3.0, m)
    step = root @ root.T + np.eye(size) + (droppers * per_acceleration) @ droppers.T
    inverse = np.linalg.inv(step)
    position, velocity = rng.uniform(0.1, 1.0, 2)
    among_contacts = contacts.T @ inverse @ contacts
    between = droppers.T @ inverse @ contacts
    among_droppers = droppers.T @ inverse @ droppers
    line = LineResponse(n, m)
    line.line.place[:], line.line.rate[:] = rng.normal(size=(2, n))
    line.line.by_force[:] = position * among_contacts
    line.line.rate_by_force[:] = velocity * among_contacts
    line.count = m
    line.rows.numbers[:, :2] = np.stack([np.arange(m), rng.normal(size=m)], axis=1)
    reaction, lift, rise = couplings_of(line)
    reaction[:] = per_acceleration[:, None] * between
    lift[:] = position * between
    rise[:] = velocity * between
    heads = Heads(n)
    heads.height[:], heads.velocity[:] = rng.normal(size=(2, n))
    # Strips of one head move each other.
    softness = rng.normal(size=(n, n))
    heads.height_compliance[:] = rng.uniform(0.0, 1.0) * softness @ softness.T
    heads.velocity_compliance[:] = rng.uniform(0.0, 3.0) * heads.height_compliance
    law = LinearLaw(float(rng.uniform(0.5, 20.0)), damping)
    return Case(
        law, kept, may_lose_contact, line, heads, per_acceleration[:, None] * among_droppers
    )


cases = st.builds(
    make_case,
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 3),
    m=st.integers(0, 6),
    damping=st.sampled_from([0.0, 0.3, 5.0]),
    kept=st.sampled_from([0.0, 0.01, 0.5]),
    may_lose_contact=st.booleans(),
)

# The matrices are those of A_0 >= 1 and at most 20 times the identity: their condition numbers
# stay below 1e4, and the pivoting accepts what is negative by 1e-12 of the right-hand side (~100).
TOLERANCE = 1e4 * 20 * EPS + 1e-10


@given(cases)
@settings(max_examples=300, deadline=None)
def test_solution_satisfies_contact_and_dropper_laws(case: Case) -> None:
    found = case.solve()
    assert case.violation(found) < TOLERANCE
    if case.may_lose_contact:
        assert (found.contact_force >= -TOLERANCE).all()
    assert (found.compensation >= -TOLERANCE).all()


@given(cases)
@settings(max_examples=150, deadline=None)
def test_pivoting_finds_the_same_solution(case: Case) -> None:
    """Without any round of the active set, the fallback has to do all the work."""
    usual = case.solve()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coupling, "_MAX_ROUNDS", 0)
        pivoted = case.solve()
    assert pivoted.pivoted and not usual.pivoted
    assert case.violation(pivoted) < TOLERANCE
    assert pivoted.contact_force == pytest.approx(usual.contact_force, abs=10 * TOLERANCE)
    assert pivoted.compensation == pytest.approx(usual.compensation, abs=10 * TOLERANCE)


def test_a_problem_that_cycles_is_handed_to_the_pivoting() -> None:
    """For this P-matrix the active set comes back to one that it has had."""
    matrix = np.array([[1.0, -3.0, 2.0], [3.0, 1.0, 0.0], [-3.0, -2.0, 1.0]])
    right = np.array([1.0, -2.0, 3.0])
    line = LineResponse(0, 3)
    line.count = 3
    line.rows.numbers[:] = np.stack([np.arange(3), -right], axis=1)
    law = LawInSteps(0, 1.0, 0.0, pulls=False)
    found = InnerProblem(law, coupled(np.eye(3) - matrix)).solve(line, Heads(0))
    solutions = []
    for acts in itertools.product([False, True], repeat=3):
        index = np.flatnonzero(acts)
        x = np.zeros(3)
        x[index] = np.linalg.solve(matrix[np.ix_(index, index)], right[index])
        if (x >= 0).all() and (matrix @ x - right >= -1e-12).all():
            solutions.append(x)
    assert len(solutions) == 1
    assert found.compensation == pytest.approx(solutions[0], abs=100 * EPS * np.abs(right).max())
    assert found.pivoted


def one_contact(height: float, may_lose_contact: bool = True) -> InnerSolution:
    """A head at 0 m with a compliance of 2e-5 m/N under a wire at ``height`` with 3e-5 m/N."""
    line = LineResponse(1, 0)
    line.line.place[:], line.line.by_force[:] = height, 3e-5
    heads = Heads(1)
    heads.height_compliance[:] = 2e-5
    law = LawInSteps(1, 5e4, 0.0, pulls=not may_lose_contact)
    return InnerProblem(law, no_links()).solve(line, heads)


def test_one_contact_has_its_closed_form() -> None:
    """k g / (1 + k (b + c)) for a free gap g: springs and compliances in a row."""
    force = one_contact(-0.007).contact_force[0]
    expected = 5e4 * 0.007 / (1 + 5e4 * 5e-5)
    assert force == pytest.approx(expected, rel=4 * EPS)
    assert one_contact(-0.007).depth[0] == pytest.approx(force / 5e4, rel=100 * EPS)


def test_an_open_gap_has_no_force_unless_contact_is_bilateral() -> None:
    assert one_contact(0.007).contact_force[0] == 0.0
    assert one_contact(0.007, may_lose_contact=False).contact_force[0] < 0.0


def test_slow_impacts_with_much_hysteresis_find_their_force() -> None:
    """The slope on the rate is some 1e8 N s/m here: rates of some m/s, known to their rounding,
    leave forces of 400 N known to 1e-7 N, less than the 1e-10 of it that tangents agree to."""
    rng = np.random.default_rng(1)
    for _ in range(500):
        law = HertzInSteps(HertzLaw(1.4e8, 1.5, 5.9, rng.uniform(0.01, 0.05)), 1)
        line, heads = LineResponse(1, 0), Heads(1)
        line.line.place[:], line.line.rate[:] = rng.uniform(4.5, 5.5), rng.uniform(-2.0, 2.0)
        heads.height[:] = line.line.place + rng.uniform(0.0, 0.03)
        heads.velocity[:] = line.line.rate + rng.uniform(-1.0, 3.0)
        heads.height_compliance[:], heads.velocity_compliance[:] = 1.1e-5, 5.4e-3
        found = InnerProblem(law, coupled(np.zeros((0, 0)))).solve(line, heads)
        depth, rate = float(found.depth[0]), float(found.rate[0])
        push = 1.4e8 * max(depth, 0.0) ** 1.5 * (1.0 + 5.9 * rate / law.state()[0])
        # A hundred times what the tangents are held to.
        assert abs(max(push, 0.0) - found.contact_force[0]) < 1e-5 * (1.0 + found.contact_force[0])


def test_without_room_no_law_finds_its_force() -> None:
    for law in (
        LawInSteps(1, 5e4, 0.0, pulls=False),
        HertzInSteps(HertzLaw(1e8, 1.5, 0.1, 0.01), 1),
    ):
        inner = InnerProblem(law, coupled(np.zeros((0, 0))))
        problem = inner.problem(Heads(1).affine, LineResponse(1, 0))._replace(room=None)
        rounds, _, finite, complete, _ = native.solve(problem, law.marched)
        assert (rounds, finite, complete) == (0, False, False)


def test_contacts_beside_droppers_that_lost_much_find_their_force() -> None:
    """A step of a random scene: droppers give back what drove the heads by 0.6 m and 470 m/s, and
    the rows of two contacts, one of which hardly pushes any more, differ by 1e4.

    Elimination leaves 5e-7 N in the smaller row, and depths are known to the rounding of what
    cancels in them: tangents of forces of 200 N cannot agree to 1e-8 N.
    """
    law = HertzInSteps(HertzLaw(1.1055515077786334e8, 1.5, 0.11999033300982109, 0.02605), 2)
    law.restore(np.array([0.33622721189725424, 0.02604993563767073]))
    line, heads = LineResponse(2, 4), Heads(2)
    heads.height[:] = 0.06553267579229338, 0.6174776988587802
    heads.velocity[:] = 47.7164242666449, 471.445653584825
    line.line.by_force[:] = [
        [1.3360861603284938e-05, -4.7728306948933854e-09],
        [-4.7728306948933738e-09, 1.3496489520333944e-05],
    ]
    line.line.rate_by_force[:] = [
        [4.166943311109159e-03, 1.877413449708056e-10],
        [-4.178905455472464e-06, 3.993942428118032e-03],
    ]
    line.count = 4
    line.rows.numbers[:] = [
        [0, -3.2008731e6, -9.9e-8, -4.8402539e-5, -1.31e-13, -6.4280368e-11, -7.8e-15, -6.85045e-9],
        [1, -3.8134575e6, -5.63e-4, -1.12034647e-1, -7.475e-10, -1.48786168e-7, -4.499e-10,
         -1.23383328e-4],
        [2, -3.7789053e6, -1.2355e-2, -3.4048603e-5, -1.6408067e-8, -4.5217808e-11,
         -1.25252735e-5, -3.9237e-8],
        [3, -4.2196754e6, -5.36e-6, -1.3957e-8, -7.123e-12, -1.8535e-14, -5.42768e-9, -1.6156e-11],
    ]  # fmt: skip
    found = InnerProblem(law, coupled(np.zeros((4, 4)))).solve(line, heads)
    force = law.force(found.depth, found.rate)
    print(found.contact_force, force, found.rounds)
    # Known to 1e-12 m/s, the rounding of 470, on a slope of 5e6 N s/m.
    assert force == pytest.approx(found.contact_force, abs=1e-5)
    assert (force > 1.0).all()


# --- which links have a row in the small problem --------------------------------------------------


# A stiff wire, which goes down between the droppers beside the one that the head lifts after the
# first, long step. Each wire has a contact with the head.
DT = 8e-3
WORDS = [
    "line.n_spans=6", "line.dropper.stiffness_N_per_m=1e5", f"numerics.dt_s={DT}",
    "line.contact_wire.bending_stiffness_N_m2=1e5",
    "train.start_m=137", "train.end_m=150", "train.raise_time_s=0",
    "evaluation.from_m=140", "evaluation.to_m=145",
]  # fmt: skip
Rows = Callable[[tuple[float, float], float], list[int]]


@pytest.fixture
def rows(monkeypatch: pytest.MonkeyPatch) -> Iterator[Rows]:
    """Links with a row if contacts may push and pull so hard [N]."""
    schemes: list[OneSolve] = []
    make = OneSolve.__post_init__

    def made(self: OneSolve) -> None:
        make(self)
        schemes.append(self)

    monkeypatch.setattr(OneSolve, "__post_init__", made)
    scene = load_scene("dc_twin", WORDS)
    problem = problem_of(scene)
    with March(MPI.COMM_SELF, *line_at_rest(problem, mesh_of(scene))):
        (scheme,) = schemes
        scheme.begin(DT)
        respond = scheme.interaction.responder(scheme.share.arrays)

        def found(push: tuple[float, float], pull: float) -> list[int]:
            bounds = scheme.share.bounds
            bounds.push[:], bounds.pull[:], bounds.loss[:] = push, pull, 1e-6
            respond()
            return sorted(scheme.share.links.tolist())

        yield found


def least(has_rows: Callable[[float], bool]) -> float:
    """The least force [N] with which there are rows, to a thousandth."""
    low, high = 0.0, 1e6
    assert not has_rows(low) and has_rows(high)
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if has_rows(middle) else (middle, high)
    return high


def test_contacts_that_push_at_once_are_added_up(rows: Rows) -> None:
    """Of two at one place each needs half of what one alone needs to slacken a dropper."""
    alone = least(lambda force: bool(rows((force, 0.0), 0.0)))
    together = least(lambda force: bool(rows((force, force), 0.0)))
    assert together == pytest.approx(0.5 * alone, rel=2e-3)
    assert rows((alone, alone), 0.0) == rows((2.0 * alone, 0.0), 0.0)


def test_contacts_that_pull_slacken_other_droppers(rows: Rows) -> None:
    pushed, pulled = rows((1e6, 0.0), 0.0), rows((0.0, 0.0), 1e6)
    assert pushed and pulled and not set(pushed) & set(pulled)
    assert rows((1e6, 0.0), 1e6) == sorted(pushed + pulled)


# --- zeros on Merrill's path of simplices, of maps whose zeros are known otherwise ----------------


SMALL = 1e-11


def find_zero(
    of: Callable[[np.ndarray], np.ndarray], start: np.ndarray, width: float
) -> tuple[np.ndarray, bool]:
    """The last place looked at, and whether it is a zero."""
    at = start.copy()
    return at, native.find_zero(of, at, width, SMALL, native.Room(2 * start.size))


def faces(matrix: np.ndarray, right: np.ndarray) -> list[np.ndarray]:
    """All s in the unit cube with F = matrix s + right: F >= 0 where s = 0, <= 0 where s = 1, and 0
    between; every face of the cube is tried."""
    n, found = right.size, []
    for face in itertools.product((0.0, 1.0, None), repeat=n):
        s = np.array([0.0 if at is None else at for at in face])
        inside = np.array([at is None for at in face])
        if inside.any():
            own = matrix[np.ix_(inside, inside)]
            s[inside] = np.linalg.solve(own, -(right + matrix @ s)[inside])
        force = matrix @ s + right
        between = ((s > 0.0) & (s < 1.0))[inside].all()
        if between and (force[~inside & (s == 0.0)] >= 0.0).all():
            if (force[~inside & (s == 1.0)] <= 0.0).all():
                found.append(s)
    return found


@given(
    seed=st.integers(0, 2**32 - 1), n=st.integers(1, 4), turning=st.sampled_from([0.0, 1.0, 5.0])
)
@settings(max_examples=100, deadline=None)
def test_the_variational_inequality_of_any_matrix_is_solved(
    seed: int, n: int, turning: float
) -> None:
    """Also of matrices that turn, on which going from component to component runs in circles."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(n, n))
    matrix, right = rng.normal(size=(n, n)) + turning * (root - root.T), rng.normal(size=n)

    def normal(z: np.ndarray) -> np.ndarray:
        share = np.clip(z, 0.0, 1.0)
        return matrix @ share + right + z - share

    z, found = find_zero(normal, np.full(n, 0.5), 0.25)
    assert found
    assert np.abs(normal(z)).max() <= SMALL
    # Shares are as far from a solution as the worst condition of a face makes of SMALL.
    known = faces(matrix, right)
    assert min(np.abs(np.clip(z, 0.0, 1.0) - s).max() for s in known) < 1e6 * SMALL


def test_a_smooth_map_is_solved_and_its_path_passes_other_zeros() -> None:
    """Of z^3 - z the path may end at any of three zeros, of z^3 - 3 z + 10 at the one there is."""
    z, found = find_zero(lambda z: z**3 - z, np.array([0.3]), 0.1)
    assert found and min(abs(z[0] - root) for root in (-1.0, 0.0, 1.0)) < SMALL
    (root,) = (r.real for r in np.roots([1.0, 0.0, -3.0, 10.0]) if abs(r.imag) < 1e-9)
    z, found = find_zero(lambda z: z**3 - 3.0 * z + 10.0, np.array([4.0]), 0.25)
    assert found and z[0] == pytest.approx(root, abs=SMALL)


def test_a_map_without_a_number_is_no_zero() -> None:
    """Where it is no number, and where it is one at the start alone."""
    for of in (
        lambda z: np.full(2, np.nan),
        lambda z: z + 1.0 if z[0] == 0.5 else np.full(2, np.nan),
    ):
        _, found = find_zero(of, np.array([0.5, 0.5]), 0.25)
        assert not found


def test_a_map_without_a_zero_has_none() -> None:
    """That does not point back from afar: the path ends where nothing is left to go on with."""
    _, found = find_zero(lambda z: np.array([1.0, 0.0]), np.array([0.3, 0.4]), 0.25)
    assert not found


def test_a_map_of_numbers_beyond_the_grid_is_no_zero() -> None:
    """It jumps by 1e17: columns of a simplex are the same to round-off, and it has no next one."""
    matrix = np.array([[1.0, 1.0], [-1.0, 1.0]])
    _, found = find_zero(lambda z: 1e17 * np.sign(matrix @ z + 0.3), np.zeros(2), 0.25)
    assert not found
