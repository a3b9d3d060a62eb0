"""Steps of a window that moves with the train, and its pieces of matrices."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from measuring import COMM, History, check, continued, start_march
from scenes import load_scene
from scenes import mesh_of as scene_mesh
from scenes import problem_of as scene_problem
from small_lines import WHOLE, ac_simple_line, mesh_of, numerics, problem_of, train
from stitched_line import stitched_line

from catenary import InputError, RunBroken
from catenary.meshgen.line import DropperPlace
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.slowest_wave import slowest_wave_of
from catenary.solver.linear import pieces, unit_responses
from catenary.solver.model import matrices
from catenary.solver.model.model import Block
from catenary.solver.problem.defects import DropperBreak
from catenary.solver.problem.ends import Fixed, Periodic
from catenary.solver.problem.problem import BOUNDED, EXACT, Damping, Problem, WindowChoice
from catenary.solver.statics.form_finding import find_form
from catenary.solver.time_loop import compiled_steps
from catenary.solver.time_loop import march as time_loop
from catenary.solver.time_loop.views.observers import Observer, StepView
from catenary.solver.window import moving_window
from catenary.solver.window.choice import opens_window
from catenary.solver.window.moving_columns import MovedStations, columns_of, widen

# --- steps of a window that moves with the train against steps of the whole line ------------------


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


# --- A long line whose matrices, factors and columns are made by pieces, as a window needs them ---


SPANS = 60
WINDOW = WindowChoice(BOUNDED, None, 2, 2, 1.0)
# Forces are some 100 N; pieces differ from the whole by the order of sums.
PIECES_ROUND_OFF = 1e-9


def long_scene(seconds: float, line: Any = None, **changes: Any) -> tuple[Problem, Any]:
    line = ac_simple_line(SPANS) if line is None else line
    run = train(
        SPEED,
        START,
        START + SPEED * seconds,
        raise_time=0.2,
    )
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
    problem, mesh = long_scene(seconds, **changes)
    found, operators, energies = histories(problem, mesh)
    n_pieces, n_slots = operators.pieces.edges.size - 1, operators.pieces.n_slots
    print(n_pieces, "pieces,", n_slots, "slots")
    assert n_pieces > n_slots
    monkeypatch.setattr(pieces.Pieces, "are_few", True)
    whole, none, whole_energies = histories(problem, mesh)
    assert none is None
    for channel in ("contact_force", "head_height", "arm_uplift", "dropper_force"):
        expected = whole[channel]
        check(
            channel,
            found[channel],
            expected,
            within=PIECES_ROUND_OFF * np.abs(expected).max(),
        )
    largest = np.abs(whole_energies).max()
    check(
        "energies",
        np.array(energies),
        np.array(whole_energies),
        within=PIECES_ROUND_OFF * largest,
    )


@pytest.mark.usefixtures("small")
def test_a_march_in_pieces_goes_on_after_a_restart_as_if_nothing_had_happened() -> None:
    problem, mesh = long_scene(3.0)
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
    problem, mesh = long_scene(1.0)
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
    _, operators, _ = histories(*long_scene(1.0))
    factors, made = operators.factors, operators.pieces.first()
    _, (rows,) = pieces.rows_on(operators._model, made, operators._coefficients)
    broken = rows._replace(blocks=np.full_like(rows.blocks, np.nan))
    with pytest.raises(RunBroken, match="singular or not finite"):
        factors.make(made, broken)


# --- parts of a line's matrices, put together by stretches ----------------------------------------


@pytest.mark.parametrize("rows", [(0, None), (36, 400), (36, 36)])
def test_stretches_make_the_matrix_to_the_bit(
    rows: tuple[int, int | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, _ = find_form(problem_of(ac_simple_line(3), WHOLE), mesh_of(ac_simple_line(3), 3))
    width, n = model.numbering.width, model.n_dofs
    here = rows[0], n if rows[1] is None else rows[1]
    asked = model, here, (0, n), (1.0, 0.3, 0.2), 1.0, width
    whole = matrices.part_of(*asked)
    monkeypatch.setattr(matrices, "_STRETCH", 10 * width + 1)
    parts = matrices.part_of(*asked)
    assert parts.shape == whole.shape == (here[1] - here[0], n)
    assert parts.blocksize == whole.blocksize == (width, width)
    for name in ("data", "indices", "indptr"):
        assert np.array_equal(getattr(parts, name), getattr(whole, name)), name


# --- elements of a block that are near a range of unknowns, whatever their order ------------------


N = 101  # no multiple of what is looked for together


@pytest.mark.parametrize("ordered", [True, False])
def test_all_elements_of_a_range_are_among_those_near(ordered: bool) -> None:
    first = 2 * np.arange(N)
    dofs = first[:, None] + np.arange(4)
    if not ordered:
        dofs = dofs[np.random.default_rng(3).permutation(N)]
    block = Block("wire", dofs, np.arange(N), None, None)
    for low, high in ((0, 4), (60, 61), (100, 180), (200, 204), (0, 204)):
        found = np.arange(N)[block.near(low, high)]
        inside = np.flatnonzero(((dofs >= low) & (dofs < high)).any(axis=1))
        assert np.isin(inside, found).all()
        if ordered:  # and few others, in order
            assert (np.diff(found) == 1).all() and found.size <= inside.size + 32


def test_a_block_without_elements_has_none_near() -> None:
    block = Block("wire", np.zeros((0, 4), dtype=np.int64), np.zeros(0, int), None, None)
    assert np.arange(0)[block.near(0, 10)].size == 0
