"""Heads as kernels keep them: their arrays live as long as they do, and fit each other."""

from __future__ import annotations

import gc

import numpy as np
import pytest

from catenary.mbs.head.pantograph import head_of, weakly
from catenary.mbs.head.stepping import Stepping
from catenary.mbs.interface import drive_width, drives_by_name
from catenary.mbs.lumped import LumpedData, LumpedPantograph
from catenary.solver.kernels import native

DT = 1e-3
NEWMARK = native.NewmarkFactors(DT, 0.25 * DT**2, 0.5 * DT, 0.25 * DT**2, 0.5 * DT)


def free_mass(mass: float, roll: int = -1) -> tuple[native.Head, np.ndarray, np.ndarray]:
    """A mass of one strip that nothing holds, its state, and what a step of it is asked for."""
    state, out = np.zeros(3), np.zeros(4)
    arrays = native.HeadArrays(np.array([[[1.0]], [[0.0]]]), state, out, NEWMARK, roll)
    matrix = np.array([[1.0, DT, 0.25 * DT**2], [0.0, 1.0, 0.5 * DT], [0.0, 0.0, 0.0]])
    unit = np.array([0.25 * DT**2, 0.5 * DT, 1.0]) / mass
    linear = native.LinearStep(matrix, unit, unit.copy(), np.array([[1.0 / mass]]))
    return head_of(arrays, linear=linear), state, out


def test_a_head_keeps_its_arrays_alive_and_writes_to_them() -> None:
    head, state, out = free_mass(10.0)
    gc.collect()
    row = np.zeros(drive_width(1))
    drives_by_name(row)["force"] = 50.0
    for _ in range(2000):
        assert head.step(row)
        head.advance(np.array([20.0]))
    # Newmark's method is exact under a constant force once the acceleration is that of the force:
    # in the first step, which starts from none, the velocity gains half of a step's only.
    time = 2000 * DT - 0.5 * DT
    assert state[1:] == pytest.approx([3.0 * time, 3.0], rel=1e-12)
    assert out[2:] == pytest.approx([0.25 * DT**2 / 10.0, 0.5 * DT / 10.0], rel=1e-15)


def test_arrays_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="other shapes than its strips"):
        free_mass(10.0, roll=1)
    head, *_ = free_mass(10.0)
    tables = native.SplineTables(np.array([0.0, 1.0]), np.zeros((1, 3, 4)))

    class TooMany:
        first, wires = 1, 1

    TooMany.tables = tables  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match="fewer coordinates than its strips have modes"):
        head.bend(TooMany)
    with pytest.raises(TypeError, match="contact_force is no contiguous array of float64"):
        head.advance(np.array([1]))
    with pytest.raises(ValueError, match="drive has too few numbers"):
        head.step(np.zeros(drive_width(1) - 1))


def test_a_pantograph_may_outlive_what_it_was_made_by() -> None:
    one = LumpedPantograph(LumpedData((10.0,), (50.0,), (1.0,)), 100.0, 5.0, Stepping(0.0, DT))
    one.place(5.0)
    head, position = one.stepped, one.position
    row = one.row.copy()
    del one
    gc.collect()
    drives_by_name(row)["force"] = 500.0
    before = position.copy()
    assert head.step(row)
    head.advance(np.zeros(1))
    assert position > before


def test_a_step_of_a_model_that_is_gone_is_no_step() -> None:
    class Model:
        def predict(self, *arguments: object) -> None:
            """As a pantograph that is stepped by Python."""

    model, out = Model(), np.zeros(4)
    arrays = native.HeadArrays(np.zeros((2, 1, 0)), np.zeros(0), out, NEWMARK, -1)
    head = native.CalledHead(arrays, weakly(model.predict))
    assert head.step(np.zeros(drive_width(1)))
    del model
    gc.collect()
    with pytest.raises(ReferenceError, match="the pantograph of a compiled head is gone"):
        head.step(np.zeros(drive_width(1)))
