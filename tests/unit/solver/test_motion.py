"""States kept one prediction ahead or for later, and the controller of step sizes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from measuring import check, start_march
from small_lines import WHOLE, ac_simple_line, mesh_of, numerics, problem_of, train

from catenary.meshgen.mesh import MESSENGER_WIRE
from catenary.solver.contact_problem import coupling
from catenary.solver.integrators.line_state import LineState, PredictedLineState, StepFactors
from catenary.solver.kernels import native
from catenary.solver.problem.defects import TensionLoss
from catenary.solver.problem.problem import BOUNDED, EXACT, Problem, WindowChoice, n_halvings
from catenary.solver.schemes.adaptive_steps import StepError, StepSize
from catenary.solver.time_loop import compiled_steps
from catenary.solver.time_loop import march as time_loop
from catenary.solver.time_loop.views import shown_line, step_views
from catenary.solver.time_loop.views.observers import Observer, StepView
from catenary.solver.time_loop.views.shown_line import ShownMotion

# --- A state kept one prediction ahead is the same state ------------------------------------------


RNG = np.random.default_rng(5)
N = 12
STEPS = StepFactors(0.1, 1.0, 0.0, 0.0, 0.002, 0.0, 0.05, 0.0, 0.3, 0.0025, 0.05, 0.4)
# Sums of some numbers of order one.
ROUND_OFF = 1e-15


@pytest.fixture
def state() -> np.ndarray:
    """Displacement, velocity and acceleration."""
    return RNG.standard_normal((3, N))


def ahead() -> PredictedLineState:
    return PredictedLineState(*np.zeros((4, N)), STEPS)


def test_it_keeps_what_newmark_s_formulas_predict(state: np.ndarray) -> None:
    motion, work = ahead(), np.zeros(N)
    motion.put(*state)
    predicted = state.copy()
    native.predict(*predicted, np.zeros(0), work, STEPS)
    x, y, z = motion.read[:3]
    for found, expected in ((x, work), (y, predicted[1]), (z, state[2])):
        np.testing.assert_allclose(found, expected, rtol=0, atol=4 * ROUND_OFF)


def test_it_gives_back_what_it_took(state: np.ndarray) -> None:
    motion = ahead()
    motion.put(*state)
    found = np.array([motion.displacement, motion.velocity, motion.acceleration])
    np.testing.assert_allclose(found, state, rtol=0, atol=4 * ROUND_OFF)
    part = np.zeros((2, 5))
    native.displacements(motion.read, 3, part[0])
    native.velocities(motion.read, 3, part[1])
    np.testing.assert_allclose(part, state[:2, 3:8], rtol=0, atol=4 * ROUND_OFF)


def test_acceleration_found_later_moves_it_as_it_moves_the_state(state: np.ndarray) -> None:
    motion, change = ahead(), RNG.standard_normal(N)
    motion.put(*state)
    gained = np.array([STEPS.position_factor, STEPS.velocity_factor, 1.0])
    moved = state + gained[:, None] * change
    for array, gain in zip(motion.read[:3], motion.gains, strict=True):
        array += gain * change
    found = np.array([motion.displacement, motion.velocity, motion.acceleration])
    np.testing.assert_allclose(found, moved, rtol=0, atol=8 * ROUND_OFF)


def test_what_is_carried_is_taken_bit_by_bit(state: np.ndarray) -> None:
    names = "displacement", "velocity", "acceleration"
    motion, other = ahead(), ahead()
    motion.put(*state)
    rounded = motion.displacement.copy(), motion.velocity, motion.acceleration.copy()
    stored = dict(zip(names, rounded, strict=True)) | {
        name: array.copy() for name, array in motion.carried().items()
    }
    other.take(stored)
    for found, expected in zip(other.read[:4], motion.read[:4], strict=True):
        assert np.array_equal(found, expected)
    # A motion that is kept as it is has no use for predictions, and gives none away.
    plain = LineState(*np.zeros((3, N)), (0.0, 0.0, 1.0))
    plain.take(stored)
    assert np.array_equal(plain.displacement, rounded[0]) and not plain.carried()


# --- motions that blocks of steps keep for those who look later, against the same steps one by ----


N_STEPS, EVERY = 250, 7


class Looking(Observer):
    """Takes energies, uplift and places of masses at every seventh step, and rows of all."""

    def __init__(self) -> None:
        self.rows: list[np.ndarray] = []
        self.energies: list[tuple[float, ...]] = []
        self.uplift: list[np.ndarray] = []
        self.motion: list[np.ndarray] = []
        self.places: list[np.ndarray] = []
        self.refused = 0

    def next_state(self, step: int) -> int:
        return step - step % 64 + 64

    def next_motion(self, step: int) -> int:
        return step - step % EVERY + EVERY

    def observe(self, view: StepView) -> None:
        assert view.first_step == len(self.rows)
        self.rows += [row.copy() for row in view.rows]
        assert view.step == len(self.rows) - 1 and view.time == pytest.approx(1e-3 * view.step)
        try:
            assert view.checkpoint() is not None
        except RuntimeError as error:
            assert "only the motion" in str(error) and view.step % EVERY == 0
            assert view.step % 64 != 0 and view.step < N_STEPS
            self.refused += 1
            with pytest.raises(RuntimeError, match="only the motion"):
                view.line_state()
        if view.step % EVERY == 0:
            self.energies.append(view.energies())
            self.uplift.append(view.node_motion("w", False).copy())
            motion = [view.node_motion(n, rate) for n in ("w", "theta_y") for rate in (False, True)]
            self.motion.append(np.array(motion))
            self.places.append(view.pantograph_places())
            np.testing.assert_array_equal(self.motion[-1][0], self.uplift[-1])

    def finish(self, outcome: str) -> None:
        assert outcome == "done"


def problem(effects: frozenset[str] = frozenset(), **changes: Any) -> Problem:
    usual = train(75.0, 90.0, 90.0 + N_STEPS * 0.075, raise_time=0.0)
    return problem_of(
        ac_simple_line(4), WHOLE | effects, train=usual, numerics=numerics(1e-3), **changes
    )


def watched(scene: Problem, *others: Any, elements: int = 3) -> Looking:
    looking = Looking()
    march, _ = start_march(scene, mesh_of(scene.line, elements))
    with march:
        march.run([looking, *others])
    assert len(looking.rows) == N_STEPS + 1
    assert len(looking.energies) == len(looking.uplift) == N_STEPS // EVERY + 1
    return looking


@pytest.mark.parametrize("way", ["loop", "left to the scheme", "no room", "one at a time"])
@pytest.mark.parametrize("incident", [False, True])
def test_kept_motions_are_those_of_single_steps(
    way: str, incident: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a loss of tension a load has its share in the energy, too."""
    scene = problem()
    if incident:
        loss = TensionLoss(0.16, MESSENGER_WIRE, 0.9)
        scene = problem(frozenset({"tension_loss"}), incidents=(loss,))
    if way == "left to the scheme":
        monkeypatch.setattr(coupling, "_MAX_ROUNDS", 0)
    elif way == "no room":
        monkeypatch.setattr(compiled_steps, "_MOTION_BYTES", 0)
    elif way == "one at a time":
        monkeypatch.setattr(compiled_steps, "_MOST_MOTIONS", 1)
    with monkeypatch.context() as patch:
        patch.setattr(time_loop, "compiled_steps", lambda *arguments: None)
        expected = watched(scene)
    found = watched(scene)
    assert expected.refused == 0 and (found.refused > 0) == (way != "no room")
    assert np.array_equal(found.rows, expected.rows, equal_nan=True)
    assert np.array_equal(found.energies, expected.energies)
    assert np.array_equal(found.uplift, expected.uplift)
    assert np.array_equal(found.motion, expected.motion)
    assert np.array_equal(found.places, expected.places)
    assert (np.ptp(found.places, axis=0)[1:] > 1e-4).all(), "all masses move"
    assert np.ptp([kinetic for kinetic, _ in found.energies]) > 0.0


@pytest.mark.parametrize(
    "window",
    [WindowChoice(BOUNDED, None, 2.0, 2.0), WindowChoice(EXACT, None)],
    ids=["spans", "exact"],
)
@pytest.mark.parametrize("way", ["loop", "left to the scheme", "no room", "one at a time"])
def test_motions_of_a_window_are_those_of_the_whole_line(
    window: WindowChoice, way: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Single steps look at all stations. Energies are summed in parts of a few stations."""
    run = train(75.0, 330.0, 330.0 + N_STEPS * 0.075, raise_time=0.0)
    scene = replace(problem_of(ac_simple_line(12), WHOLE, train=run), window=window)
    monkeypatch.setattr(shown_line, "_STATIONS", 16)
    monkeypatch.setattr(shown_line, "_LINKS", 4)
    with monkeypatch.context() as patch:
        patch.setattr(time_loop, "compiled_steps", lambda *arguments: None)
        patch.setattr(step_views.ShownMotion, "take_changes", whole_line)
        expected = watched(scene, elements=2)
    if way == "left to the scheme":
        monkeypatch.setattr(coupling, "_MAX_ROUNDS", 0)
    elif way == "no room":
        monkeypatch.setattr(compiled_steps, "_MOTION_BYTES", 30_000)
    elif way == "one at a time":
        monkeypatch.setattr(compiled_steps, "_MOST_MOTIONS", 1)
    found = watched(scene, elements=2)
    assert np.array_equal(found.rows, expected.rows, equal_nan=True)
    assert np.array_equal(found.motion, expected.motion)
    np.testing.assert_allclose(found.energies, expected.energies, rtol=1e-12, atol=1e-12)
    assert np.ptp([kinetic for kinetic, _ in found.energies]) > 0.0


def whole_line(motion: ShownMotion) -> tuple[int, int]:
    """In place of ``ShownMotion.take_changes``: all of it."""
    return 0, motion._columns.n_stations  # noqa: SLF001


def test_those_who_need_rows_alone_get_each_once() -> None:
    class Rows(Observer):
        """Takes rows alone."""

        def __init__(self) -> None:
            self.rows: list[np.ndarray] = []

        def next_state(self, step: int) -> int:
            return step - step % 64 + 64

        def observe(self, view: StepView) -> None:
            assert view.checkpoint() is not None
            self.rows += list(view.rows.copy())

    rows = Rows()
    looking = watched(problem(), rows)
    assert looking.refused > 0 and np.array_equal(rows.rows, looking.rows, equal_nan=True)


# --- the controller of step sizes, and the estimate that it is given ------------------------------


def test_the_next_size_is_that_of_petscs_basic_controller() -> None:
    """PETSc manual, TSADAPTBASIC: h 0.9 e^(-1/3), within a tenth and ten times h, and half of that
    where a step is rejected twice."""
    control = StepSize(0.5, 1e-3, 1e-5)
    for error in (0.1, 0.4, 0.6, 4.0):
        accepted, size = control.after_step(error, 1e-4)
        assert accepted == (error <= 0.5)
        check(
            f"next size after {error} N [s]", size, 0.9e-4 * (error / 0.5) ** (-1 / 3), within=1e-12
        )
        control.after_step(0.1, 1e-4)
    assert control.after_step(4.0, 1e-4) == (False, pytest.approx(0.45e-4))
    assert control.after_step(4.0, 1e-4) == (False, pytest.approx(0.225e-4))
    assert control.after_step(0.0, 1e-3) == (True, 1e-3)
    assert control.after_step(1e-9, 2e-5) == (True, 2e-4)  # ten times at most
    assert control.after_step(1e9, 1e-5) == (True, 1e-5)  # the smallest is taken whatever happens
    check("size after a failure [s]", control.after_failure(8e-4), 2e-4, within=1e-16)
    assert not control.after_step(4.0, 1e-4)[0]


def test_the_estimate_is_what_average_acceleration_misses() -> None:
    """One step of x" = -w^2 x from an exact state against its exact end.

    The step misses h^3 / 12 times the third derivative in its middle. The estimate takes it h
    earlier, from an exact past and an end that is wrong by what is missed, which is 1 / 12 of the
    third difference: w h and 1 / 12 are how far both may differ.
    """
    omega, k, one = 30.0, np.array([1e5]), np.ones(1)
    for h in (2e-3, 1e-3):
        for phase in (0.3, 1.1, 2.0):
            estimate = StepError(1)
            for back in (2, 1, 0):
                estimate.accept(1.0 - back * h, one * np.cos(phase - omega * h * back), one)
            x, v, a = np.cos(phase), -omega * np.sin(phase), -(omega**2) * np.cos(phase)
            ahead = x + h * v + h**2 / 4 * a
            new_a = -(omega**2) * ahead / (1 + (omega * h) ** 2 / 4)
            found = one * (ahead + h**2 / 4 * new_a)
            missed = k[0] * abs(found[0] - np.cos(phase + omega * h))
            told = estimate.of(1.0 + h, found, one, k, 1e-9 * one)
            scale = k[0] * (omega * h) ** 3 / 12
            check("error of the step [N]", told, missed, within=(1.5 * omega * h + 1 / 12) * scale)


def test_a_landing_within_a_step_is_told() -> None:
    """A mass that hits a spring amid a step of average acceleration: by energy, it is pressed back
    with v sqrt(k m) at most. The estimate bounds what the step makes of that, for h -> 0."""
    mass, k, v, one = 2.0, 8e4, 0.3, np.ones(1)
    omega = np.sqrt(k / mass)
    for h in (5e-4, 2.5e-4):
        compliance = one * h**2 / (4 * mass)
        for share in (0.25, 0.5, 0.75):
            estimate = StepError(1)
            for number in (0, 1, 2):
                estimate.accept(h * number, one * v * h * (number - 2 - share), 0 * one)
            ahead = v * h * (1 - share)
            acceleration = -k * ahead / mass / (1 + k * compliance[0])
            depth, speed = ahead + h**2 / 4 * acceleration, v + h / 2 * acceleration
            told = estimate.of(3 * h, one * depth, one * k * depth, one * k, compliance)
            missed = abs(np.hypot(speed * np.sqrt(k * mass), k * depth) - v * np.sqrt(k * mass))
            print(f"h {h:g} share {share}: told {told:.3g} N, wrong by {missed:.3g} N")
            assert missed <= told * (1 + omega * h)


def test_no_estimate_without_a_past_or_a_contact() -> None:
    estimate, one, none = StepError(1), np.ones(1), np.zeros(1)
    for number in range(3):
        assert estimate.of(number, -one, none, one, one) is None
        estimate.accept(number, -one * number**3, none)
    assert estimate.of(3.0, -27 * one, none, one, one) == 0.0
    # A 12th of the third derivative, which is 6; no compliance that could swing.
    assert estimate.of(3.0, -27 * one, one, one, none) == pytest.approx(0.5)
    again = StepError(1)
    again.restore(estimate.state())
    assert again.of(3.0, -27 * one, one, one, none) == pytest.approx(0.5)


def test_halvings() -> None:
    assert [n_halvings(1e-3, s) for s in (None, 5e-4, 2.6e-4, 2.5e-4, 1e-3 / 4096)] == [
        5,
        1,
        1,
        2,
        12,
    ]
