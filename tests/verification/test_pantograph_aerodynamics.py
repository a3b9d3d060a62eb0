"""Forces of the air on pantographs: mean force, virtual work, heads in all models, tunnels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import paper_pantograph as paper
import pytest
from measuring import check, march
from small_lines import EN_PANTOGRAPH, WHOLE, en50318_line, mesh_of, numerics, problem_of, train
from ts_alpha2 import TS_ALPHA2

from catenary.mbs.air import Airflow, Polynomial, Tunnel, Uplift
from catenary.mbs.build import Operation, make_pantograph, steady_forces
from catenary.mbs.head.pantograph import Pantograph
from catenary.mbs.head.stepping import Stepping
from catenary.mbs.head.strips import Strips, Suspension
from catenary.mbs.lumped import LumpedData
from catenary.mbs.mechanism.multibody_pantograph import AllBodies, MultibodyData, reduced, stand
from catenary.mbs.rigid.bodies import point
from catenary.mbs.rigid.forces import PointForce
from catenary.mbs.rigid.joints import Constant, PrescribedPoint
from catenary.mbs.rigid.statics import equilibrium

STATIC, HEIGHT, SPEED, DT = 150.0, 5.08, 300 / 3.6, 1e-3
WIRE = 5e4  # [N/m] contact on a wire that does not give way
DSA380 = Polynomial((-0.2, 0.0017 * 3.6, 0.00095 * 3.6**2))
UPLIFT = Uplift(DSA380, 0.7)
KNEE = (-0.820, 0.0, 0.0)
DRAG = (
    PointForce("drag of the knee", "lower_arm", (-80.0, 0.0, 0.0), KNEE),
    PointForce("drag of the head", "head", (-60.0, 0.0, 25.0)),
)
LUMPED = LumpedData((7.5, 9.0, 6.0), (7000.0, 15500.0, 160.0), (45.0, 40.0, 100.0))
SPRUNG = Strips(2, 0.56, 1.6, Suspension(1.0, 8000.0, 200.0))


def pressed(pantograph: Pantograph, n_steps: int, height: float = HEIGHT) -> np.ndarray:
    """Contact forces (n_steps,) on a wire that holds the head at a height, from above it."""
    strips = len(pantograph.strip_offsets)
    forces, wire = np.zeros(n_steps), np.full(strips, height - STATIC / (strips * WIRE))
    pantograph.place(height - 1e-3)
    for number in range(n_steps):
        head = pantograph.predict((number + 1) * DT)
        free = WIRE * (head.height - wire) + 400.0 * head.velocity
        soft = WIRE * head.height_compliance + 400.0 * head.velocity_compliance
        force = np.maximum(np.linalg.solve(np.eye(strips) + soft, free), 0.0)
        pantograph.advance(force)
        forces[number] = force.sum()
    return forces


def operation(flow: Airflow | None, raise_time: float = 0.3) -> Operation:
    return Operation(STATIC, HEIGHT, Stepping(raise_time, DT), air=flow)


@pytest.mark.parametrize("head_share", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("strips", [Strips(), SPRUNG], ids=["one strip", "sprung strips"])
def test_force_of_lumped_masses_is_static_and_aerodynamic(
    head_share: float, strips: Strips
) -> None:
    """At the nominal height, where the base spring carries nothing.

    The base spring takes 160 N/m of what the contact gives way, 235 N over 5e4 N/m against 150 N.
    """
    data = replace(LUMPED, strips=strips, uplift=Uplift(DSA380, head_share))
    found = pressed(make_pantograph(data, operation(Airflow(SPEED))), 6000)[-1]
    lifted = 0.00095 * 300**2 + 0.0017 * 300 - 0.2
    check("uplift [N]", steady_forces(data, SPEED).whole, lifted, within=1e-10)
    check("force [N]", found, STATIC + lifted, within=160.0 * lifted / WIRE + 1e-3)
    without = pressed(make_pantograph(data, operation(None)), 6000)[-1]
    check("without air [N]", without, STATIC, within=1e-3)


def knee_drag_lift(data: MultibodyData, force: float) -> float:
    """Lift of the arm by a drag at the knee, F dx / dh from places of the mechanism nearby."""
    standing, places = stand(data), []
    for off in (-1e-4, 1e-4):
        holder = PrescribedPoint("height", data.arm, Constant(standing.working_height + off))
        motion = equilibrium(standing.system.with_joints(holder), standing.motion).motion
        places.append(point(motion, "lower_arm", KNEE).value[0])
    return force * (places[1] - places[0]) / 2e-4


def test_drag_lifts_by_virtual_work() -> None:
    """Moments go through the mechanism: the drag of the knee lifts the arm by F dx / dh."""
    data = replace(paper.data(), wind=DRAG[:1])
    expected = knee_drag_lift(data, -80.0)
    found = steady_forces(data, SPEED)
    check("lift of the arm [N]", found.on_frame, expected, within=1e-3 * abs(expected))
    assert found.on_head == 0.0 and abs(expected) > 10.0


@pytest.mark.parametrize(
    "forces",
    [
        pytest.param("uplift", marks=pytest.mark.study),
        pytest.param("drag", marks=pytest.mark.study),
        "both",
    ],
)
def test_reduced_and_whole_mechanism_feel_the_same_air(forces: str) -> None:
    """Means over the last second on a still wire: what swings on is 2 N, as in
    `test_multibody_full`, and 1 N of the raising at 0.43 Hz after 6 s.

    A drag of the head pushes the arm, which guides it: without that the two would be 6 N apart.
    """
    data = replace(
        paper.data(),
        uplift=UPLIFT if forces != "drag" else None,
        wind=DRAG if forces != "uplift" else (),
    )
    whole = replace(data, all_bodies=AllBodies())
    flow, expected = Airflow(SPEED), steady_forces(data, SPEED).whole
    found = pressed(make_pantograph(data, operation(flow)), 6000)[-1000:].mean()
    bodies = pressed(make_pantograph(whole, operation(flow)), 2500)[-1000:].mean()
    print(f"{forces}: reduced {found:.2f} N, all bodies {bodies:.2f} N")
    # The contact gives way by the uplift over 5e4 N/m, and the lift falls by 242 N/m.
    check("reduced [N]", found, STATIC + expected, within=242.0 * abs(expected) / WIRE + 1.0)
    check("all bodies [N]", bodies, found, within=3.0)


def test_drag_of_the_head_acts_on_the_arm_that_guides_it() -> None:
    """The same force on the arm itself, at the same point, lifts as much."""
    data = paper.data()
    motion = stand(data).motion
    head, arm = motion.numbers[data.head], motion.numbers[data.arm]
    away = motion.position[head] - motion.position[arm]
    at = tuple(motion.rotation[arm].T @ away)
    on_arm = replace(data, wind=(PointForce("drag", data.arm, (-60.0, 0.0, 0.0), at),))
    on_head = replace(data, wind=(PointForce("drag", data.head, (-60.0, 0.0, 0.0)),))
    blown = [reduced(one).blown for one in (on_arm, on_head)]
    print(f"at the working height {steady_forces(on_head, SPEED).on_frame:+.2f} N")
    check("lift [N]", blown[1], blown[0], within=1e-9)


def run(data: LumpedData | MultibodyData, scheme: str = "one_solve", **changes: object):
    """A march over two spans at 250 km/h into a tunnel."""
    line = en50318_line(5)
    moved = train(250 / 3.6, 70.0, 160.0, data=data, raise_time=0.3)
    problem = problem_of(
        line,
        WHOLE | {"pantograph_aerodynamics"},
        train=moved,
        numerics=numerics(1e-3, scheme),
        tunnels=(Tunnel(110.0, 1000.0, 1.5, 20.0),),
    )
    return march(replace(problem, **changes), mesh_of(line, 4))


def test_a_tunnel_raises_the_force_of_a_march_where_it_begins() -> None:
    data = replace(EN_PANTOGRAPH, uplift=UPLIFT)
    inside, outside = run(data), run(data, tunnels=())
    x, more = inside["contact_position"][:, 0], inside["contact_force"] - outside["contact_force"]
    before = x < 110.0
    assert before.sum() > 500 and not more[before].any()
    # Half of the uplift of 59.6 N on top; what swings about that is a third of it.
    check("in the tunnel [N]", more[x > 135.0].mean(), 29.8, within=10.0)


@pytest.mark.study
def test_schemes_agree_about_the_air() -> None:
    """PETSc's stepper takes its own way through masses and springs of the head."""
    data = replace(EN_PANTOGRAPH, uplift=UPLIFT)
    found, second = run(data), run(data, TS_ALPHA2)
    # Both are of second order: 1.2 N at 1 ms without air, 2 N with it; 0.3 and 0.6 N at 0.5 ms.
    spread = np.abs(found["contact_force"] - second["contact_force"])[400:].max()
    print(f"largest difference after the raising {spread:.3f} N")
    assert spread < 3.0


def test_left_out_the_air_changes_nothing() -> None:
    data = replace(EN_PANTOGRAPH, uplift=UPLIFT)
    without = run(data, effects=WHOLE)
    bare = run(EN_PANTOGRAPH)
    assert np.array_equal(without["contact_force"], bare["contact_force"])
