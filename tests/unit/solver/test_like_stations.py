"""Columns of A^-1: how far they reach, and like stretches that share them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from axial_lines import ALONG, elastic_line, elastic_wires
from measuring import COMM, line_alone, matrix_of
from scipy.sparse import identity
from scipy.sparse import linalg as sparse_linalg
from small_lines import (
    BARE,
    HANGING,
    ac_simple_line,
    bare_wires,
    en50318_line,
    mesh_of,
    numerics,
    problem_of,
)

from catenary import RunBroken
from catenary.solver.effects.build_model import build
from catenary.solver.integrators.line_integrator import LineIntegrator, make_line
from catenary.solver.linear import unit_responses
from catenary.solver.linear.station_rows import LikeStations
from catenary.solver.linear.unit_responses import (
    DECAY,
    Forces,
    ShortColumns,
    UnitResponses,
    Windows,
    reach,
)
from catenary.solver.model import matrices
from catenary.solver.model.matrices import OperatorBands
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.model.unknowns import Unknowns
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.form_finding import find_form

# --- like stretches of a line are found before there are matrices, and their columns stored -------


DAMPED = HANGING | {"structural_damping"}
# M, K and C in A for steps of 0.2 ms: columns reach less than a span.
COEFFICIENTS = (1.0, 1e-8, 1e-4)


def model_of(n_spans: int) -> Model:
    line = ac_simple_line(n_spans)
    problem = problem_of(line, DAMPED, damping=Damping(2.75e-4, 0.0))
    return find_form(problem, mesh_of(line, 5))[0]


@pytest.fixture(scope="module")
def long_line() -> Model:
    return model_of(12)


def columns_of(model: Model) -> tuple[ShortColumns, np.ndarray]:
    """Columns of both unknowns of all nodes of the contact wire, and these unknowns."""
    windows = Windows(model.numbering, reach(model, OperatorBands(model, COEFFICIENTS)))
    responses = UnitResponses(
        COMM, model, distribute(model, 1, 0), OperatorBands(model, COEFFICIENTS), windows
    )
    nodes = model.contact_nodes
    dofs = np.stack([model.dofs(nodes), model.dofs(nodes, "theta_y")], axis=1)
    free = np.ones(model.n_dofs)
    free[model.constrained] = 0.0
    x = model.mesh.x(nodes)
    forces = Forces(dofs[:, :, None], free[dofs][:, :, None], x, np.zeros(x.size))
    return responses.columns(forces), dofs


def rows_of_stations(model: Model) -> list[np.ndarray]:
    """All that stands in the rows of a station: M, K and C from the station before to the next,
    each in terms of its largest number."""
    starts, width = model.numbering.starts, model.numbering.width
    parts = [matrix_of(model, *np.eye(3)[k]).tocsr() for k in range(3)]
    found = []
    for i, (first, last) in enumerate(zip(starts[:-1], starts[1:], strict=True)):
        low, high = max(0, first - width), min(starts[-1], last + width)
        rows = [part[first:last, low:high].toarray() for part in parts]
        rows = [own / np.abs(own).max() for own in rows]
        found.append(np.concatenate([[i == 0, i == starts.size - 2], *map(np.ravel, rows)]))
    return found


def test_stations_of_one_mark_have_the_same_rows(long_line: Model) -> None:
    marks, rows = LikeStations(long_line).marks, rows_of_stations(long_line)
    of_mark: dict[int, np.ndarray] = {}
    for mark, row in zip(marks.tolist(), rows, strict=True):
        assert np.array_equal(row, of_mark.setdefault(mark, row))
    of_row = {(row + 0.0).tobytes() for row in rows}
    print(f"{marks.size} stations, {len(of_mark)} marks, {len(of_row)} kinds of rows")
    # Twelve spans that are alike but for where they are, and the line's ends.
    assert len(of_mark) == len(of_row) < marks.size / 10


def test_one_spring_that_differs_parts_what_is_within_its_stretch(long_line: Model) -> None:
    like = LikeStations(long_line)
    blocks = list(long_line.blocks)
    number = next(i for i, block in enumerate(blocks) if block.component == "droppers")
    block = blocks[number]
    assert block.stiffness is not None
    kind = block.kind.copy()
    kind[40] = len(block.stiffness)
    changed = block.stiffness[block.kind[[40]]] * (1.0 + 1e-15)
    stiffness = np.concatenate([block.stiffness, changed])
    blocks[number] = replace(block, kind=kind, stiffness=stiffness)
    other = LikeStations(replace(long_line, blocks=blocks))
    unknown = block.dofs[40]
    station = np.searchsorted(long_line.numbering.starts, unknown.min(), side="right") - 1
    differing = np.flatnonzero(like.marks != other.marks)
    assert differing.tolist() == [station]
    ends = np.array([station, station + 1])
    before = like.fingerprints(ends - 5, ends)
    after = other.fingerprints(ends - 5, ends)
    assert before[0] == after[0]
    assert before[1] != after[1]


def test_columns_that_places_share_are_those_of_each(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shared and apart they differ by what lies beyond the reach, and by the round-off of
    factorisations with a condition number of about 1e3."""
    model = model_of(30)
    shared, dofs = columns_of(model)
    monkeypatch.setattr(
        LikeStations,
        "fingerprints",
        lambda self, first, last: np.arange(first.size, dtype=np.uint64),
    )
    apart, _ = columns_of(model)
    assert np.array_equal(shared.start, apart.start)
    assert np.array_equal(shared.width, apart.width)
    assert np.unique(apart.at).size == len(dofs) > 1.5 * np.unique(shared.at).size
    worst = 0.0
    for i in range(len(dofs)):
        n = 2 * shared.width[i]
        one, other = shared.data[shared.at[i] :][:n], apart.data[apart.at[i] :][:n]
        worst = max(worst, np.abs(one - other).max() / np.abs(other).max(initial=1e-300))
    print(f"largest difference {worst:.1e} of the peak")
    assert worst < 1e3 * np.finfo(float).eps


def test_columns_of_a_longer_line_take_hardly_more_room() -> None:
    """Lengths of droppers differ in their last digits from span to span, less and less."""
    sizes = {n: columns_of(model_of(n))[0].data.nbytes for n in (30, 60)}
    print({n: f"{size / 1e6:.2f} MB" for n, size in sizes.items()})
    assert sizes[60] < 1.3 * sizes[30]


@pytest.mark.parametrize("at_once", [1, 500, 2**14])
def test_bands_of_a_stretch_are_those_of_its_own_matrix(
    long_line: Model, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whether put together alone or with others: terms are added in one order."""
    monkeypatch.setattr(matrices, "_AT_ONCE", at_once)
    starts, n = long_line.numbering.starts, long_line.n_dofs
    whole = matrix_of(long_line, *COEFFICIENTS).toarray()
    whole[np.diag_indices(n)] += np.isin(np.arange(n), long_line.constrained)
    bands = OperatorBands(long_line, COEFFICIENTS)
    for begin, end in ((0, 4), (1, 60), (40, 120), (10, 50), (200, starts.size - 1)):
        first, last = int(starts[begin]), int(starts[end])
        found, own = bands.between(first, last), whole[first:last, first:last]
        assert found.shape[1] == last - first
        for number, band in enumerate(found):
            assert np.array_equal(band[: last - first - number], np.diagonal(own, -number))
        further = np.tril(own, -len(found))
        assert not further.any()


# --- columns of A^-1 of long reach end where forces are felt --------------------------------------


@pytest.mark.parametrize(
    ("margin", "within"),
    [(1.1, 1e-13), (0.5, 1e-12)],
    ids=["as it is", "some are felt further"],
)
def test_columns_of_long_reach_end_where_forces_are_felt(
    margin: float, within: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(unit_responses, "_MARGIN", margin)
    # As much damping as the paper's lets a force along the track reach ten times as far.
    problem = problem_of(elastic_line(3), ALONG, damping=Damping(0.0275, 0.0))
    found = find_form(problem, mesh_of(elastic_line(3), 3))[0]
    made = make_line(COMM, found, distribute(found, 1, 0), numerics(1e-3), True)
    nodes = found.mesh.wires["contact_wire"][20:120:9]
    dofs = found.dofs(nodes)[:, None, None]
    x = found.mesh.x(nodes)
    given = unit_responses.Forces(dofs, np.ones(dofs.shape), x, np.zeros(x.size))
    short = made.responses.columns(given)
    monkeypatch.setattr(unit_responses, "_LONG", np.inf)
    whole = made.responses.columns(given)
    assert short.reach <= whole.reach and short.data.size <= whole.data.size
    for place in range(nodes.size):
        columns = []
        for kept in (short, whole):
            column = np.zeros(found.n_dofs)
            begin, at, width = kept.start[place], kept.at[place], kept.width[place]
            column[begin : begin + width] = kept.data[at : at + width]
            columns.append(column)
        assert np.abs(columns[0] - columns[1]).max() < within * np.abs(columns[1]).max()
    made.destroy()


# --- how far A^-1 reaches -------------------------------------------------------------------------


def line_model(alpha: float, n_spans: int = 12, elements: int = 5) -> Model:
    """The AC line, with the damping on stiffness alone that the paper varies."""
    line = ac_simple_line(n_spans)
    problem = problem_of(line, DAMPED, damping=Damping(alpha, 0.0))
    return find_form(problem, mesh_of(line, elements))[0]


def positions(model: Model) -> np.ndarray:
    """Place of every unknown along the track [m]."""
    return model.numbering.as_vector(model.mesh.points[:, :1])


def inverse_columns(
    model: Model, coefficients: tuple[float, float, float], rows: np.ndarray
) -> np.ndarray:
    """Columns of A^-1 by an independent factorisation of the whole line."""
    mass, stiffness, damping = coefficients
    matrix = matrix_of(model, mass, stiffness, damping)
    held = np.zeros(model.n_dofs)
    held[model.constrained] = 1.0
    factor = sparse_linalg.splu((matrix + identity(model.n_dofs).multiply(held)).tocsc())
    return factor.solve(np.eye(model.n_dofs)[:, rows])


@pytest.mark.parametrize("dt", [0.25e-3, 1e-3, 4e-3])
@pytest.mark.parametrize("alpha", [0.0, 2.75e-3, 2.75e-2])
def test_columns_vanish_beyond_a_reach_of_less_than_a_span(alpha: float, dt: float) -> None:
    """beta dt^2 and gamma dt of average acceleration; paper's dampings; steps from 0.25 to 4 ms."""
    model = line_model(alpha)
    coefficients = (1.0, 0.25 * dt**2, 0.5 * dt)
    found = reach(model, OperatorBands(model, coefficients))
    x = positions(model)
    # Loads in every part of two spans: on wires, near droppers, masts, in gaps.
    rows = np.flatnonzero((x > 270.0) & (x < 335.0))[::3]
    columns = np.abs(inverse_columns(model, coefficients, rows))
    outside = np.abs(x[:, None] - x[rows]) > found
    leak = np.where(outside, columns, 0.0).max(axis=0) / columns.max(axis=0)
    print(f"alpha {alpha:g} s, dt {1e3 * dt:g} ms: reach {found:.1f} m, leak {leak.max():.1e}")
    assert leak.max() <= DECAY
    assert found < 55.0
    # Not wasteful either: within half of it columns have not yet vanished.
    inside = np.abs(x[:, None] - x[rows]) > 0.5 * found
    assert np.where(inside, columns, 0.0).max() > DECAY * columns.max()


def test_a_line_too_short_for_the_decay_is_taken_whole() -> None:
    """20 m of wire in elements of 1 m at 4 ms: nothing vanishes within 10 m."""
    line = bare_wires(20.0)
    model = build(problem_of(line, BARE), mesh_of(line, 20), np.zeros(0))
    assert reach(model, OperatorBands(model, (1.0, 0.25 * 4e-3**2, 2e-3))) == 20.0


def test_waves_along_wires_reach_far_but_not_over_the_whole_line() -> None:
    """At 8 ms a wave along a wire of c = 3700 m/s goes 29 m; A^-1 decays by e in half of that, and
    by 1e-16 in 37 times that, more than the first window shows."""
    wires = elastic_wires(2400.0)
    model = build(problem_of(wires, BARE | {"axial_motion"}), mesh_of(wires, 400), np.zeros(0))
    coefficients = (1.0, 0.25 * 8e-3**2, 4e-3)
    found = reach(model, OperatorBands(model, coefficients))
    assert 400.0 < found < 900.0
    x = positions(model)
    rows = np.flatnonzero((x > 1100.0) & (x < 1120.0))
    columns = np.abs(inverse_columns(model, coefficients, rows))
    outside = np.abs(x[:, None] - x[rows]) > found
    assert (np.where(outside, columns, 0.0).max(axis=0) <= DECAY * columns.max(axis=0)).all()


def test_droppers_far_apart_do_not_lengthen_the_reach() -> None:
    """The reach is a matter of wires and steps, not of the length of the line."""
    line = en50318_line(4), en50318_line(12)
    found = []
    for one in line:
        model, _ = find_form(problem_of(one, DAMPED), mesh_of(one, 4))
        found.append(reach(model, OperatorBands(model, (1.0, 0.25e-6, 0.5e-3))))
    # The middle falls on a mast in both: the same surroundings.
    assert found[0] == pytest.approx(found[1], abs=1e-9)


@pytest.fixture(scope="module")
def stepper() -> Iterator[LineIntegrator]:
    with line_alone(line_model(2.75e-3, n_spans=6), numerics(1e-3)) as line:
        yield line


def test_short_columns_are_the_columns_of_full_solves(stepper: LineIntegrator) -> None:
    """Solves are of stretches, and only windows are stored, like ones once: nothing is lost."""
    model = line_model(2.75e-3, n_spans=6)
    ends = model.dofs(model.mesh.droppers)
    x = model.mesh.x(model.mesh.droppers[:, 1])
    pair = np.broadcast_to(np.array([1.0, -1.0]), ends.shape)
    forces = Forces(ends[:, None], pair[:, None], x, np.zeros(x.size))
    found = stepper.responses.columns(forces)
    coefficients = (1.0, stepper.position_factor, stepper.velocity_factor)
    exact = inverse_columns(model, coefficients, ends[:, 0])
    exact -= inverse_columns(model, coefficients, ends[:, 1])
    short = np.zeros_like(exact)
    for column in range(x.size):
        begin, at, width = found.start[column], found.at[column], found.width[column]
        short[begin : begin + width, column] = found.data[at : at + width]
    peak = np.abs(exact).max(axis=0)
    worst = (np.abs(short - exact).max(axis=0) / peak).max()
    stored = found.data.size / exact.size
    # Two factorisations of a matrix with a condition number of about 1e3.
    print(f"largest difference {worst:.1e} of the peak; {stored:.0%} of the entries stored")
    assert worst < 1e3 * np.finfo(float).eps
    assert stored < 0.5


def test_columns_that_leak_are_refused(stepper: LineIntegrator) -> None:
    model = line_model(2.75e-3, n_spans=6)
    nodes = model.mesh.wires["contact_wire"][40:44]
    dofs, x = model.dofs(nodes)[:, None], model.mesh.x(nodes)
    too_short = Windows(model.numbering, 4.0)
    ones = np.ones((*dofs.shape, 1))
    coefficients = (1.0, stepper.position_factor, stepper.velocity_factor)
    responses = UnitResponses(
        COMM, model, stepper.ownership, OperatorBands(model, coefficients), too_short
    )
    with pytest.raises(RunBroken, match=r"does not decay within 4 m.*numerics\.dt_s"):
        responses.columns(Forces(dofs[:, None], ones, x, np.zeros(x.size)))


def test_windows_hold_all_unknowns_within_reach() -> None:
    """Stations of nodes that stand apart: of the second from 1.0 to 1.2 m."""
    low, high = np.array([[0.0, 1.0, 2.5, 4.0], [0.0, 1.2, 2.5, 4.0]])
    station_type, station, numbers = np.zeros(4, np.int64), np.arange(8) // 2, np.arange(8)[:, None]
    starts, places = np.arange(0, 10, 2), ((0, 1),)
    numbering = Unknowns(
        ("w",), numbers, station, starts, (2,), places, station_type, True, low, high
    )
    windows = Windows(numbering, 1.3)
    assert windows.around(2.5, 2.5) == (2, 6)
    assert windows.around(0.0, 0.0) == (0, 4)
    assert windows.around(0.0, 2.7) == (0, 8)
    assert windows.around(5.4, 9.0) == (8, 8)


def test_reach_covers_gaps_of_very_different_lengths() -> None:
    """Long elements decay slowly: the middle of the line, at a mast between short ones, is no
    measure for loads next to the long gap."""
    positions_in_span = (10.4, 36.8, 43.6, 46.2, 47.7)
    usual = en50318_line(5)
    line = replace(
        usual,
        span_lengths=(49.3,) * 5,
        dropper_positions=(positions_in_span,) * 5,
        pre_sag=((0.0,) * 5,) * 5,
    )
    problem = problem_of(line, DAMPED, damping=Damping(3.5e-3, 0.0))
    model = find_form(problem, mesh_of(line, 4))[0]
    dt = 1e-3
    coefficients = (1.0, 0.25 * dt**2, 0.5 * dt)
    found = reach(model, OperatorBands(model, coefficients))
    free = np.setdiff1d(np.arange(model.n_dofs), model.constrained)
    columns = np.abs(inverse_columns(model, coefficients, free))
    x = positions(model)
    far = np.abs(x[:, None] - x[free]) > found
    assert far.any(), "the line is too short to show anything"
    leak = np.where(far, columns, 0.0).max(axis=0) / columns.max(axis=0)
    print(f"reach {found:.1f} m, largest share beyond it {leak.max():.1e}")
    assert leak.max() < 10 * DECAY
