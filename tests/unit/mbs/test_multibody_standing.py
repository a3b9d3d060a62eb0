"""Multibody pantographs at their working height, tied chains, and what cannot be kept."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from body_mechanics import static_force
from measuring import check

from catenary import InputError, RunBroken
from catenary.base.errors import NotConverged
from catenary.cases.run.description import description_of
from catenary.mbs.air import Airflow
from catenary.mbs.build import Operation, make_pantograph, raising_data
from catenary.mbs.head.stepping import Lowering, Stepping
from catenary.mbs.interface import drive_width
from catenary.mbs.lumped import READY, LumpedData, LumpedPantograph
from catenary.mbs.mechanism.multibody_pantograph import MultibodyData, describe, reduced, stand
from catenary.mbs.mechanism.reduction import Raised, RaisingPantograph, reduce_mechanism
from catenary.mbs.rigid.bodies import SPACE, Body
from catenary.mbs.rigid.forces import Actuator, BumpStop, Gravity, PointForce, SpringDamper
from catenary.mbs.rigid.implicit_steps import Augmented, Partitioned, Stepper
from catenary.mbs.rigid.joints import Prismatic, Revolute
from catenary.mbs.rigid.system import System

# --- multibody pantographs at their working height ------------------------------------------------


G = 9.81
UP, ACROSS = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
MAST, HEAD, FORCE, STIFFNESS, FREE = 15.0, 7.2, 120.0, 4200.0, 0.12


def slide(name: str, below: str, above: str) -> Prismatic:
    return Prismatic(name, below, above, axis_i=UP, axis_j=UP, normal_i=ACROSS, normal_j=ACROSS)


SYSTEM = System(
    (
        Body("mast", MAST, (1.0, 1.0, 1.0), (0.0, 0.0, 1.0)),
        Body("head", HEAD, (1.0, 1.0, 1.0), (0.0, 0.0, 1.1)),
    ),
    (slide("guide", SPACE, "mast"), slide("slide", "mast", "head")),
    (
        Gravity((MAST, HEAD), G),
        Actuator("jack", SPACE, "mast", force=300.0),
        SpringDamper("brake", SPACE, "mast", damping=90.0),
        SpringDamper("spring", "mast", "head", stiffness=STIFFNESS, free_length=FREE, damping=10.0),
    ),
)
DATA = MultibodyData("telescope", SYSTEM, "head", "mast", None, "jack", FORCE)


def test_telescope_stands_as_its_weights_and_springs_say() -> None:
    standing = stand(DATA)
    weight = (MAST + HEAD) * G
    # Calibrated to 1e-9 of the static force; the rest is solved to 1e-9 of the largest force.
    check("jack [N]", standing.actuator_force, FORCE + weight, within=1e-6)
    check("static force [N]", standing.static_force, FORCE, within=1e-6)
    check("with its own 300 N [N]", standing.force_before, 300.0 - weight, within=1e-6)
    check("working height [m]", standing.working_height, 1.0, within=1e-12)
    assert standing.n_freedoms == 2
    head = standing.head
    # Differences of forces of some 100 N over 20 mm; round-off 1e-12 of them.
    check("head [kg]", head.mass, HEAD, within=1e-9)
    check("spring [N/m]", head.stiffness, STIFFNESS, within=1e-6)
    check("damper [N s/m]", head.damping, 10.0, within=1e-9)
    check("weight [N]", head.weight, HEAD * G, within=1e-9)
    check("above the mast [m]", head.offset, FREE - HEAD * G / STIFFNESS, within=1e-9)
    assert "2 bodies, 2 joints, 1 of 2 degrees of freedom is the raising" in describe(DATA)


@pytest.mark.parametrize("height", [0.7, 1.1, 1.3])
def test_a_head_rides_on_its_arm_to_any_working_height(height: float) -> None:
    """Of a mast that is raised to the head's given place, or past it."""
    standing = stand(replace(DATA, working_height=height))
    check("above the mast [m]", standing.head.offset, FREE - HEAD * G / STIFFNESS, within=1e-9)
    check("jack [N]", standing.actuator_force, FORCE + (MAST + HEAD) * G, within=1e-6)


def test_telescope_is_reduced_to_its_mast() -> None:
    tables = reduced(DATA)
    check("ends [m]", (tables.heights[0], tables.heights[-1]), (0.4, 1.6), within=1e-9)
    check("masses [kg]", tables.masses, MAST, within=1e-9)
    check("lifts [N]", tables.lifts, FORCE + HEAD * G, within=1e-6)
    check("dampings [N s/m]", tables.dampings, 90.0, within=1e-9)


def test_tables_follow_a_stop_that_is_met_on_the_way_up() -> None:
    """A stop of 1e5 N/m from 1.25 m on, where the lift has a kink that splines round off.

    Heights are halved where the lift is off by more than 0.2 N, down to 0.5 mm, over two of which
    on either side a spline through a kink of 1e5 N/m may be off by that times 0.5 mm.
    """
    stiffness, at = 1e5, 1.25
    stop = BumpStop("stop", SPACE, "mast", longest=at, stiffness=stiffness)
    tables = reduced(replace(DATA, system=SYSTEM.with_forces(stop)))
    heights = np.linspace(0.4, 1.6, 4001)
    found = np.array([tables.at(min(h, tables.heights[-1]))[0][1] for h in heights])
    expected = FORCE + HEAD * G - stiffness * np.maximum(heights - at, 0.0)
    near = np.abs(heights - at) < 2e-3
    # Between the heights that were looked at an error may be somewhat larger than there.
    check("lift away from the stop [N]", found[~near], expected[~near], within=2 * 0.2)
    check("lift at the stop [N]", found[near], expected[near], within=stiffness * 5e-4)
    assert 61 < len(tables.heights) < 121


def test_vehicle_stands_where_the_head_meets_the_wire_at_the_working_height() -> None:
    height = 5.3
    data = raising_data(DATA, FORCE, height)
    # Pressed by F the head is F / k lower above the mast, which is 1 m above the base.
    arm = 1.0 + FREE - (HEAD * G + FORCE) / STIFFNESS
    check("base [m]", data.base_height, height - arm, within=1e-9)
    running = make_pantograph(DATA, Operation(FORCE, height, Stepping(0.0, 1e-3)))
    assert isinstance(running, RaisingPantograph)
    check("static force there [N]", static_force(running, height), FORCE, within=1e-6)


def test_wind_adds_to_the_force_under_way_and_not_to_the_static_one() -> None:
    """Half on the head, half on the mast: both raise the wire's force."""
    wind = (
        PointForce("on head", "head", (3.0, 0.0, 8.0)),
        PointForce("on mast", "mast", (0.0, 0.0, 12.0)),
    )
    data = replace(DATA, wind=wind)
    assert stand(data).actuator_force == pytest.approx(stand(DATA).actuator_force, rel=1e-12)
    operation = Operation(FORCE, 5.0, Stepping(0.0, 1e-3))
    running = make_pantograph(data, operation)
    assert isinstance(running, RaisingPantograph)
    check("without the effect [N]", static_force(running, 5.0), FORCE, within=1e-6)
    running = make_pantograph(data, operation._replace(air=Airflow(70.0)))
    assert isinstance(running, RaisingPantograph)
    check("under way [N]", static_force(running, 5.0), FORCE + 20.0, within=1e-6)


def test_without_calibration_the_force_follows_from_the_actuator() -> None:
    data = replace(DATA, actuator=None, static_force=None)
    assert stand(data).actuator_force is None
    check("static force [N]", stand(data).static_force, 300.0 - (MAST + HEAD) * G, within=1e-6)
    weak = replace(data, system=SYSTEM.with_force_changed("jack", force=100.0))
    with pytest.raises(InputError, match="static force is -117.8 N .* cannot raise it"):
        stand(weak)


def test_what_is_set_up_is_set_up_once() -> None:
    again = replace(DATA, system=replace(SYSTEM, bodies=tuple(SYSTEM.bodies)))
    assert again == DATA and again is not DATA
    assert stand(again) is stand(DATA)
    assert reduced(again) is reduced(DATA)


def test_another_static_force_has_the_tables_of_its_own_calculation() -> None:
    """What was found for one static force serves another; under another name it does not."""
    stop = BumpStop("stop", SPACE, "mast", longest=1.25, stiffness=1e5)
    first = replace(DATA, system=SYSTEM.with_forces(stop))
    reduced(first)
    again = replace(first, static_force=151.0)
    alone = replace(again, name="another")
    found, expected = stand(again), stand(alone)
    # Both are calibrated to 1e-9 of the static force.
    check("jack [N]", found.actuator_force, expected.actuator_force, within=1e-6)
    check("head", found.head[:5], expected.head[:5], within=1e-6)
    assert found.head[5:] == expected.head[5:] == (None, None)  # slides
    assert found.static_force == pytest.approx(151.0, rel=1e-9)
    assert found.n_freedoms == expected.n_freedoms
    tables, own = reduced(again), reduced(alone)
    assert list(tables.heights) == pytest.approx(list(own.heights), abs=1e-12)
    assert tables.lifts[0] == pytest.approx(151.0 + HEAD * G, rel=1e-8)
    for name in ("masses", "lifts", "dampings"):
        check(name, getattr(tables, name), getattr(own, name), within=1e-6)


def test_places_that_an_actuator_moves_are_found_anew() -> None:
    """A jack that pushes the mast through a float on a spring: the float goes where it pushes."""
    float_mass, stiffness = 4.0, 2000.0
    system = System(
        (SYSTEM.bodies[0], Body("float", float_mass, (1.0, 1.0, 1.0), (0.0, 0.0, 0.8))),
        (SYSTEM.joints[0], slide("rail", "mast", "float")),
        (
            Gravity((MAST, float_mass), G),
            Actuator("jack", SPACE, "float", force=300.0),
            SpringDamper(
                "spring", "float", "mast", (0.0, 0.0, -2.0), (0.0, 0.0, 0.0), stiffness, 2.2
            ),
            BumpStop("stop", SPACE, "float", longest=1.0, stiffness=5000.0),
        ),
    )
    heights, places = np.linspace(0.9, 1.3, 9), Raised(system, "mast", actuator="jack")
    for force in (300.0, 500.0):
        pushed = system.with_force_changed("jack", force=force)
        found = reduce_mechanism(pushed, "mast", heights, places=places)
        expected = reduce_mechanism(pushed, "mast", heights)
        # At rest to 1e-9 of the largest force.
        check(f"lifts at {force} N [N]", found.lifts, expected.lifts, within=1e-6)


def test_leaving_the_tables_ends_the_run_with_heights_and_name() -> None:
    running = make_pantograph(DATA, Operation(FORCE, 5.0, Stepping(0.0, 1e-3)))
    running.place(5.0)
    with pytest.raises(RunBroken, match="'telescope' is at 1.6.* between 0.4 m and 1.6 m only"):
        for number in range(2000):  # free of the wire it rises with 120 N on 22 kg
            running.predict(1e-3 * (number + 1))
            running.advance(np.zeros(1))


def without(system: System, *names: str) -> System:
    return replace(
        system,
        joints=tuple(joint for joint in system.joints if joint.name not in names),
        forces=tuple(force for force in system.forces if force.name not in names),
    )


ROD = Body("rod", 5.0, (0.1, 0.1, 0.1), (0.5, 0.0, 1.0))

REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "loop": (
        {
            "system": replace(
                SYSTEM, joints=(replace(SYSTEM.joints[0], at_i=(0.07, 0, 0)), SYSTEM.joints[1])
            )
        },
        "joint 'guide' misses by 70 mm .* where 50 mm",
    ),
    "joint twice": (
        {"system": SYSTEM.with_joints(slide("again", SPACE, "mast"))},
        r"joints again \(5\) repeat",
    ),
    "held fast": (
        {
            "system": SYSTEM.with_joints(
                Revolute("bolt", SPACE, "mast", (0.0, 0.0, 1.0), axis_i=UP, axis_j=UP)
            )
        },
        r"joints bolt \(4\) repeat",
    ),
    "no way up": (
        {
            "system": replace(
                SYSTEM,
                joints=(
                    replace(
                        SYSTEM.joints[0],
                        axis_i=ACROSS,
                        axis_j=ACROSS,
                        normal_i=UP,
                        normal_j=UP,
                        at_i=(0.0, 0.0, 1.0),
                    ),
                    SYSTEM.joints[1],
                ),
            )
        },
        "leave no way to raise the arm 'mast'",
    ),
    "two ways": (
        {
            "system": replace(
                SYSTEM.with_joints(Revolute("pin", "mast", "rod", (0, 0, 0), (-0.5, 0, 0))),
                bodies=(*SYSTEM.bodies, ROD),
                forces=(Gravity((MAST, HEAD, ROD.mass), G), *SYSTEM.forces[1:]),
            )
        },
        "more than one way to move: with the arm 'mast' held",
    ),
    "no spring": ({"system": without(SYSTEM, "spring")}, "'head' stands on no spring"),
    "no guide": ({"system": without(SYSTEM, "slide")}, "'head' is guided by no joint"),
    "head on the base": (
        {"system": SYSTEM.with_forces(SpringDamper("stay", SPACE, "head", stiffness=1.0))},
        "'stay' acts between the head 'head' and space",
    ),
    "head joined to the base": (
        {"system": SYSTEM.with_joints(slide("stay", SPACE, "head"))},
        "'stay' ties the head 'head' to space",
    ),
    "actuator below the head": (
        {"system": SYSTEM.with_forces(Actuator("push", "mast", "head", force=1.0))},
        "'push' acts between head and arm and must be a spring",
    ),
    "useless actuator": (
        {
            "system": SYSTEM.with_forces(
                Actuator("side", SPACE, "mast", (-1.0, 0.0, 1.0), force=1.0)
            ),
            "actuator": "side",
        },
        "'side' does not act on the height of the arm",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_no_pantograph_is_refused(what: str) -> None:
    changes, sentence = REFUSED[what]
    with pytest.raises(InputError, match=sentence):
        stand(replace(DATA, **changes))


def test_working_height_out_of_reach_is_refused() -> None:
    """A rod of 1 m at 45 degrees does not reach 2 m."""
    rod = Body("rod", 5.0, (0.1, 0.1, 0.1), (0.5, 0.0, 0.5), (0.0, -np.sin(np.pi / 8), 0.0))
    length = np.sqrt(0.5)
    system = System(
        (rod, replace(SYSTEM.bodies[1], position=(0.5, 0.0, 0.6))),
        (
            Revolute("hinge", SPACE, "rod", at_j=(-length, 0.0, 0.0)),
            replace(SYSTEM.joints[1], i="rod", axis_i=(1.0, 0.0, 1.0), normal_i=(1.0, 0.0, -1.0)),
        ),
        (
            Gravity((5.0, HEAD), G),
            Actuator("jack", SPACE, "rod", (0.5, 0.0, -1.0), force=300.0),
            replace(SYSTEM.forces[3], i="rod"),
        ),
    )
    data = MultibodyData("rod", system, "head", "rod", 2.0, "jack", FORCE)
    with pytest.raises(InputError, match="'rod' does not reach its working height of 2 m"):
        stand(data)
    # As far as it goes: the hinge is 0.707 m away, and near the top it locks.
    standing = replace(data, working_height=0.5)
    heights = reduced(standing).heights
    print(heights[[0, -1]])
    assert 0.5 < heights[-1] < length


# --- chains whose base spring holds them at a height ----------------------------------------------


TIED = LumpedData((10.31, 6.15, 15.30), (53415.8, 6754.2, 40687.0), (29.6, 0.2, 1.14))
LIFT, NOMINAL, PLACED, RAISE, DT = 110.0, 5.0, 4.99, 0.5, 1e-3
EPS = np.finfo(float).eps


def held(part: float) -> float:
    """Force at rest on a head that is held at its nominal height, with a part of the lift and its
    base where that puts it: springs in a row under the lift on the last mass [N]."""
    base = PLACED + part * (NOMINAL + LIFT * TIED.compliance - PLACED)
    k, above = TIED.stiffnesses[-1], 1.0 / TIED.compliance
    last = (part * LIFT + k * base + above * NOMINAL) / (k + above)
    return above * (last - NOMINAL)


def pantograph(raise_time: float = RAISE) -> LumpedPantograph:
    made = LumpedPantograph(TIED, LIFT, NOMINAL, Stepping(raise_time, DT))
    made.place(PLACED)
    return made


def test_ready_chains_are_not_tied() -> None:
    assert TIED.tied
    assert not any(ready.chain.tied for ready in READY.values())


def test_a_tied_chain_starts_at_rest() -> None:
    """Nothing pulls at its masses before the lift grows, wherever it is placed."""
    round_off = 40 * EPS * 53415.8 * PLACED / min(TIED.masses)
    # The rate of the base at the start is a one-sided difference over 10 us: half of (pi / 0.5)^2
    # 1e-5 times 28 mm a second, on a damper of 1.14 N s/m.
    late = 0.25 * (np.pi / RAISE) ** 2 * 1e-5 * 0.029 * TIED.dampings[-1] / TIED.masses[-1]
    assert pantograph().state()[6:] == pytest.approx(0.0, abs=round_off + late)


def test_a_tied_chain_comes_to_the_static_force_at_its_nominal_height() -> None:
    """Held by a stiff contact there: F = part F_s when all of the lift acts."""
    assert held(1.0) == pytest.approx(LIFT, rel=1e-9)
    # Without its rise the base would push from the start with 745 N against the last mass.
    assert TIED.stiffnesses[-1] * LIFT * TIED.compliance == pytest.approx(746.3, abs=0.5)


def test_drives_of_many_steps_are_those_of_single_ones() -> None:
    one = pantograph()
    times = np.array([0.1, 0.25, 0.4, 0.5, 0.7])
    drives = np.zeros((len(times), drive_width(1)))
    one.fill_drives(times, drives)
    for time, row in zip(times.tolist(), drives, strict=True):
        other = pantograph()
        other.predict(time)
        assert row == pytest.approx(other.row, rel=1e-12)


def test_the_base_rises_by_the_half_cosine_of_the_lift() -> None:
    """Place and rate against the derivative of the half cosine."""
    one = pantograph()
    way = NOMINAL + LIFT * TIED.compliance - PLACED
    time = np.array([0.0, 0.1, 0.25, 0.4, 0.6])
    place, rate = one._rise(time)
    inside = time < RAISE
    part = np.where(inside, 0.5 * (1.0 - np.cos(np.pi * time / RAISE)), 1.0)
    slope = np.where(inside, 0.5 * np.pi / RAISE * np.sin(np.pi * time / RAISE), 0.0)
    assert place == pytest.approx(way * (part - 1.0), abs=1e-12)
    # The difference over 20 us is off by (pi 1e-5 / 0.5)^2 / 6 = 7e-10; it is one-sided at the
    # start, off by 0.25 (pi / 0.5)^2 1e-5 = 1e-4.
    assert rate == pytest.approx(way * slope, abs=1e-4 * abs(way))


def test_a_lowered_chain_goes_down_with_its_base() -> None:
    """With a fifth of the lift left a fifth of the force is."""
    one = pantograph()
    one.follow(Lowering(1.0, 0.2 * LIFT, 0.3, 0.5).course(LIFT, RAISE))
    (place,), (rate,) = one._rise(np.array([2.0]))
    way = NOMINAL + LIFT * TIED.compliance - PLACED
    assert place == pytest.approx(-0.8 * way, rel=1e-12) and rate == pytest.approx(0.0, abs=1e-12)
    # The base is below its place by as much as it was placed below the nominal height.
    less = 0.8 * (NOMINAL - PLACED) * TIED.height_stiffness
    assert held(0.2) == pytest.approx(0.2 * LIFT - less, rel=1e-9)


def test_a_tied_chain_says_by_how_much_its_force_depends_on_the_height() -> None:
    """1 / (1 / 53415.8 + 1 / 6754.2 + 1 / 40687) = 5.229 N/mm."""
    assert description_of(TIED, LIFT).endswith(
        "110.0 N; tied to its base: its force falls by 5.23 N with each mm that its head rises"
    )
    soft = LumpedData(TIED.masses, (*TIED.stiffnesses[:-1], 160.0), TIED.dampings)
    assert "tied" not in description_of(soft, LIFT)


# --- joints and heights that a step cannot keep ---------------------------------------------------


# A pendulum of 1 m that is let go from level.
PENDULUM = System(
    (Body("bob", 1.0, (0.1, 0.1, 0.1), (1.0, 0.0, 0.0)),),
    (Revolute("hinge", SPACE, "bob", at_j=(-1.0, 0.0, 0.0), axis_i=(0, 1, 0), axis_j=(0, 1, 0)),),
    (Gravity((1.0,)),),
)


class Lame(Partitioned):
    """Removes a tenth of the errors of joints only: after eight removals 0.9^8 are left."""

    def removal(self, errors: np.ndarray) -> np.ndarray:
        return 0.1 * super().removal(errors)


def swung(solver: Partitioned | Augmented) -> None:
    """One long step, after which the hinge is open by some millimetres until that is removed."""
    stepper = Stepper(PENDULUM, 0.05, solver)
    stepper.begin(PENDULUM.start(), 0.0)
    stepper.step()


def test_the_usual_way_closes_them() -> None:
    swung(Partitioned())
    swung(Augmented())


def test_joints_that_stay_open_are_told() -> None:
    with pytest.raises(NotConverged, match=r"cannot be kept closed at 0\.05 s.*take shorter steps"):
        swung(Lame())


def test_velocities_that_joints_do_not_allow_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Stepper, "_closed", lambda self, motion, time: motion)
    with pytest.raises(NotConverged, match=r"velocities .* at 0\.05 s: they miss by .* shorter"):
        swung(Lame())


def test_a_penalty_that_does_not_close_a_step_is_told() -> None:
    with pytest.raises(NotConverged, match="not converge within a step: choose another penalty"):
        swung(Augmented(penalty=0.1, max_iterations=5))
