"""The air that a pantograph meets: uplift by speed, tunnels, wind along and across the track."""

from __future__ import annotations

import numpy as np
import pytest
from measuring import check

from catenary.mbs.air import Airflow, AirForces, Polynomial, Table, Tunnel, Uplift

# DSA380, by the speed in km/h: 0.00095 v^2 + 0.0017 v - 0.2 N.
DSA380 = Polynomial((-0.2, 0.0017 * 3.6, 0.00095 * 3.6**2))
EPS = np.finfo(float).eps


def test_a_published_polynomial_is_taken_as_it_is() -> None:
    speeds = np.array([100.0, 250.0, 350.0])
    published = 0.00095 * speeds**2 + 0.0017 * speeds - 0.2
    check("uplift [N]", DSA380(speeds / 3.6), published, within=8 * EPS * published)


def test_a_table_is_linear_inside_and_square_beyond() -> None:
    table = Table((20.0, 60.0), (8.0, 70.0))
    speeds = np.array([10.0, 20.0, 40.0, 60.0, 90.0])
    expected = [8.0 / 4, 8.0, 39.0, 70.0, 70.0 * 2.25]
    check("uplift [N]", table(speeds), expected, within=1e-12)


def test_head_and_frame_share_the_uplift() -> None:
    on_head, on_frame = Uplift(DSA380, 0.7).at(np.array([70.0]))
    check("head [N]", on_head, 0.7 * DSA380(np.array([70.0])), within=1e-12)
    check("whole [N]", on_head + on_frame, DSA380(np.array([70.0])), within=1e-12)


def test_forces_go_over_to_those_in_a_tunnel_behind_its_portals() -> None:
    flow = Airflow(50.0, 0.0, (Tunnel(100.0, 300.0, 1.6, 20.0),))
    places = np.array([0.0, 100.0, 110.0, 120.0, 280.0, 290.0, 300.0, 400.0])
    speed, factor = flow.at(places / 50.0)
    check("speed [m/s]", speed, 50.0, within=1e-12)
    check("factor", factor, [1.0, 1.0, 1.3, 1.6, 1.6, 1.3, 1.0, 1.0], within=1e-12)
    sudden = Airflow(50.0, 0.0, (Tunnel(100.0, 300.0, 1.6, 0.0),))
    check("factor", sudden.at(np.array([1.99, 2.01]))[1], [1.0, 1.6], within=1e-12)


@pytest.mark.parametrize(
    ("along", "across", "factor", "expected"),
    [
        (0.0, 0.0, 0.0, 70.0),
        (-10.0, 0.0, 0.0, 80.0),
        (0.0, 20.0, 0.0, 70.0),
        (0.0, 20.0, 1.0, np.sqrt(70.0**2 + 20.0**2)),
        (-10.0, -20.0, 0.5, np.sqrt(80.0**2 + 0.5 * 20.0**2)),
    ],
)
def test_wind_adds_to_the_speed_of_the_train_as_far_as_it_counts(
    along: float, across: float, factor: float, expected: float
) -> None:
    def wind(places: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.full(places.size, along), np.full(places.size, across)

    flow = Airflow(70.0, 0.0, (Tunnel(1000.0, 2000.0, 1.0, 0.0),), wind, factor)
    check("open line [m/s]", flow.at(np.array([1.0]))[0], expected, within=4 * EPS * expected)
    check("in a tunnel [m/s]", flow.at(np.array([20.0]))[0], 70.0, within=1e-12)


def test_forces_grow_while_the_pantograph_is_raised() -> None:
    forces = AirForces(Airflow(70.0), Uplift(DSA380, 0.7), raise_time=2.0)
    whole = forces.now(5.0)
    check("parts", forces.at(np.arange(4.0)), np.outer([0, 0.5, 1, 1], whole), within=1e-12)
    check("of the train's own air", whole[2], 1.0, within=0.0 + EPS)
    moved = AirForces(Airflow(70.0, 0.0, (Tunnel(70.0, 999.0, 2.0, 0.0),)), None, 0.0)
    check("square", moved.at(np.array([0.5, 1.5]))[:, 2], [1.0, 2.0], within=EPS)
    check("alone", moved.now(1.5), moved.at(np.array([1.5]))[0], within=EPS)
