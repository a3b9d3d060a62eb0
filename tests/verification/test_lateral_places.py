"""Where wires that move sideways cross the strips: against their nodes, and what a head that rolls
makes of it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from measuring import History, check, start_march
from small_lines import EN_PANTOGRAPH, WHOLE, ac_simple_line, mesh_of, problem_of, train

from catenary.mbs.head.strips import Strips, Turning
from catenary.mbs.vehicle import Harmonic, VehicleMotion
from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.model.link_directions import at_places
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.form_finding import find_form
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView

LATERAL = frozenset({"lateral_motion"})
ROLL = Turning(2.0, 470.0, 60.0)
STRIPS = Strips(2, 0.5, 1.4)


@cache
def problem(*, rolls: bool = False, sways: bool = False) -> Problem:
    line = ac_simple_line(4)
    line = replace(line, steady_arm=replace(line.steady_arm, inclination=np.deg2rad(10.0)))
    data = replace(EN_PANTOGRAPH, strips=STRIPS, roll=ROLL if rolls else None)
    going = train(80.0, 70.0, 110.0, static_force=200.0, raise_time=0.1, data=data)
    names = WHOLE | LATERAL | ({"head_roll"} if rolls else set())
    made = problem_of(line, names | ({"vehicle_motion"} if sways else set()), train=going)
    vehicle = VehicleMotion(lateral=(Harmonic(0.05, 2.0),)) if sways else None
    return replace(made, train=replace(made.train, vehicle=vehicle))


class Rows(Observer):
    """Takes blocks of rows from a compiled loop, and some whole states beside them."""

    def __init__(self) -> None:
        self.rows: list[np.ndarray] = []

    def start(self, stage: Stage) -> None:
        self.stage = stage

    def observe(self, view: StepView) -> None:
        self.columns = view.columns
        self.rows += list(view.rows.copy())

    def next_state(self, step: int) -> int:
        return step + 100

    def finish(self, outcome: str) -> None:
        assert outcome == "done"

    def __getitem__(self, channel: str) -> np.ndarray:
        return np.array(self.rows)[:, self.columns[channel]]


def test_places_are_stagger_and_motion_of_the_wire_less_the_sway() -> None:
    """The wire's place by its nodes at the end of each step. Channels lack what the step's forces
    add: at an arm up to h^2 / 4 times 250 N on a kilogram, some 6e-5 m."""
    swaying = problem(sways=True)
    mesh = mesh_of(swaying.line, 3)
    model, form = find_form(swaying, mesh)
    assert form.lateral is not None
    nodes = np.arange(mesh.n_nodes)

    def look(view: StepView) -> np.ndarray:
        strips = view.contact_position[0] + np.array(STRIPS.offsets)
        own = at_places(model, CONTACT_WIRE, strips, ("v", "theta_z"))
        moved, rest = np.zeros((2, model.n_dofs))
        for name, at_rest in (("v", form.lateral.y), ("theta_z", form.lateral.slope)):
            moved[model.dofs(nodes, name)] = view.node_motion(name, False)
            rest[model.dofs(nodes, name)] = at_rest
        places = [(own.weights * of[own.unknowns]).sum(axis=1) for of in (moved, rest)]
        return np.concatenate([*places, view.lateral_displacement, view.lateral_place])

    history = History(look)
    run, _ = start_march(swaying, mesh)
    run.run([history])
    run.destroy()
    found = np.array(history.watched)
    moved, rest, motion, place = np.split(found, 4, axis=1)
    sway = 0.05 * np.sin(2.0 * np.pi * 2.0 * np.array(history.time))[:, None]
    assert np.abs(moved).max() > 2e-3
    check("lateral motion [m]", motion, moved, within=6e-5)
    check("place on the strips [m]", place, rest + moved - sway, within=6e-5)


def test_blocks_of_steps_show_the_same_places_as_single_ones() -> None:
    rolling = problem(rolls=True, sways=True)
    mesh, single, block = mesh_of(rolling.line, 3), History(), Rows()
    single.watch = lambda view: np.append(view.lateral_place, view.lateral_displacement)
    for observer in (single, block):
        run, _ = start_march(rolling, mesh)
        run.run([observer])
        run.destroy()
    both = np.hstack([block["lateral_place"], block["lateral_displacement"]])
    assert np.array_equal(both, np.array(single.watched))
    assert np.array_equal(block["contact_force"], single["contact_force"])
    assert len(block.rows) > 400


def test_a_head_rolls_under_the_moving_place_of_the_wire() -> None:
    """Its angle follows I phi'' + c phi' + k phi = -sum l F, with the places and forces shown, by
    the same average acceleration: to round-off."""
    rolling = problem(rolls=True)
    mesh, angles = mesh_of(rolling.line, 3), []
    history = History()
    run, _ = start_march(rolling, mesh)
    head = run._pantographs.models[0]  # noqa: SLF001  (an angle is no channel)

    def look(view: StepView) -> np.ndarray:
        angles.append(float(head.position[head._arrays.roll]))  # noqa: SLF001
        return np.concatenate([view.lateral_place, view.strip_force])

    history.watch = look
    run.run([history])
    run.destroy()
    place, force = np.split(np.array(history.watched), 2, axis=1)
    moments, h = -(place * force).sum(axis=1), rolling.numerics.dt
    expected, speed, gained = np.zeros(moments.size), 0.0, 0.0
    for n in range(1, moments.size):
        angle = expected[n - 1] + h * speed + h**2 / 4 * gained
        rate = speed + h / 2 * gained
        right = moments[n] - ROLL.damping * rate - ROLL.stiffness * angle
        gained_now = right / (ROLL.inertia + h / 2 * ROLL.damping + h**2 / 4 * ROLL.stiffness)
        expected[n], speed = angle + h**2 / 4 * gained_now, rate + h / 2 * gained_now
        gained = gained_now
    assert np.abs(expected).max() > 0.02
    check("roll [rad]", np.array(angles), expected, within=1e-9)


def test_lines_without_lateral_motion_have_none_of_it() -> None:
    """No channel, no kernel's numbers, no array: nothing to pay for."""
    flat = problem()
    flat = replace(flat, effects=flat.effects - LATERAL)
    mesh = mesh_of(flat.line, 3)
    run, _ = start_march(flat, mesh)
    pantographs = run._pantographs  # noqa: SLF001
    assert pantographs.across.size == pantographs.lateral_place.size == 0
    rows = Rows()
    run.run([rows])
    run.destroy()
    assert rows["lateral_place"].shape[1] == rows["lateral_displacement"].shape[1] == 0
    assert not rows.stage.train.laws.lateral


def test_nodes_of_contact_wires_are_those_of_the_mesh() -> None:
    made = problem()
    mesh = mesh_of(made.line, 3)
    model, form = find_form(made, mesh)
    run, _ = start_march(made, mesh)
    wires: ContactWires = run._wire  # noqa: SLF001
    assert np.array_equal(mesh.x(wires.mesh_nodes), wires.x)
    run.destroy()
