"""A long line whose matrices, factors and columns are made by pieces, as a window needs them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from measuring import History, check, start_march
from small_lines import ac_simple_line, mesh_of, numerics, problem_of, train
from stitched_line import stitched_line

from catenary import RunBroken
from catenary.solver.linear import pieces, unit_responses
from catenary.solver.problem.problem import BOUNDED, Damping, Problem, WindowChoice
from catenary.solver.window import moving_window

SPEED, START, SPANS = 70.0, 330.0, 60
WINDOW = WindowChoice(BOUNDED, None, 2, 2, 1.0)
# Forces are some 100 N; pieces differ from the whole by the order of sums.
ROUND_OFF = 1e-9


def scene(seconds: float, line: Any = None, **changes: Any) -> tuple[Problem, Any]:
    line = ac_simple_line(SPANS) if line is None else line
    run = train(SPEED, START, START + SPEED * seconds, raise_time=0.2)
    return replace(problem_of(line, train=run, **changes), window=WINDOW), mesh_of(line, 2)


def histories(problem: Problem, mesh: Any) -> tuple[History, Any, list[tuple[float, float]]]:
    march, _ = start_march(problem, mesh)
    energies: list[tuple[float, float]] = []
    history = History(
        lambda view: energies.append(view.energies()) if view.step % 50 == 0 else None
    )
    with march:
        outcome = march.run([history])
    assert outcome.outcome == "done", outcome.outcome
    return history, march._line.operators.in_pieces, energies  # noqa: SLF001


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pieces so small that a train comes across many of them."""
    monkeypatch.setattr(pieces, "_SIZE", 32)
    monkeypatch.setattr(moving_window, "_AROUND", 16)


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize(
    ("seconds", "changes"),
    [
        pytest.param(5.0, {}, marks=pytest.mark.study),
        (1.0, {"numerics": numerics(1e-3, integrator="hht", spectral_radius=0.8)}),
        (1.0, {"damping": Damping(2e-3, 0.0, {"droppers": (1e-4, 0.0)})}),
        (1.0, {"line": stitched_line(SPANS)}),
    ],
    ids=["newmark", "hht", "components", "station types"],
)
def test_pieces_give_what_the_whole_line_gives(
    seconds: float, changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, mesh = scene(seconds, **changes)
    found, operators, energies = histories(problem, mesh)
    n_pieces, n_slots = operators.pieces.edges.size - 1, operators.pieces.n_slots
    print(n_pieces, "pieces,", n_slots, "slots")
    assert n_pieces > n_slots
    monkeypatch.setattr(pieces.Pieces, "are_few", True)
    whole, none, whole_energies = histories(problem, mesh)
    assert none is None
    for channel in ("contact_force", "head_height", "arm_uplift", "dropper_force"):
        expected = whole[channel]
        check(channel, found[channel], expected, within=ROUND_OFF * np.abs(expected).max())
    largest = np.abs(whole_energies).max()
    check("energies", np.array(energies), np.array(whole_energies), within=ROUND_OFF * largest)


@pytest.mark.usefixtures("small")
def test_a_march_in_pieces_goes_on_after_a_restart_as_if_nothing_had_happened() -> None:
    problem, mesh = scene(3.0)
    kept: list[Any] = []
    energies: list[tuple[float, float]] = []

    def look(view: Any) -> None:
        if view.step == 2403:
            kept.append(view.checkpoint())
        if view.step >= 2403 and view.step % 20 == 0:
            energies.append(view.energies())

    whole, rest = History(look), History(look)
    march, _ = start_march(problem, mesh)
    with march:
        march.run([whole])
    first, energies = energies, []
    again, _ = start_march(problem, mesh)
    with again:
        again.restore(kept[0])
        again.run([rest])
    assert np.array_equal(rest["contact_force"], whole["contact_force"][2403:])
    assert len(first) == 30
    check("energies", np.array(energies), np.array(first), within=1e-12 * np.abs(first).max())


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize(
    ("margin", "goes_on"), [(0.85, True), pytest.param(0.5, False, marks=pytest.mark.study)]
)
def test_columns_that_reach_further_than_those_tried_are_borne_or_told(
    margin: float, goes_on: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where spans differ, and the line answers further from some than from those tried.

    Of windows that are 0.85 as wide as 1e-12 is felt some 1e-10 stands outside, of 0.5 some 1e-6.
    """
    problem, mesh = scene(1.0)
    whole, _, _ = histories(problem, mesh)
    monkeypatch.setattr(unit_responses, "_LONG", 1.0)
    monkeypatch.setattr(unit_responses, "_MARGIN", margin)
    if goes_on:
        found, operators, _ = histories(problem, mesh)
        assert operators is not None
        expected = whole["contact_force"]
        # Measured 1.2e-7, as links stand still in less of the ends of a window, too; that such a
        # window has two spans to each side costs 1e-2.
        check("force", found["contact_force"], expected, within=1e-6 * expected.max())
        return
    march, _ = start_march(problem, mesh)
    with march:
        outcome = march.run([])
    assert "which a window cannot follow; set window.mode to off" in outcome.outcome


@pytest.mark.usefixtures("small")
def test_factors_of_pieces_must_be_finite() -> None:
    _, operators, _ = histories(*scene(1.0))
    factors, made = operators.factors, operators.pieces.first()
    _, (rows,) = pieces.rows_on(operators._model, made, operators._coefficients)
    broken = rows._replace(blocks=np.full_like(rows.blocks, np.nan))
    with pytest.raises(RunBroken, match="singular or not finite"):
        factors.make(made, broken)
