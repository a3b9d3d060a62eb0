"""Lines made in a few lines on one rank and on all: links, loads, wires and planes of all kinds.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``; see `check_ranks` for what is compared.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axial_lines import ALONG, elastic_line
from contact_wires import STIFFNESS, overlap, problem_on, twins
from measuring import registered
from more_wires import AUXILIARY, STITCH, TOPOLOGIES, data_of, further_topologies
from rank_histories import WORLD, check_ranks, scene_on_all
from small_lines import (
    EN_PANTOGRAPH,
    WHOLE,
    ac_simple_line,
    en50318_line,
    mesh_of,
    numerics,
    problem_of,
    train,
)  # fmt: skip
from stops import LEANING_LINKS, STOP_FORCE, UPLIFT_STOP

from catenary.mbs.head.strips import Strips, Turning
from catenary.meshgen.line import Curve, DropperPlace, Line
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.solver.effects.effect import Effect
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.loads import FieldLoad, FunctionLoad, ShapeLoad, harmonics
from catenary.solver.model.partition import distribute
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.defects import DropperBreak, TensionLoss
from catenary.solver.problem.ends import AlongTrack, Tensioner
from catenary.solver.statics.line_at_rest import line_at_rest, line_at_rest_on_all
from catenary.solver.time_loop.views import channels
from catenary.solver.wind import forces_along

WAYS = {
    "implicit": numerics(1e-3, coupling="implicit"),  # type: ignore[arg-type]
    "iterated": numerics(1e-3, coupling="iterated"),  # type: ignore[arg-type]
    "fixed point": numerics(1e-3, "fixed_point"),
    "adapted": numerics(1e-3, adaptive_tolerance=0.5, smallest_dt=2.5e-4),
}
SEVERAL = {"unequal twins": lambda: twins(0.3), "overlap": overlap}


def test_a_staggered_line_moves_sideways() -> None:
    line = ac_simple_line(4)
    arm = replace(line.steady_arm, inclination=np.deg2rad(10.0))
    line = replace(line, steady_arm=arm, curve=Curve(1 / 3000, 0.05))
    data = replace(EN_PANTOGRAPH, roll=Turning(2.0, 470.0, 60.0))
    going = train(80.0, 70.0, 125.0, static_force=250.0, raise_time=0.1, data=data)
    problem = problem_of(line, WHOLE | {"lateral_motion", "head_roll"}, train=going)
    shown = check_ranks(line_at_rest_on_all(problem, mesh_of(line, 3), WORLD)).channels
    assert shown["contact_force"].max() > 150.0
    assert np.ptp(shown["lateral_displacement"]) > 1e-5


def test_leaning_droppers_weights_and_their_stops_move_along_the_track() -> None:
    line = elastic_line(3)
    assert line.messenger_wire is not None
    line = replace(line, messenger_wire=replace(line.messenger_wire, expansion=0.0))
    ours = train(80.0, 78.0, 88.0, static_force=3000.0, raise_time=0.0, nominal_height=5.5)
    problem = problem_of(
        line,
        ALONG - {"structural_damping"},
        along=AlongTrack(Tensioner(travel=0.3), end=True, warmer=40.0),
        train=ours,
        numerics=numerics(1e-3),
    )
    mesh = mesh_of(line, 2)
    rest = line_at_rest_on_all(problem, mesh, WORLD)
    assert np.array_equal(rest.form.along, line_at_rest(problem, mesh).form.along)
    assert np.abs(rest.form.leaning(mesh.droppers)).max() > 0.005
    shown = check_ranks(rest, 40).channels
    assert np.abs(shown["motion_u"]).max() > 1e-5
    assert (shown["dropper_force"] <= 0.0).any()


def test_links_of_further_kinds_act(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(channels.CHANNELS, STOP_FORCE.name, STOP_FORCE)
    run_of = train(80.0, 6.0, 66.0, static_force=260.0, raise_time=0.0, nominal_height=5.5)
    line = replace(
        en50318_line(3),
        span_lengths=(24.0,) * 3,
        dropper_positions=((4.0, 12.0, 20.0),) * 3,
        pre_sag=((0.0,) * 3,) * 3,
        stagger=(0.0,) * 4,
    )
    with registered(UPLIFT_STOP), registered(LEANING_LINKS):
        problem = problem_of(
            line,
            WHOLE | {"uplift_stop", "leaning_links"},
            train=replace(run_of, start_below=0.02),
            numerics=numerics(1e-3),
        )
        rest = line_at_rest(problem, mesh_of(line, 2))
        shown = check_ranks(rest).channels
    # No cut separates what a link joins.
    cuts = distribute(rest.model, WORLD.size, 0).bounds[1:-1]
    for links in rest.model.links:
        low = links.direction.unknowns.min(axis=1)[:, None]
        high = links.direction.unknowns.max(axis=1)[:, None]
        assert not ((low < cuts) & (cuts <= high)).any()
    assert (shown[STOP_FORCE.name] > 0.0).any(axis=0).all()


@pytest.mark.parametrize("topology", list(TOPOLOGIES))
def test_lines_of_three_wires_with_incidents(topology: str) -> None:
    with further_topologies():
        line = make_line(data_of(topology, 4))
    mast = float(line.support_positions[2])
    first = float(line.droppers_of_span(2)[0])
    wire = AUXILIARY if topology == "compound" else STITCH
    problem = problem_of(
        line,
        WHOLE | {"dropper_break", "tension_loss"},
        train=train(80.0, mast - 40.0, mast + 20.0, static_force=250.0, raise_time=0.1),
        incidents=(TensionLoss(0.2, wire, 0.8), DropperBreak(0.3, DropperPlace(first))),
    )
    shown = check_ranks(line_at_rest(problem, mesh_of(line, 2))).channels
    assert shown["contact_force"].max() > 150.0 and (shown["dropper_force"][-1] == 0.0).any()


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", SEVERAL)
def test_several_contact_wires_under_several_strips(name: str, way: str) -> None:
    """Two pantographs of two strips, over all cuts between ranks, with damping in the contacts."""
    line: Line = SEVERAL[name]()
    strips = replace(EN_PANTOGRAPH, strips=Strips(2, 0.6))
    run_of = train(
        90.0, 16.0, 45.0, data=strips, static_force=230.0, behind=(0.0, 9.0), raise_time=0.0,
        nominal_height=5.5,
    )  # fmt: skip
    problem = problem_on(
        line,
        train=replace(run_of, start_below=0.02),
        contact=LinearLaw(STIFFNESS, 60.0),
        numerics=WAYS[way],
    )
    rest = line_at_rest(problem, mesh_of(line, 2))
    cuts = distribute(rest.model, WORLD.size, 0).bounds[1:-1]
    assert (np.diff([0, *cuts, rest.model.n_dofs]) > 0).all()
    # Those that iterate end at a tolerance of their own.
    within = 1e-6 if way in ("iterated", "fixed point") else 1e-9
    shown = check_ranks(rest, within=within).channels
    strip = shown["strip_force"]
    assert strip.shape[1] == 4 and (strip > 0.0).any(axis=0).all()
    assert (shown["contact_force"] == 0.0).any() and (shown["dropper_force"] == 0.0).any()


@pytest.mark.parametrize("name", SEVERAL)
def test_a_height_that_no_scene_gives_follows_from_all_contact_wires(name: str) -> None:
    """Which no rank has alone."""
    line: Line = SEVERAL[name]()
    problem = problem_on(line, train=train(90.0, 20.0, 24.0, raise_time=0.1))
    assert problem.train.placements[0].nominal_height is None
    check_ranks(line_at_rest(problem, mesh_of(line, 2)))


def blow(builder: ModelBuilder) -> None:
    """One load of each kind, along all of both wires."""
    for wire in (CONTACT_WIRE, MESSENGER_WIRE):
        x = builder.mesh.x(builder.mesh.wires[wire])
        unknowns, weights = forces_along(builder.model, wire, ("w", "theta_y"))
        builder.add_load(ShapeLoad(unknowns, weights @ np.full(x.size, 2.0)))
        builder.add_load(
            ShapeLoad(unknowns, weights @ np.cos(0.1 * x), harmonics([2.0], [3.0], [0.0]))
        )

        def fill(first: int, part: slice, slices: np.ndarray, x: np.ndarray = x) -> None:
            times = 0.02 * (first + np.arange(slices.shape[0]))
            slices[:] = np.sin(0.3 * x[part] - 20.0 * times[:, None])

        builder.add_load(FieldLoad(unknowns, weights, 0.02, fill))
    at = builder.model.dofs(builder.mesh.droppers[:, 1])
    pull = np.linspace(1.0, 5.0, at.size)
    builder.add_load(FunctionLoad("function", at, lambda time: pull * np.sin(30.0 * time)))


def test_loads_of_all_kinds_and_a_dropper_that_breaks_under_them() -> None:
    words = [
        "line.n_spans=7", "train.start_m=120", "train.end_m=155", "train.raise_time_s=0.1",
        "numerics.dt_s=2e-3", "evaluation.from_m=140", "evaluation.to_m=150",
    ]  # fmt: skip
    problem, mesh = scene_on_all("en50318_2002", words)
    problem = replace(
        problem,
        effects=problem.effects | {"loads", "dropper_break"},
        incidents=(DropperBreak(0.2, DropperPlace(180.0)),),
    )
    with registered(Effect("loads", "loads", "loads", "test", False, build=blow)):
        check_ranks(line_at_rest_on_all(problem, mesh, WORLD), 150)
