"""The lumped pantograph's contract with the coupling: prediction, compliance, state."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catenary.mbs.head.stepping import Stepping
from catenary.mbs.interface import Pantograph
from catenary.mbs.lumped import LumpedPantograph
from catenary.mbs.lumped_data import LumpedData

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
def test_compliance_agrees_with_finite_differences_of_whole_steps(data: LumpedData) -> None:
    """A step is linear in the force, so that a difference over 100 N is exact but for round-off."""
    at_rest = moving(data).state()
    ends = []
    for force in (-50.0, 50.0):
        pantograph = moving(data)
        pantograph.restore(at_rest)
        head = pantograph.predict(0.031)
        pantograph.advance(np.array([force]))
        ends.append(pantograph.state()[[0, data.n_masses]])
    found = (ends[0] - ends[1]) / 100.0
    by_height, by_velocity = head.height_compliance.item(), head.velocity_compliance.item()
    assert by_height > 0 and by_velocity > 0
    assert found[0] == pytest.approx(by_height, abs=4 * EPS * 6.0 / 100)
    speed = abs(ends[0][1]) + abs(ends[1][1])
    assert found[1] == pytest.approx(by_velocity, abs=4 * EPS * speed / 100)


@given(chains)
def test_state_and_restore_continue_bit_for_bit(data: LumpedData) -> None:
    kept, other = moving(data), moving(data)
    saved = kept.state()
    other.place(1.0)
    other.restore(saved)
    for number in range(30, 40):
        mine, theirs = kept.predict((number + 1) * DT), other.predict((number + 1) * DT)
        assert np.array_equal(mine.numbers, theirs.numbers)
        kept.advance(np.array([10.0 * number]))
        other.advance(np.array([10.0 * number]))
    assert np.array_equal(kept.state(), other.state())
    assert not np.array_equal(saved, kept.state())


def test_saved_state_does_not_change_with_the_pantograph() -> None:
    pantograph = moving(LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0)))
    saved = pantograph.state()
    copy = saved.copy()
    pantograph.restore(saved)
    pantograph.predict(0.031)
    pantograph.advance(np.array([100.0]))
    assert np.array_equal(saved, copy)


def test_lift_rises_as_half_a_cosine_and_stays() -> None:
    data = LumpedData((10.0,), (100.0,), (0.0,))
    pantograph = LumpedPantograph(data, 120.0, 5.5, Stepping(raise_time=0.4, dt=DT))
    found = [pantograph.lift(time) for time in (0.0, 0.1, 0.2, 0.3, 0.4, 7.0)]
    root = np.sqrt(0.5)
    expected = [0.0, 60.0 * (1 - root), 60.0, 60.0 * (1 + root), 120.0, 120.0]
    assert found == pytest.approx(expected, abs=120 * 4 * EPS)


def test_placed_pantograph_starts_with_the_acceleration_of_its_forces() -> None:
    """Springs are relaxed but for the one to the base, which the last mass alone feels."""
    data = LumpedData((7.0, 9.0, 6.0), (7000.0, 15500.0, 160.0), (45.0, 0.1, 100.0))
    pantograph = LumpedPantograph(data, 120.0, 5.5, Stepping(raise_time=0.0, dt=DT))
    pantograph.place(5.3)
    base = 5.5 + 120.0 / 7000.0 + 120.0 / 15500.0
    expected = [0.0, 0.0, (120.0 + 160.0 * (base - 5.3)) / 6.0]
    round_off = 4 * EPS * 15500.0 * 5.3 / 6.0
    assert pantograph.state()[6:] == pytest.approx(expected, abs=round_off)


def test_it_is_a_pantograph() -> None:
    """The coupling calls these methods and no others."""
    data = LumpedData((10.0,), (100.0,), (0.0,))
    pantograph: Pantograph = LumpedPantograph(data, 120.0, 5.5, Stepping(0.0, DT))
    assert pantograph.strip_offsets == (0.0,)
    for name in ("place", "extrapolate", "predict", "advance", "state", "restore"):
        assert callable(getattr(pantograph, name))
