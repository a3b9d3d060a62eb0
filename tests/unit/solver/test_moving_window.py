"""Steps of a window that moves with the train against steps of the whole line."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from measuring import COMM, History, check, continued, start_march
from scenes import load_scene
from scenes import mesh_of as scene_mesh
from scenes import problem_of as scene_problem
from small_lines import ac_simple_line, mesh_of, numerics, problem_of, train

from catenary import InputError
from catenary.meshgen.line import DropperPlace
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.slowest_wave import slowest_wave_of
from catenary.solver.problem.defects import DropperBreak
from catenary.solver.problem.ends import Fixed, Periodic
from catenary.solver.problem.problem import BOUNDED, EXACT, Damping, Problem, WindowChoice
from catenary.solver.time_loop import compiled_steps
from catenary.solver.time_loop import march as time_loop
from catenary.solver.time_loop.views.observers import Observer, StepView
from catenary.solver.window.choice import opens_window
from catenary.solver.window.moving_columns import MovedStations, columns_of, widen

LINE = ac_simple_line(12)
SPEED, START = 70.0, 330.0
# The order of sums differs where elimination ends elsewhere; contacts that close and open make
# 1e-14 of that some 1e-12, 3e-12 with the loops of OpenBLAS for AVX-512, in which form finding is
# rounded otherwise.
ROUND_OFF = 1e-11


def scene(seconds: float, line: Any = LINE, **changes: Any) -> tuple[Problem, LineMesh]:
    run = train(SPEED, START, START + SPEED * seconds, raise_time=0.2)
    return problem_of(line, train=run, **changes), mesh_of(line, 2)


def steps(problem: Problem, mesh: LineMesh, window: WindowChoice) -> tuple[History, list[int]]:
    """A march with a window, and how many stations it had after each step."""
    march, _ = start_march(replace(problem, window=window), mesh)
    sizes: list[int] = []

    def count(view: object) -> None:
        moving = march._line.window  # noqa: SLF001
        sizes.append(0 if moving is None else int(np.diff(moving.arrays.ends[2:4])[0]))

    history = History(count)
    try:
        history.outcome = march.run([history])
    finally:
        march.destroy()
    assert history.outcome.outcome == "done", history.outcome.outcome
    return history, sizes


@pytest.mark.parametrize("behind", [(0.0,), (0.0, 100.0)])
def test_an_exact_window_gives_the_forces_of_the_whole_line(behind: tuple[float, ...]) -> None:
    problem, mesh = scene(2.0)
    train = replace(
        problem.train,
        placements=tuple(replace(problem.train.placements[0], behind=b) for b in behind),
    )
    problem = replace(problem, train=train)
    whole, _ = steps(problem, mesh, WindowChoice())
    found, sizes = steps(problem, mesh, WindowChoice(EXACT))
    for channel in ("contact_force", "head_height", "arm_uplift", "dropper_force"):
        expected = whole[channel]
        check(channel, found[channel], expected, within=ROUND_OFF * np.abs(expected).max())
    assert sizes[10] < 0.9 * max(sizes), "the window grows with the waves"


def test_an_exact_window_ends_where_waves_are() -> None:
    """Its ends are stable, so that nothing grows there and runs ahead of the fastest wave."""
    words = ("line.n_spans=14", "train.end_m=255", "evaluation.from_m=200", "evaluation.to_m=250")
    case = load_scene("re330_stitched", words)
    problem, span = replace(scene_problem(case), window=WindowChoice(EXACT)), 65.0
    march, _ = start_march(problem, scene_mesh(case))
    try:
        march.run([])
        window = march._line.window  # noqa: SLF001
        assert window is not None
        end = float(window.arrays.high[window.arrays.ends[3] - 1])
    finally:
        march.destroy()
    fastest = max(slowest_wave_of(problem.line, wire) for wire in problem.line.wires)
    front = 130.0 + fastest * 1.5
    print(f"waves run to {front:.0f} m, the window ends at {end:.0f} m")
    assert front < end < front + 2.0 * span


def test_an_optional_window_is_left_out_where_none_can_be() -> None:
    problem, mesh = scene(0.1, numerics=numerics(1e-3, adaptive_tolerance=1.0))
    whole, _ = steps(problem, mesh, WindowChoice())
    found, sizes = steps(problem, mesh, WindowChoice(EXACT, optional=True))
    assert not any(sizes)
    np.testing.assert_array_equal(found["contact_force"], whole["contact_force"])


@pytest.mark.parametrize(
    "changes",
    [
        {"numerics": numerics(1e-3, integrator="hht", spectral_radius=0.8)},
        {"damping": Damping(2e-3, 0.0, {"droppers": (1e-4, 0.0)})},
        {
            "numerics": numerics(1e-3, integrator="hht", spectral_radius=0.8),
            "damping": Damping(2e-3, 0.0, {"droppers": (1e-4, 0.0)}),
        },
    ],
    ids=["hht", "components", "both"],
)
def test_other_methods_and_dampings_have_windows_too(changes: dict[str, Any]) -> None:
    problem, mesh = scene(0.6, **changes)
    whole, _ = steps(problem, mesh, WindowChoice())
    found, sizes = steps(problem, mesh, WindowChoice(EXACT))
    expected = whole["contact_force"]
    check("force", found["contact_force"], expected, within=ROUND_OFF * np.abs(expected).max())
    assert 0 < sizes[20] < max(sizes)


def test_a_bounded_window_follows_the_train_and_errs_little() -> None:
    """Waves fade within the window by the line's damping on stiffness."""
    problem, mesh = scene(3.0, ac_simple_line(24), damping=Damping(0.02, 0.0))
    whole, _ = steps(problem, mesh, WindowChoice())
    expected = whole["contact_force"][500:]
    errors = []
    for spans in (2, 4):
        found, sizes = steps(problem, mesh, WindowChoice(BOUNDED, None, spans, spans))
        off = found["contact_force"][500:] - expected
        errors.append(float(off.std() / expected.std()))
        assert max(sizes[10:]) < 0.5 * sizes[0]
    print("error of the force history in sigma, 2 and 4 spans to both sides:", errors)
    assert errors[0] < 1e-6
    assert errors[1] < 1e-2 * errors[0]
    found, sizes = steps(problem, mesh, WindowChoice(BOUNDED, 1e-6))
    off = found["contact_force"][500:] - expected
    assert off.std() < 1e-5 * expected.std()
    assert max(sizes[10:]) < sizes[0]


def test_what_a_window_has_left_has_no_energy() -> None:
    """It is held where it was, which on a line without a window comes to rest.

    Spans ring at some 1.1 Hz. A damping of 0.02 s on stiffness takes of their energy 0.96 1/s, and
    a span is passed in 0.79 s: each span has 0.47 of the energy of the one ahead of it, and those
    beyond the third have 0.47^3 = 0.10 of all.
    """
    problem, mesh = scene(12.0, ac_simple_line(24), damping=Damping(0.02, 0.0))

    def energies(window: WindowChoice) -> np.ndarray:
        seen: list[tuple[float, ...]] = []
        march, _ = start_march(replace(problem, window=window), mesh)
        with march:
            march.run(
                [
                    History(
                        lambda view: seen.append(view.energies()) if view.step % 50 == 0 else None
                    )
                ]
            )
        return np.sum(seen, axis=1)[60:]  # kinetic and elastic, from 3 s on

    whole = energies(WindowChoice())
    found = energies(WindowChoice(BOUNDED, None, 3, 3))
    lost = 1.0 - found / whole
    print("energy beyond the window, of the whole, least and most:", lost.min(), lost.max())
    assert lost.min() > 0.0
    assert lost.max() < 0.15


class Rows(Observer):
    """Keeps the rows of all steps, which come in blocks."""

    def __init__(self) -> None:
        self.rows: list[np.ndarray] = []

    def next_state(self, step: int) -> int:
        return step + 1 if step % 90 == 0 else step - step % 90 + 90

    def observe(self, view: StepView) -> None:
        self.rows += list(view.rows.copy())

    def finish(self, outcome: str) -> None:
        assert outcome == "done"


def rows_of(problem: Problem, mesh: LineMesh, window: WindowChoice) -> np.ndarray:
    seen = Rows()
    march, _ = start_march(replace(problem, window=window), mesh)
    with march:
        march.run([seen])
    return np.array(seen.rows)


@pytest.mark.parametrize("n_rows", [pytest.param(1, marks=pytest.mark.study), 7, 64])
def test_rows_of_blocks_show_what_moves_and_what_rests(
    n_rows: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bit by bit what steps one by one show, which look at the whole line."""
    problem, mesh = scene(0.5, ac_simple_line(24))
    monkeypatch.setattr(compiled_steps, "_BLOCK_BYTES", 0)
    monkeypatch.setattr(compiled_steps, "_ROWS_OF_PART", n_rows)
    choices = WindowChoice(EXACT), WindowChoice(BOUNDED, None, 2, 2), WindowChoice(BOUNDED, 1e-3)
    for window in choices:
        with monkeypatch.context() as patch:
            patch.setattr(time_loop, "compiled_steps", lambda *arguments: None)
            expected = rows_of(problem, mesh, window)
        found = rows_of(problem, mesh, window)
        assert np.array_equal(found, expected, equal_nan=True), window
        rest = np.ptp(found[9:], axis=0) == 0.0
        print(window, "columns that rest:", np.count_nonzero(rest), "of", rest.size)
        assert 0.2 < rest.mean() < 0.95


def test_a_row_is_out_of_date_where_anything_moved_since_it_was_filled() -> None:
    ends, starts = np.array([0, 2]), np.arange(0, 22, 2)
    wires = np.array([[3, 5], [4, 8], [0, 1], [18, 19]])
    columns = columns_of((wires,), 20, (ends, starts))
    assert columns.first[:, 0].tolist() == [0, 0, 0, 1, 1, 3, 3, 3, 3, 3, 4]
    assert columns.last[:, 0].tolist() == [0, 3, 3, 3, 3, 3, 3, 3, 3, 3, 4]
    moved = MovedStations(2, columns)
    moved.begin(0)
    assert moved.behind.tolist() == [[0, 10], [0, 10]] and moved.now.tolist() == [0, 2]
    ends[:] = 1, 4
    widen(moved.now, *ends.tolist())
    moved.end(1, 1)
    assert moved.behind.tolist() == [[0, 4], [0, 10]]
    moved.begin(1)
    assert moved.now.tolist() == [1, 4]
    moved.end(3, 2)
    assert moved.behind.tolist() == [[1, 4], [1, 4]]
    moved.begin(4)
    assert moved.behind.tolist() == [[0, 10], [0, 10]], "a step was taken elsewhere"


def test_a_window_may_end_where_elements_are_short() -> None:
    """Where the step operator is stiffness more than mass, an end that is held within a step is
    unstable: the shipped case has elements of 0.275 m in the spans that a train starts in."""
    given = ("train.pantographs=[{name='lumped'}]", "window.mode=bounded")
    spans = ("window.spans_ahead=2", "window.spans_behind=2")
    made = load_scene("ambrosio2012", (*given, *spans))
    problem, mesh = scene_problem(made), scene_mesh(made)
    problem = replace(problem, train=replace(problem.train, end=problem.train.start + 66.0))
    found, _ = steps(problem, mesh, problem.window)
    assert np.abs(found["dropper_force"]).max() < 1e3


def test_a_window_goes_on_after_a_restart_as_if_nothing_had_happened() -> None:
    problem, mesh = scene(0.5)
    problem = replace(problem, window=WindowChoice(BOUNDED, None, 2, 2))
    whole, rest = continued(problem, mesh, 203)
    assert np.array_equal(rest["contact_force"], whole["contact_force"][203:])


def test_what_happens_ahead_of_an_exact_window_is_part_of_it() -> None:
    problem, mesh = scene(0.5, ac_simple_line(24))
    droppers = np.sort(mesh.x(mesh.droppers[:, 1]))
    far = float(droppers[np.searchsorted(droppers, START + 700.0)])
    incidents = (DropperBreak(0.1, DropperPlace(far)),)
    effects = problem.effects | {"dropper_break"}
    problem = replace(problem, incidents=incidents, effects=effects)
    whole, _ = steps(problem, mesh, WindowChoice())
    found, sizes = steps(problem, mesh, WindowChoice(EXACT))
    for channel in ("contact_force", "arm_uplift"):
        expected = whole[channel]
        check(channel, found[channel], expected, within=ROUND_OFF * np.abs(expected).max())
    assert sizes[99] < sizes[110]


@pytest.mark.parametrize(
    ("changed", "ranks", "says"),
    [
        ({"scheme": "fixed_point"}, 1, "numerics.scheme is fixed_point"),
        ({"coupling": "explicit"}, 1, "numerics.coupling is explicit"),
        ({"adaptive_tolerance": 1.0}, 1, "numerics.adaptive_tolerance_N lets steps be halved"),
        ({}, 2, "the run has 2 ranks"),
        ({}, 1, "an end of the line is periodic"),
    ],
)
def test_a_window_that_cannot_be_is_refused(changed: dict[str, Any], ranks: int, says: str) -> None:
    problem, _ = scene(0.1)
    problem = replace(
        problem, window=WindowChoice(EXACT), numerics=replace(problem.numerics, **changed)
    )
    if not changed and ranks == 1:
        problem = replace(problem, ends=(Fixed(), Periodic()))
    with pytest.raises(InputError, match=f"window.mode is exact.*{says}"):
        opens_window(problem, ranks, True)
    assert COMM.size == 1
