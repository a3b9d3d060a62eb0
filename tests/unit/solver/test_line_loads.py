"""Loads in time on a rank: functions of time, slices that are held, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from small_lines import HANGING, en50318_line, mesh_of, problem_of

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.effects.build_model import build
from catenary.solver.integrators import line_loads
from catenary.solver.integrators.line_loads import LineLoads
from catenary.solver.linear.line_products import Subdomain
from catenary.solver.model.loads import (
    FieldLoad,
    FunctionLoad,
    ShapeLoad,
    constant,
    harmonics,
    table,
)
from catenary.solver.wind import forces_along

NOBODY = np.zeros(0, dtype=np.int64)
WHOLE = Subdomain(0, 12, 0, 12, 0, 12)


def test_shapes_times_functions_of_time_add_up() -> None:
    courses = (constant(2.0), table([0.0, 1.0], [5.0, 7.0]), harmonics([2.0], [3.0], [0.5], 1.0))
    where = np.array([1, 4, 4, 9])
    forces = np.array([1.0, 10.0, 100.0, 1000.0])
    loads = LineLoads([ShapeLoad(where, forces, course) for course in courses], WHOLE, NOBODY)
    assert loads.changes
    shape = np.bincount(where, forces, minlength=12)
    for time, expected in ((-1.0, 5.0), (0.25, 5.5), (0.0, 5.0), (1.0, 7.0), (3.0, 7.0)):
        loads.at(time)
        wave = 1.0 + 3.0 * np.cos(4 * np.pi * time + 0.5)
        assert loads.values == pytest.approx((2.0 + expected + wave) * shape, rel=1e-14)


def test_what_stays_is_found_once_and_held_unknowns_get_nothing() -> None:
    loads = LineLoads([ShapeLoad(np.arange(12), np.ones(12))], WHOLE, np.array([0, 11]))
    assert not loads.changes
    assert loads.values.tolist() == [0.0, *[1.0] * 10, 0.0]
    loads.values[3] = 7.0
    loads.at(1.0)
    assert loads.values[3] == 7.0  # nothing is called


@pytest.mark.parametrize("most", [3, 7, 512])
def test_a_field_is_linear_between_slices_whatever_is_held(
    most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(line_loads, "_MOST_SLICES", most)
    rng = np.random.default_rng(3)
    weights = sparse.csr_matrix(rng.random((12, 20)) * (rng.random((12, 20)) < 0.3))
    field = rng.standard_normal((700, 20))
    filled: list[tuple[int, int]] = []

    def fill(first: int, points: slice, slices: np.ndarray) -> None:
        slices[:] = field[first : first + slices.shape[0], points]
        filled.append((first, slices.shape[0]))

    load = FieldLoad(np.arange(12), weights, 0.1, fill)
    part = Subdomain(4, 8, 3, 9, 2, 10)
    loads = LineLoads([load], part, NOBODY)
    for time in [0.0, 0.05, 0.1, 0.32, 0.31, 5.07, 5.11, 5.52, 5.5, 2.0, 0.0, *rng.random(20) * 9]:
        loads.at(float(time))
        expected = [np.interp(time, 0.1 * np.arange(700), field[:, i]) for i in range(20)]
        assert loads.values == pytest.approx((weights @ expected)[3:9], abs=1e-13)
    assert all(n <= most for _, n in filled)
    # Of a block ahead as many steps are covered as slices are there.
    times = 7.001 + 0.01 * np.arange(200)
    covered = loads.cover(times)
    assert covered == min(200, 10 * (most - 1))
    before = len(filled)
    loads.at(float(times[covered - 1]))
    assert len(filled) == before


def test_a_function_is_called_once_for_each_step_and_ahead_of_it() -> None:
    calls: list[float] = []

    def values(time: float) -> np.ndarray:
        calls.append(time)
        if time > 3.0:
            raise ValueError("no more")
        return time * np.array([1.0, 2.0])

    loads = LineLoads([FunctionLoad("slow", np.array([2, 5]), values)], WHOLE, NOBODY)
    loads.at(0.5)
    loads.at(0.5)
    assert calls == [0.5] and loads.values[[2, 5]].tolist() == [0.5, 1.0]
    # What it raises comes when its step comes.
    assert loads.cover(np.array([1.0, 2.0, 3.0, 4.0])) == 3
    for time in (1.0, 2.0, 3.0):
        loads.at(time)
        assert loads.values[5] == 2.0 * time
    assert calls == [0.5, 1.0, 2.0, 3.0, 4.0]
    with pytest.raises(ValueError, match="no more"):
        loads.at(4.0)


def test_loads_along_a_wire_do_the_work_of_what_they_stand_for() -> None:
    """Work on a straight deflection w = a + b x, of loads per length that points say."""
    line = en50318_line(2)
    mesh = mesh_of(line, 2)
    model = build(problem_of(line, HANGING), mesh, np.ones(mesh.droppers.shape[0]))
    points = np.array([10.0, 40.0, 55.0, 100.0])
    unknowns, weights = forces_along(model, CONTACT_WIRE, ("w", "theta_y"), points)
    nodes = mesh.wires[CONTACT_WIRE]
    x, q = mesh.x(nodes), np.array([3.0, -1.0, 2.0, 5.0])
    moved = np.zeros(model.n_dofs)
    moved[model.dofs(nodes)], moved[model.dofs(nodes, "theta_y")] = 0.3 + 0.02 * x, 0.02
    work = (weights @ q) @ moved[unknowns]
    # Linear between nodes, to which points are interpolated: Simpson's rule is exact.
    at_nodes = np.interp(x, points, q)
    middle = 0.5 * (x[1:] + x[:-1]), 0.5 * (at_nodes[1:] + at_nodes[:-1])
    density = at_nodes * (0.3 + 0.02 * x)
    between = middle[1] * (0.3 + 0.02 * middle[0])
    expected = (np.diff(x) / 6 * (density[1:] + 4 * between + density[:-1])).sum()
    assert work == pytest.approx(expected, rel=1e-13)


def test_a_table_needs_times_that_ascend() -> None:
    for times, values in (([0.0, 0.0], [1.0, 2.0]), ([0.0], [1.0, 2.0]), ([], [])):
        with pytest.raises(ValueError, match="ascend"):
            table(times, values)
