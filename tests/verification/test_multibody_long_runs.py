"""All methods on the paper's seven bodies agree; 20 s and 10 min of it are in ``benchmarks``."""

from __future__ import annotations

import numpy as np
import paper_pantograph as ambrosio
import plane_pantograph
from agreement import print_agreement, ways
from measuring import check
from seven_bodies import HEAD, at_rest, calibrated, pressed


def test_plane_pantograph_rests_where_the_bodies_do() -> None:
    """Two coordinates by hand and seven bodies with joints: round-off of both searches."""
    system = calibrated()
    rest = at_rest(pressed(system))
    a, s = plane_pantograph.rest(system.force(ambrosio.ACTUATOR).force, 150.0)
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
