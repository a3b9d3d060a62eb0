"""A rank's own solver: which factors it takes, and that it never outlives Python."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from petsc4py import PETSc
from repeating_line import alike, rows_of
from scipy import sparse

from catenary.solver.linear.petsc_solvers import PartSolver, Wrapped, allows_own_factors
from catenary.solver.linear.station_factors import station_factors
from catenary.solver.linear.station_products import Layout

N_STATIONS = 12


def operator() -> sparse.bsr_matrix:
    """A block tridiagonal positive definite matrix."""
    n = 4 * N_STATIONS
    beside = np.full(n - 4, -1.0)
    matrix = sparse.diags([beside, np.full(n, 3.0), beside], [-4, 0, 4]).tobsr((4, 4))
    matrix.sort_indices()
    return matrix


def wrapped(array: np.ndarray) -> Wrapped:
    return Wrapped(array, PETSc.Vec().createWithArray(array, comm=PETSc.COMM_SELF))


@pytest.mark.parametrize("hurries", [False, True])
@pytest.mark.parametrize("option", [None, "lu", "cholesky"])
def test_all_factors_give_the_same_answer(option: str | None, hurries: bool) -> None:
    matrix, options = operator(), PETSc.Options()
    right, answer = (wrapped(array) for array in np.zeros((2, 4 * N_STATIONS)))
    right.array[:] = np.cos(np.arange(4 * N_STATIONS))
    if option is not None:
        options["march_pc_type"] = option
    try:
        factors = station_factors(rows_of(matrix), Layout((4,)), alike(N_STATIONS, 4))
        own = factors if allows_own_factors(is_whole=True) else None
        solver = PartSolver(lambda: matrix, True, True, own)
    finally:
        options.delValue("march_pc_type")
    if hurries:
        solver.bypass_ksp()
    solver.solve(right, answer)
    # The condition is about 5, so that this is a few roundings.
    assert np.abs(matrix @ answer.array - right.array).max() < 1e-14
    solver.destroy()
    for pair in (right, answer):
        pair.vector.destroy()


@pytest.mark.process
def test_a_solver_that_nobody_destroyed_does_not_crash_the_end_of_python() -> None:
    """PETSc is finalised after Python, and cannot free what is written in Python then."""
    code = (
        "import numpy as np; from scipy import sparse; "
        "from catenary.solver.linear.station_rows import Sections; "
        "from catenary.solver.linear.station_products import Layout; "
        "from catenary.solver.linear.station_rows import StationRows; "
        "from catenary.solver.linear.petsc_solvers import PartSolver; "
        "from catenary.solver.linear.station_factors import station_factors; "
        "whole = sparse.identity(8).tobsr((4, 4)); "
        "blocks = np.eye(4) * np.array([[0, 0], [1, 1], [0, 0]])[..., None, None]; "
        "rows = StationRows(np.arange(2, dtype=np.int32), np.arange(2), blocks); "
        "stations = Sections(4 * np.arange(3), np.zeros(2, int), ((0, 1, 2, 3),), 4); "
        "factors = station_factors(rows, Layout((4,)), stations); "
        "kept = PartSolver(lambda: whole, True, True, factors); "
        "kept.itself = kept"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr
