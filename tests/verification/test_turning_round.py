"""A pantograph that runs the other way round: the same to gravity, another to the wind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check
from scenes import load_scene, problem_of

from catenary import InputError
from catenary.mbs.mechanism.multibody_pantograph import MultibodyData, reduced, stand
from catenary.mbs.rigid.bodies import Body
from catenary.mbs.rigid.forces import PointForce
from catenary.mbs.rigid.joints import Constant, PointOnCurve, PrescribedPoint
from catenary.mbs.rigid.system import System, turned_round

EPS = np.finfo(float).eps
KNEE = (-0.820, 0.0, 0.0)
DRAG = 80.0
AS_IT_IS = 'train.pantographs=[{name="seven_body"}]'
REVERSED = 'train.pantographs=[{name="seven_body", reversed=true}]'


def data_of(assignment: str) -> MultibodyData:
    scene = load_scene("ambrosio2012", [assignment])
    (placement,) = problem_of(scene).train.placements
    assert isinstance(placement.data, MultibodyData)
    return placement.data


def dragged(data: MultibodyData, force: float) -> MultibodyData:
    """With a force on the knee along the running direction."""
    return replace(data, wind=(PointForce("drag", "lower_arm", (force, 0.0, 0.0), KNEE),))


def test_gravity_does_not_tell_which_way_a_pantograph_runs() -> None:
    one, other = data_of(AS_IT_IS), data_of(REVERSED)
    knee = one.system.bodies[1].position[0], other.system.bodies[1].position[0]
    assert knee[0] == -knee[1] != 0.0
    found, expected = stand(other), stand(one)
    check("actuator [N]", found.actuator_force, expected.actuator_force, within=1e-4)
    gaps = [[miss.gap for miss in standing.missed] for standing in (found, expected)]
    check("joints missed [m]", gaps[0], gaps[1], within=1e-12)
    a, b = reduced(one), reduced(other)
    check("heights [m]", b.heights, a.heights, within=1e-12)
    # Iterations end at 1e-9 of forces of 1e4 N.
    for name in ("masses", "lifts", "dampings"):
        check(name, getattr(b, name), getattr(a, name), within=1e-4)


def test_drag_on_the_knee_lifts_one_way_and_presses_the_other() -> None:
    """By virtual work it lifts with F dx/dh of the knee, whose sign is the orientation's."""
    lifts = {}
    for assignment in (AS_IT_IS, REVERSED):
        data = data_of(assignment)
        blown = reduced(dragged(data, -DRAG)).blown
        assert blown is not None and reduced(data).blown is None
        lifts[assignment] = blown
    one, other = lifts[AS_IT_IS], lifts[REVERSED]
    print(f"knee trailing {one[len(one) // 2]:+.1f} N, knee first {other[len(other) // 2]:+.1f} N")
    check("lift of the drag [N]", other, -one, within=1e-3)
    assert np.abs(one).min() > 1.0


def test_twice_turned_round_is_as_before() -> None:
    system = data_of(AS_IT_IS).system
    again = turned_round(turned_round(system))
    for body, before in zip(again.bodies, system.bodies, strict=True):
        check("position [m]", body.position, before.position, within=0.0 + 1e-300)
        check("turn", body.turn, before.turn, within=2 * EPS)
    assert again.joints[1:] == system.joints[1:]
    assert again.forces == system.forces


def test_guides_and_pushers_in_space_turn_with_the_bodies() -> None:
    """A block on a bent guide, pushed to a coordinate that is along no axis of the turn."""
    block = Body("block", 2.0, (0.1, 0.2, 0.3), position=(0.6, 0.2, 1.3))
    guide = PointOnCurve("guide", "block", (-1.0, 0.0, 2.0), (0.0, 0.1, 0.5), (1.0, 1.2, 2.0))
    pusher = PrescribedPoint("pusher", "block", Constant(0.5), along=(1.0, 0.5, 0.2))
    system = System((block,), (guide, pusher))
    one, other = (own.assemble(own.start()).position[0] for own in (system, turned_round(system)))
    assert np.abs(one[:2]).min() > 0.05
    check("place of the block [m]", other, one * [-1.0, -1.0, 1.0], within=1e-12)


def test_lumped_masses_have_no_front() -> None:
    with pytest.raises(InputError, match=r"train\.pantographs\.0\.reversed is true .* no front"):
        load_scene("ambrosio2012", ['train.pantographs=[{name="lumped", reversed=true}]'])
