"""The course of a lowering, and what catches a head."""

from __future__ import annotations

import numpy as np
import pytest

from catenary.mbs.build import Operation, make_pantograph
from catenary.mbs.head.pantograph import Pantograph
from catenary.mbs.head.stepping import Lowering, Raising, Stepping
from catenary.mbs.lumped import LumpedData
from catenary.mbs.vehicle import BaseMotion, Harmonic, VehicleMotion

DATA = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0))
STATIC, DT = 120.0, 1e-3


def test_the_lift_goes_over_by_half_a_cosine() -> None:
    part = Lowering(2.0, -60.0, 0.4, 0.3).course(STATIC, 0.5)
    assert [part(time) for time in (0.0, 0.25, 0.5, 2.0)] == pytest.approx([0.0, 0.5, 1.0, 1.0])
    assert part(2.2) == pytest.approx(0.25)  # half way from 120 N to -60 N
    assert part(2.4) == part(9.0) == pytest.approx(-0.5)


def test_a_pantograph_is_lowered_from_where_its_raising_was() -> None:
    part = Lowering(0.2, -60.0, 0.1, 0.3).course(STATIC, 0.5)
    assert part(0.2) == Raising(0.5)(0.2)
    assert part(0.2 + 1e-9) == pytest.approx(part(0.2), abs=1e-9)
    assert part(0.25) == pytest.approx(0.5 * (Raising(0.5)(0.2) - 0.5))
    assert part(0.6) == pytest.approx(-0.5)


def test_the_parts_of_many_steps_are_those_of_each() -> None:
    times = 1e-3 * np.arange(1, 700)
    each = [float(Raising(0.5)(time)) for time in times]
    # A cosine of an array may be rounded otherwise than one alone: half of 2.2e-16.
    for some in (slice(None), slice(100, 103), slice(498, None), slice(500, None)):
        found = Raising(0.5)(times[some])
        assert found == pytest.approx(each[some], rel=0.0, abs=1.2e-16)
    assert (Raising(0.0)(times) == 1.0).all()


def lowered(base: BaseMotion | None, time: float = 0.1) -> Pantograph:
    lowering = Lowering(time, -60.0, 0.05, 0.1)
    made = make_pantograph(
        DATA, Operation(STATIC, 5.0, Stepping(0.0, DT, base=base), lowering=lowering)
    )
    made.place(5.0)
    return made


def fall(pantograph: Pantograph, steps: range, force: float = 0.0) -> np.ndarray:
    """Heights of the head after each step."""
    found = []
    for number in steps:
        head = pantograph.predict(number * DT)
        found.append(float((head.height - head.height_compliance @ [force])[0]))
        pantograph.advance(np.array([force]))
    return np.array(found)


def test_what_is_caught_stays_whatever_presses_on_it() -> None:
    pantograph = lowered(None)
    height = fall(pantograph, range(1, 1001))
    caught = height[99] - 0.1
    assert height[-1] == pytest.approx(caught, abs=1e-14)
    head = pantograph.predict(1.001)
    assert not head.velocity.any() and not head.height_compliance.any()
    assert fall(pantograph, range(1001, 1011), force=500.0) == pytest.approx(caught, abs=1e-14)
    place, velocity = pantograph.extrapolate(1.011)
    assert place == pytest.approx(caught, abs=1e-14) and not velocity.any()


def test_what_is_caught_goes_with_the_base() -> None:
    base = BaseMotion(VehicleMotion((Harmonic(0.01, 2.0),)), 0.0, 50.0)
    pantograph = lowered(base)
    height = fall(pantograph, range(1, 1501))
    time = DT * np.arange(1, 1501)
    place = np.array([base.vertical(at).place for at in time])
    late = time > 1.2
    over = height[late] - place[late]
    assert np.ptp(place[late]) > 0.015
    assert over == pytest.approx(height[99] - place[99] - 0.1, abs=1e-13)
    velocity = float(pantograph.predict(1.6).velocity[0])
    assert velocity == pytest.approx(float(base.vertical(1.6).velocity))


@pytest.mark.parametrize("at", [50, 100, 300, 900])
def test_its_state_is_all_that_it_remembers(at: int) -> None:
    first, second = lowered(None), lowered(None)
    fall(first, range(1, at + 1))
    second.restore(first.state())
    onward = range(at + 1, 1200)
    assert (fall(second, onward) == fall(first, onward)).all()
