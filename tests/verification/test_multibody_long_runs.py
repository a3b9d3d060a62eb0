"""All methods on the paper's seven bodies agree; 20 s and 10 min of it are in ``benchmarks``."""

from __future__ import annotations

import time

import numpy as np
import paper_pantograph as paper
import plane_pantograph
import pytest
from agreement import print_agreement, ways
from long_runs import DT, HEIGHT, STATIC, check_balance, check_no_drift, contact_forces, mean
from measuring import check
from scipy.interpolate import CubicSpline
from seven_bodies import HEAD, at_rest, calibrated, pressed

from catenary.mbs.build import raising_data
from catenary.mbs.head.stepping import Stepping
from catenary.mbs.mechanism.reduction import RaisingData, RaisingPantograph

pytestmark = pytest.mark.study


def energy(data: RaisingData, pantograph: RaisingPantograph) -> float:
    """Kinetic energy, and elastic energy of the head's springs [J], over a base at rest."""
    (head, arm), (speed, arm_speed) = pantograph.position, pantograph.velocity
    mass = data.frame.at(arm - data.head.offset - data.base_height)[0][0]
    elastic = data.head.stiffness * (head - arm) ** 2
    return 0.5 * float(data.head.mass * speed**2 + mass * arm_speed**2 + elastic)


def test_plane_pantograph_rests_where_the_bodies_do() -> None:
    """Two coordinates by hand and seven bodies with joints: round-off of both searches."""
    system = calibrated()
    rest = at_rest(pressed(system))
    a, s = plane_pantograph.rest(system.force(paper.ACTUATOR).force, 150.0)
    found = plane_pantograph.bodies(a + 0j, s + 0j).real
    # Left over: 1e-9 of 10 kN on some 240 N/m and metres of lever.
    check("places [m]", found[:, :2], rest.position[1:7, [0, 2]], within=1e-7)
    turns = rest.rotation[1:7, :, 0][:, [0, 2]]
    check("turns", found[:, 2:], turns, within=1e-7)
    check("head [m]", plane_pantograph.head_height(a, s), rest.position[rest.numbers[HEAD], 2],
          within=1e-7)  # fmt: skip


def test_all_methods_agree_over_two_seconds() -> None:
    """150 N +- 30 N of 1-20 Hz on the head: 1e-6 m; what is expected of each is less.

    Variable steps with errors of 1e-9 a step: 1e-8. Fixed steps h = 0.5 ms: (w h)^2 / 12 of the
    swing at w, 5 Hz and 2 mm at most, times the w t = 60 rad of 2 s that a wrong frequency turns:
    but damped within 0.5 s, 15 rad: 6e-7. Joints 1e-9 m. Some 10 s on one core.
    """
    found = ways(2.0, 0.5e-3)
    far = print_agreement(found, "two coordinates in the plane")
    for name, way in found.items():
        check(name, far[name], 0.0, within=1e-6 if "steps of" in name else 1e-8)
        assert way.opened < 1e-9, name
    assert np.ptp(found["two coordinates in the plane"].heights) > 1e-3


def test_ten_minutes_of_the_pantograph_of_the_time_loop() -> None:
    """600 000 steps of the head over the reduced mechanism: no drift, energy consistent. Some 4 s.

    Balance: only mass and lift that change with height are not counted exactly. The raising swings
    by 30 mm, over which the mass changes by some 1 %: of (w h)^2 / 12 with w = 2.7 1/s, 6e-7.
    """
    n_steps = 600_000
    forces = contact_forces(n_steps)
    data = raising_data(paper.data(), STATIC, HEIGHT)
    pantograph = RaisingPantograph(data, Stepping(0.0, DT))
    still = np.array([HEIGHT, HEIGHT + STATIC / data.head.stiffness])
    pantograph.restore(np.concatenate([still, np.zeros(4)]))
    places, before = np.empty((n_steps + 1, 2)), energy(data, pantograph)
    places[0] = still
    begin = time.perf_counter()
    for number in range(1, n_steps + 1):
        pantograph.predict(DT * number)
        pantograph.advance(forces[number : number + 1])
        places[number] = pantograph.position
    wall = time.perf_counter() - begin
    print(f"600 s in {wall:.1f} s: {1e6 * wall / n_steps:.1f} us a step")
    check_no_drift(places[:, 0])
    frame, arm = data.frame, places[:, 1] - data.head.offset - data.base_height
    lift = CubicSpline(frame.heights, frame.lifts - data.head.weight).antiderivative()
    head, frame_way = np.diff(places, axis=0).T
    lost = data.head.damping * (head - frame_way) ** 2 / DT
    lost += CubicSpline(frame.heights, frame.dampings)(mean(arm)) * frame_way**2 / DT
    by_lift = float(lift(arm[-1]) - lift(arm[0]))
    gained = energy(data, pantograph) - before
    check_balance(gained, -mean(forces) * head, by_lift, lost, within=1e-8)
