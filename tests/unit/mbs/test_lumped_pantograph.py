"""The lumped pantograph's contract with the coupling: prediction, compliance, state."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catenary.mbs.head.stepping import Stepping
from catenary.mbs.interface import drive_width, drives_by_name
from catenary.mbs.lumped import LumpedData, LumpedPantograph

DT = 1e-3
EPS = np.finfo(float).eps


chains = st.integers(1, 4).flatmap(
    lambda n: st.builds(
        lambda masses, stiffnesses, dampings: LumpedData(
            tuple(masses), tuple(stiffnesses), tuple(dampings)
        ),
        st.lists(st.floats(1.0, 30.0), min_size=n, max_size=n),
        st.lists(st.floats(10.0, 2e4), min_size=n, max_size=n),
        st.lists(st.floats(0.0, 200.0), min_size=n, max_size=n),
    )
)


def moving(data: LumpedData) -> LumpedPantograph:
    """A pantograph in the middle of a motion."""
    pantograph = LumpedPantograph(data, 120.0, 5.5, Stepping(raise_time=0.01, dt=DT))
    pantograph.place(5.4)
    for number in range(30):
        pantograph.predict((number + 1) * DT)
        pantograph.advance(np.array([50.0 + number]))
    return pantograph


@given(chains, st.floats(-500.0, 500.0))
def test_prediction_is_what_the_step_does_for_any_force(data: LumpedData, force: float) -> None:
    pantograph = moving(data)
    head = pantograph.predict(0.031)
    pantograph.advance(np.array([force]))
    n = data.n_masses
    # One multiplication and subtraction each, of numbers as large as these.
    height = (head.height - head.height_compliance @ [force]).item()
    velocity = (head.velocity - head.velocity_compliance @ [force]).item()
    assert pantograph.state()[0] == pytest.approx(height, abs=4 * EPS * 10)
    scale = (abs(head.velocity) + abs(head.velocity_compliance @ [force])).item()
    assert pantograph.state()[n] == pytest.approx(velocity, abs=4 * EPS * scale)


@given(chains)
def test_state_and_restore_continue_bit_for_bit(data: LumpedData) -> None:
    kept, other = moving(data), moving(data)
    saved = kept.state()
    copy = saved.copy()
    other.place(1.0)
    other.restore(saved)
    for number in range(30, 40):
        mine, theirs = kept.predict((number + 1) * DT), other.predict((number + 1) * DT)
        assert np.array_equal(mine.numbers, theirs.numbers)
        kept.advance(np.array([10.0 * number]))
        other.advance(np.array([10.0 * number]))
    assert np.array_equal(kept.state(), other.state())
    assert np.array_equal(saved, copy)


def test_lift_rises_as_half_a_cosine_and_stays() -> None:
    data = LumpedData((10.0,), (100.0,), (0.0,))
    pantograph = LumpedPantograph(data, 120.0, 5.5, Stepping(raise_time=0.4, dt=DT))
    drives = np.zeros((6, drive_width(1)))
    pantograph.fill_drives(np.array([0.0, 0.1, 0.2, 0.3, 0.4, 7.0]), drives)
    # The base spring pulls with nothing once the only mass, the head, is at its nominal height.
    found = drives_by_name(drives)["force"] - 100.0 * 5.5
    root = np.sqrt(0.5)
    expected = [0.0, 60.0 * (1 - root), 60.0, 60.0 * (1 + root), 120.0, 120.0]
    assert found == pytest.approx(expected, abs=120 * 4 * EPS)


def test_a_pantograph_that_is_placed_again_is_raised_again() -> None:
    """Once it is raised its drives stay as they are, but not from one run to the next."""
    data = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0))
    pantograph = LumpedPantograph(data, 120.0, 5.5, Stepping(raise_time=0.02, dt=DT))

    def march(begin: int) -> list[np.ndarray]:
        states = []
        for number in range(begin, 60):
            pantograph.predict((number + 1) * DT)
            pantograph.advance(np.array([100.0]))
            states.append(pantograph.state())
        return states

    pantograph.place(5.5)
    first = march(0)
    pantograph.place(5.5)
    assert np.array_equal(march(0), first)
    pantograph.restore(first[4])
    assert np.array_equal(march(5), first[5:])
