"""Channels at the ends of wires: they are what the equation of motion of the weights asks for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from axial_lines import ALONG, elastic_line
from measuring import check, march
from small_lines import mesh_of, numerics, problem_of, train

from catenary.solver.effects.shipped.motion_effects import moves_along
from catenary.solver.model.gauges import gauge_places
from catenary.solver.problem.ends import AlongTrack, Tensioner
from catenary.solver.problem.watched_links import GAUGES

UNDAMPED = ALONG - {"structural_damping"}
DT = 1e-3


def test_tension_travel_and_stops_are_those_of_the_moving_weights() -> None:
    """m x'' = r W - T - S_low + S_high of each tensioner, where average acceleration makes
    x_+ - 2 x + x_- = dt^2 (x''_+ + 2 x'' + x''_-) / 4. The end's element adds a sixth of its mass
    times the acceleration of its other node: some 0.5 kg times 3 m/s2, of 100 N."""
    line = elastic_line(4)
    travel, stiffness = 2e-6, 2e6
    tensioner = Tensioner(travel=travel, stop_stiffness=stiffness)
    along = AlongTrack(tensioner, end=True, mid_points=(60.0,))
    problem = problem_of(
        line, UNDAMPED, along=along, train=train(70.0, 65.0, 150.0), numerics=numerics(DT)
    )
    places = gauge_places(problem, moves_along(problem))
    assert [(place.wire, place.x, place.outwards) for place in places] == [
        (0, 0.0, -1), (1, 0.0, -1), (0, 60.0, 1), (0, 60.0, -1), (1, 60.0, 1), (1, 60.0, -1),
        (0, 240.0, 1), (1, 240.0, 1),
    ]  # fmt: skip
    seen = march(
        problem, mesh_of(line, 2), lambda view: [getattr(view, name).copy() for name in GAUGES]
    )
    tension, moved, weight, low, high = np.moveaxis(np.array(seen.watched), 1, 0)
    assert (moved[:, :6] == 0.0).all() and (low[:, :6] == 0.0).all()
    check("weights [m]", weight, tensioner.ratio * moved, within=1e-15)
    for what, force, way in (
        ("low", low[:, 6:], moved[:, 6:]),
        ("high", high[:, 6:], -moved[:, 6:]),
    ):
        beyond = stiffness * np.maximum(way - travel, 0.0)
        check(f"{what} stop [N]", force, beyond, within=1e-8)
    assert low.any() and high.any(), "the weights reach both stops"
    for column in (6, 7):
        wire = problem.line.wires[places[column].wire]
        mass = tensioner.inertia(wire.name, wire, problem.gravity)
        net = wire.tension - tension[:, column] - low[:, column] + high[:, column]
        change = np.diff(moved[:, column], 2) / DT**2
        mean = 0.25 * (net[:-2] + 2.0 * net[1:-1] + net[2:])
        print(f"{wire.name}: net force up to {np.abs(net).max():.1f} N")
        check("net force [N]", mass * change, mean, within=2e-2 * np.abs(net).max())
    # Across a mid-point the wire is held: its tension differs from side to side.
    assert np.ptp(tension[:, 2]) > 1.0 and np.abs(tension[:, 2] - tension[:, 3]).max() > 1.0


def test_lines_that_do_not_move_along_the_track_have_no_such_channels() -> None:
    problem = problem_of(elastic_line(3), ALONG - {"axial_motion", "tensioners", "temperature"})
    assert gauge_places(problem, moves_along(problem)) == ()
    held = replace(problem, effects=ALONG)
    assert len(gauge_places(held, moves_along(held))) == 4
