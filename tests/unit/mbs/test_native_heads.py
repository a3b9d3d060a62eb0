"""Heads: as kernels keep them, the coupling's contract, steps, lowering."""

from __future__ import annotations

import gc
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import linalg
from scipy.interpolate import CubicSpline

from catenary import RunBroken
from catenary.mbs.build import Operation, make_pantograph
from catenary.mbs.head.laws import Law
from catenary.mbs.head.pantograph import Pantograph, head_of, weakly
from catenary.mbs.head.stepping import LateralPath, Lowering, Raising, Stepping
from catenary.mbs.head.strips import Strips, Suspension, Turning, head_parts
from catenary.mbs.interface import drive_width, drives_by_name
from catenary.mbs.lumped import LumpedData, LumpedPantograph
from catenary.mbs.mechanism.reduction import Head, RaisingData, RaisingPantograph, ReducedMechanism
from catenary.mbs.vehicle import BaseMotion, Harmonic, VehicleMotion
from catenary.solver.kernels import native

# --- heads as kernels keep them -------------------------------------------------------------------


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


# --- the lumped pantograph's contract with the coupling -------------------------------------------


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


# --- steps against the formulas they stand for, written out with NumPy ----------------------------


STEP, BETA, GAMMA = 2e-3, 0.3, 0.55
THREE = LumpedData((7.5, 9.0, 6.0), (7000.0, 15500.0, 160.0), (45.0, 0.1, 100.0))
HEIGHTS = np.linspace(1.0, 1.8, 9)
FRAME = ReducedMechanism(
    HEIGHTS,
    20.0 + 6.0 * HEIGHTS**2,
    230.0 + 30.0 * np.sin(4 * HEIGHTS),
    60.0 + 9.0 * HEIGHTS,
    20.0 * np.ones_like(HEIGHTS),
    name="tall",
)
RAISING = RaisingData(FRAME, Head(7.8, 6000.0, 26.0, 76.0, 0.08), base_height=3.6)


def newmark(
    state: np.ndarray,
    masses: np.ndarray,
    stiffness: np.ndarray,
    damping: np.ndarray,
    push: np.ndarray,
) -> np.ndarray:
    """A step of M a + C v + K d = push (eqs. 2.5 and 2.6 of the paper) from (d, v, a)."""
    d, v, a = state.reshape(3, -1)
    d = d + STEP * v + STEP**2 * (0.5 - BETA) * a
    v = v + STEP * (1 - GAMMA) * a
    matrix = np.diag(masses) + GAMMA * STEP * damping + BETA * STEP**2 * stiffness
    a = linalg.solve(matrix, push - stiffness @ d - damping @ v)
    return np.concatenate([d + BETA * STEP**2 * a, v + GAMMA * STEP * a, a])


def test_lumped_masses_step_as_newmark_s_formulas_say() -> None:
    static, nominal = 120.0, 5.4
    pantograph = LumpedPantograph(THREE, static, nominal, Stepping(0.0, STEP, BETA, GAMMA))
    pantograph.place(5.3)
    state = pantograph.state()
    base = nominal + static / 7000.0 + static / 15500.0
    chains = (THREE.chain(THREE.stiffnesses), THREE.chain(THREE.dampings))
    for number in range(200):
        force = 90.0 + 60.0 * np.sin(0.3 * number)
        push = np.array([-force, 0.0, static + 160.0 * base])
        state = newmark(state, np.array(THREE.masses), *chains, push)
        head = pantograph.predict((number + 1) * STEP)
        pantograph.advance(np.array([force]))
    # Forces of springs are differences of 15 500 N/m times 5 m, over masses of 6 kg.
    round_off = 200 * EPS * 15500 * 5.4 / 6
    assert pantograph.state()[6:] == pytest.approx(state[6:], abs=round_off)
    assert pantograph.state()[:3] == pytest.approx(state[:3], abs=STEP**2 * round_off + 200 * EPS)
    assert head.height - head.height_compliance @ [force] == pytest.approx(state[0], abs=1e-12)
    assert head.velocity - head.velocity_compliance @ [force] == pytest.approx(state[3], abs=1e-9)


def test_a_raising_mechanism_steps_as_its_equation_says() -> None:
    """Tables at the predicted height, by SciPy's splines."""
    pantograph = RaisingPantograph(RAISING, Stepping(0.0, STEP, BETA, GAMMA))
    pantograph.place(5.0, velocity=0.2)
    state = pantograph.state()
    mass, lift, slowing = (
        CubicSpline(HEIGHTS, values) for values in (FRAME.masses, FRAME.lifts, FRAME.dampings)
    )
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    for number in range(150):
        force = 140.0 + 60.0 * np.sin(0.3 * number)
        d = state[:2] + STEP * state[2:4] + STEP**2 * (0.5 - BETA) * state[4:]
        v = state[2:4] + STEP * (1 - GAMMA) * state[4:]
        h = d[1] - 3.6 - 0.08
        stiffness, damping = 6000.0 * pair, 26.0 * pair
        speed, slope = v[1], mass(h, 1)
        # Forces without the parts that the matrices give at the prediction.
        push = np.array([-force, lift(h) - 76.0 - slowing(h) * speed - 0.5 * slope * speed**2])
        stiffness[1, 1] -= lift(h, 1)
        damping[1, 1] += slowing(h) + slope * speed
        push[1] += -lift(h, 1) * d[1] + (slowing(h) + slope * speed) * v[1]
        state = newmark(state, np.array([7.8, mass(h)]), stiffness, damping, push)
        head = pantograph.predict((number + 1) * STEP)
        pantograph.advance(np.array([force]))
    round_off = 150 * EPS * 6000 * 5.0 / 7.8
    assert pantograph.state()[4:] == pytest.approx(state[4:], abs=round_off)
    assert pantograph.state()[:4] == pytest.approx(state[:4], abs=150 * STEP * round_off)
    assert abs(state[1] - 5.0) > 0.01
    assert head.height - head.height_compliance @ [force] == pytest.approx(state[0], abs=1e-11)


def test_a_mechanism_beyond_its_reach_says_where_and_when() -> None:
    pantograph = RaisingPantograph(RAISING, Stepping(0.0, STEP))
    pantograph.place(5.3)
    with pytest.raises(RunBroken) as broken:
        for number in range(1000):
            pantograph.predict((number + 1) * STEP)
            pantograph.advance(np.array([0.0]))
    time = (number + 1) * STEP
    assert str(broken.value).startswith(f"At {time:.4g} s the arm of pantograph 'tall' is at 1.8")
    assert "moves between 1 m and 1.8 m only" in str(broken.value)


def test_prediction_and_compliance_are_what_a_step_does_for_any_forces() -> None:
    """A step is linear in the forces of all strips: differences of steps are exact."""
    strips = Strips(2, 0.5, 1.6, Suspension(1.2, 9000.0, 30.0), Turning(0.4, 300.0, 2.0))
    data = RaisingData(FRAME, Head(7.8, 6000.0, 26.0, 76.0, 0.08), 3.6, strips)
    ends, heads = [], []
    for forces in ([0.0, 0.0], [40.0, 0.0], [0.0, 40.0]):
        pantograph = RaisingPantograph(data, Stepping(0.0, STEP, BETA, GAMMA))
        pantograph.place(5.0)
        for number in range(5):
            head = pantograph.predict((number + 1) * STEP)
            pantograph.advance(np.array(forces if number == 4 else [60.0, 55.0]))
        ends.append(pantograph.state())
        heads.append(head.height.copy())
    n = pantograph.position.size
    for j in range(2):
        change = (ends[0] - ends[1 + j]) / 40.0
        scale = 4 * EPS * 5.0 / 40.0
        assert head.height_compliance[:, j] == pytest.approx(change[:2], abs=scale)
        assert head.velocity_compliance[:, j] == pytest.approx(change[n : n + 2], abs=10 * scale)
        assert np.array_equal(heads[j], heads[j + 1])
    assert pantograph.position[3] != 0.0  # the uneven forces pitch the head


def test_placed_with_a_velocity_all_masses_have_it_and_dampers_between_them_are_idle() -> None:
    pantograph = LumpedPantograph(THREE, 120.0, 5.5, Stepping(0.0, STEP))
    pantograph.place(5.5, velocity=0.3)
    assert np.array_equal(pantograph.velocity, [0.3, 0.3, 0.3])
    base = 5.5 + 120.0 / 7000.0 + 120.0 / 15500.0
    expected = (120.0 + 160.0 * (base - 5.5) - 100.0 * 0.3) / 6.0
    assert pantograph.state()[6:] == pytest.approx([0, 0, expected], abs=4 * EPS * 15500 * 5.5 / 6)


def test_masses_start_with_the_accelerations_of_springs_and_laws() -> None:
    """Newton's law of each mass; springs of 15 500 N/m at 5.4 m leave their round-off."""
    laws = (
        Law(0, 3, False, (-1.0, 0.0, 1.0), (-300.0, 0.0, 500.0)),
        Law(1, 2, True, (-1.0, 0.0, 1.0), (-40.0, 0.0, 40.0)),
        Law(2, 3, True, (-1.0, 0.1, 1.0), (-10.0, 1.0, 91.0)),
    )
    pantograph = LumpedPantograph(replace(THREE, laws=laws), 120.0, 5.5, Stepping(0.0, STEP))
    pantograph.place(5.4, velocity=0.3)
    base = 5.5 + 120.0 / 7000.0 + 120.0 / 15500.0
    on_last = 120.0 + 160.0 * (base - 5.4) - 100.0 * 0.3 - (1.0 + 100.0 * 0.2)
    # The first law pulls from 0.1 m below, by its slope there; the second finds no rate between.
    expected = [300.0 * 0.1 / 7.5, 0.0, on_last / 6.0]
    assert pantograph.state()[6:9] == pytest.approx(expected, abs=8 * EPS * 15500 * 5.5 / 6)
    assert np.array_equal(pantograph.state()[:6], [5.4] * 3 + [0.3] * 3)


def test_a_mechanism_starts_with_the_acceleration_of_its_equation() -> None:
    base = BaseMotion(VehicleMotion((Harmonic(0.02, 2.0, 0.3),)), 0.0, 50.0)
    pantograph = RaisingPantograph(RAISING, Stepping(0.0, STEP, base=base))
    pantograph.place(5.0, velocity=0.2)
    moved = base.vertical(0.0)
    height, speed = 5.0 - 3.6 - 0.08 - moved.place, 0.2 - moved.velocity
    mass, lift, slowing = (
        CubicSpline(HEIGHTS, values) for values in (FRAME.masses, FRAME.lifts, FRAME.dampings)
    )
    force = lift(height) - 76.0 - slowing(height) * speed - 0.5 * mass(height, 1) * speed**2
    force += (mass(height) - 20.0) * moved.acceleration
    within = 8 * EPS * 6000 * 5.0 / 7.8
    assert pantograph.state()[4:] == pytest.approx([0.0, force / mass(height)], abs=within)
    with pytest.raises(RunBroken, match="At 0 s the arm of pantograph 'tall' is at 2"):
        pantograph.place(5.7)


@pytest.mark.parametrize("suspended", [False, True])
def test_a_head_raised_as_a_whole_strains_no_spring(suspended: bool) -> None:
    own = Suspension(1.5, 8000.0, 20.0) if suspended else None
    strips = Strips(2, 0.56, 1.6, own, Turning(0.5, 400.0, 3.0))
    head = head_parts(8.0, 6000.0, 26.0, strips, Turning(6.6, 673.0, 3.0))
    raised = np.append(head.level, 1.0)
    assert np.abs(head.stiffness @ raised).max() <= 4 * EPS * 24000
    assert np.abs(head.damping @ raised).max() <= 4 * EPS * 100
    assert head.touch @ head.level == pytest.approx([1.0, 1.0])
    assert head.masses @ head.level == pytest.approx(8.0)
    assert linalg.eigvalsh(head.stiffness).min() > -1e-8


def test_strips_heavier_than_their_head_are_refused() -> None:
    with pytest.raises(ValueError, match="strips of 8 kg are part of a head of 8 kg"):
        head_parts(8.0, 1.0, 0.0, Strips(2, 0.5, None, Suspension(4.0, 1.0, 0.0)))


def test_where_the_wire_crosses_a_head_that_cannot_roll_makes_no_difference() -> None:
    path = LateralPath([(np.array([0.0, 100.0]), (0.2, -0.2))], 0.0, (0.0,), 50.0)
    pantographs = (
        LumpedPantograph(THREE, 120.0, 5.5, Stepping(0.0, STEP, lateral=path)),
        LumpedPantograph(THREE, 120.0, 5.5, Stepping(0.0, STEP)),
    )
    for pantograph in pantographs:
        pantograph.place(5.5)
        pantograph.predict(STEP)
        pantograph.advance(np.array([100.0]))
    assert np.array_equal(pantographs[0].state(), pantographs[1].state())


# --- the course of a lowering, and what catches a head --------------------------------------------


DATA = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0))
STATIC, LOWERING_STEP = 120.0, 1e-3


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
        DATA, Operation(STATIC, 5.0, Stepping(0.0, LOWERING_STEP, base=base), lowering=lowering)
    )
    made.place(5.0)
    return made


def fall(pantograph: Pantograph, steps: range, force: float = 0.0) -> np.ndarray:
    """Heights of the head after each step."""
    found = []
    for number in steps:
        head = pantograph.predict(number * LOWERING_STEP)
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
    time = LOWERING_STEP * np.arange(1, 1501)
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
