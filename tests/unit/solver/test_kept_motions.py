"""Motions that blocks of steps keep for those who look later, against the same steps one by one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from measuring import start_march
from small_lines import WHOLE, ac_simple_line, mesh_of, numerics, problem_of, train

from catenary.meshgen.mesh import MESSENGER_WIRE
from catenary.solver.contact_problem import coupling
from catenary.solver.problem.defects import TensionLoss
from catenary.solver.problem.problem import BOUNDED, EXACT, Problem, WindowChoice
from catenary.solver.time_loop import compiled_steps
from catenary.solver.time_loop import march as time_loop
from catenary.solver.time_loop.views import shown_line, step_views
from catenary.solver.time_loop.views.observers import Observer, StepView
from catenary.solver.time_loop.views.shown_line import ShownMotion

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
