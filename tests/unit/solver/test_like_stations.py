"""Like stretches of a line are found before there are matrices, and their columns stored once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import COMM, matrix_of
from small_lines import HANGING, ac_simple_line, mesh_of, problem_of

from catenary.solver.linear.station_rows import LikeStations
from catenary.solver.linear.unit_responses import (
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
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.form_finding import find_form

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
