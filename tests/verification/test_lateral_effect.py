"""The door for new effects: lateral motion under wind, registered by a test in a few lines.

It asks for two more unknowns at every wire node and adds wires in the lateral plane, anchors and
a load that changes with time. The vertical motion must not notice.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from measuring import COMM, check, march, matrix_of, registered, solve_free
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.meshgen.wires import Conductor, Role
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.effect import Effect, register
from catenary.solver.integrators.line_integrator import make_line
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.loads import ShapeLoad
from catenary.solver.model.partition import distribute
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.form_finding import find_form
from catenary.solver.wind import forces_along

NAME = "lateral_wind"
PLANE = ("v", "theta_z")
WIND = 8.0  # [N/m] on both wires


def build_lateral(builder: ModelBuilder) -> None:
    for wire in (CONTACT_WIRE, MESSENGER_WIRE):
        builder.add_wire(wire, PLANE)
        unknowns, weights = forces_along(builder.model, wire, PLANE)
        builder.add_load(ShapeLoad(unknowns, weights @ np.full(weights.shape[1], WIND)))
    builder.hold(builder.mesh.anchors, "v")


LATERAL = Effect(
    NAME,
    "lateral motion of the wires under wind",
    "lateral unknowns, wires and anchors; a load per length",
    "test",
    default=False,
    unknowns_of_wire=lambda wire: ("v", "theta_z"),
    build=build_lateral,
)


def build_sideways(builder: ModelBuilder) -> None:
    builder.add_wire(CONTACT_WIRE, ("v", "theta_z"))
    builder.hold(builder.mesh.wires[CONTACT_WIRE][[0, -1]], "v")


OF_CONTACT_WIRE = Effect(
    "sideways",
    "lateral motion of the contact wire only",
    "lateral unknowns and one wire",
    "test",
    default=False,
    unknowns_of_wire=lambda wire: ("v", "theta_z") if wire.role is Role.CONTACT else (),
    build=build_sideways,
)


@pytest.fixture(autouse=True)
def door() -> Iterator[None]:
    """Every test here knows the effects; none leaves them behind."""
    before = list(effects.registry())
    with registered(LATERAL), registered(OF_CONTACT_WIRE):
        yield
    assert list(effects.registry()) == before


def scene(names: frozenset[str], damping: Damping, end: float, dt: float) -> Problem:
    line = en50318_line(3)
    return problem_of(
        line,
        names,
        damping=damping,
        train=train(70.0, 70.0, end, behind=(0.0, 31.0)),
        numerics=numerics(dt),
    )


@pytest.fixture(scope="module")
def mesh() -> LineMesh:
    return mesh_of(en50318_line(3), 3)


def test_a_second_effect_of_the_same_name_is_an_error() -> None:
    with pytest.raises(ValueError, match=NAME):
        register(LATERAL)


def test_four_unknowns_a_node_if_asked_for_and_two_otherwise(mesh: LineMesh) -> None:
    damping = Damping(1e-4, 0.0125)
    with_wind, _ = find_form(scene(WHOLE | {NAME}, damping, 80.0, 1e-3), mesh)
    without, _ = find_form(scene(WHOLE, damping, 80.0, 1e-3), mesh)
    assert with_wind.unknowns == ("w", "theta_y", "v", "theta_z")
    assert with_wind.n_dofs == 4 * mesh.n_nodes
    assert without.unknowns == ("w", "theta_y")
    assert without.n_dofs == 2 * mesh.n_nodes
    assert NAME not in without.terms_of and not without.loads
    n_elements = mesh.n_nodes - 2
    # Lateral wires, and a load on the two unknowns of each node.
    assert with_wind.terms_of[NAME] == n_elements + 2 * mesh.n_nodes
    assert len(with_wind.blocks) == len(without.blocks) + 2
    assert with_wind.constrained.size == without.constrained.size + mesh.anchors.size
    assert not with_wind.weight[with_wind.dofs(np.arange(mesh.n_nodes), "v")].any()


def test_an_effect_of_one_wire_makes_stations_no_wider_than_it_needs(mesh: LineMesh) -> None:
    """Four vertical unknowns and two lateral ones, which are solved for side by side."""
    problem = scene(WHOLE | {"sideways"}, Damping(1e-4, 0.0125), 80.0, 1e-3)
    model, form = find_form(problem, mesh)
    contact, messenger = mesh.wires[CONTACT_WIRE], mesh.wires[MESSENGER_WIRE]
    assert model.numbering.planes == (4, 2)
    assert model.n_dofs == 6 * contact.size and not model.numbering.missing.size
    with pytest.raises(ValueError, match="has no unknown v"):
        model.dofs(messenger, "v")
    line = make_line(COMM, model, distribute(model, 1, 0), problem.numerics)
    assert line.passes is not None and line.slow_path is None
    line.destroy()


def blown_out(wire: Conductor, x: np.ndarray) -> tuple[np.ndarray, float]:
    """Deflection q x (L - x) / (2 T) - q EI / T^2 (1 - exp(-lambda x) - exp(-lambda (L - x))) [m],

    lambda^2 = T / EI, and what elements much longer than 1 / lambda leave out of it: they spread
    the boundary layer over the last two of them, a seventh of it over the second.
    """
    inverse = np.sqrt(wire.tension / wire.bending_stiffness)
    length = x[-1]
    layers = 1 - np.exp(-inverse * x) - np.exp(-inverse * (length - x))
    lift = WIND * wire.bending_stiffness / wire.tension**2
    return WIND * x * (length - x) / (2 * wire.tension) - lift * layers, lift / 6


@pytest.mark.parametrize("wire", [CONTACT_WIRE, MESSENGER_WIRE])
def test_wind_deflects_a_wire_like_a_tensioned_beam(wire: str, mesh: LineMesh) -> None:
    """Nothing holds the wires laterally but the anchors, the string is as long as the line."""
    problem = scene(WHOLE | {NAME}, Damping(1e-4, 0.0125), 80.0, 1e-3)
    model, _ = find_form(problem, mesh)
    load = np.zeros(model.n_dofs)
    for wind in model.loads:
        assert isinstance(wind, ShapeLoad)
        load[wind.unknowns] += wind.forces
    solution = solve_free(matrix_of(model, stiffness=1.0), model, load)
    nodes = mesh.wires[wire]
    expected, left_out = blown_out(problem.line.wire(wire), mesh.x(nodes))
    found = solution[model.dofs(nodes, "v")]
    check(f"{wire} [m]", found, expected, within=left_out)
    assert not solution[model.dofs(nodes)].any()


def test_a_damped_march_under_wind_ends_at_the_static_deflection(mesh: LineMesh) -> None:
    """Critical damping of the lowest mode, beta = 2 omega_1, of which exp(-omega_1 t) is left."""
    line = en50318_line(3)
    omega = np.pi / 180.0 * line.messenger_wire.wave_speed
    duration, dt = 12.0, 4e-3
    problem = scene(
        frozenset({"vertical", NAME, "structural_damping"}),
        Damping(0.0, 2 * omega),
        70.0 + 70.0 * duration,
        dt,
    )
    # The train creeps, so that it stays on the line.
    creep = train(1.0, 70.0, 70.0 + duration + 0.5 * dt, static_force=0.0)
    problem = problem_of(
        line, problem.effects, damping=problem.damping, train=creep, numerics=numerics(dt)
    )
    history = march(
        problem,
        mesh,
        lambda view: view.checkpoint()["displacement"] if view.time > duration - 1e-6 else None,
    )
    model, _ = find_form(problem, mesh)
    nodes = mesh.wires[MESSENGER_WIRE]
    expected, left_out = blown_out(line.messenger_wire, mesh.x(nodes))
    state = history.watched[-1].reshape(mesh.n_nodes, -1)
    found = state[model.row_of_node[nodes], model.unknowns.index("v")]
    left = (1 + omega * duration) * np.exp(-omega * duration)
    print(f"omega_1 t = {omega * duration:.1f}: {left:.1e} of the first mode is left")
    # The first mode holds 32 / pi^3 of the parabola's height.
    check(
        "messenger wire [m]",
        found,
        expected,
        within=left_out + 32 / np.pi**3 * left * expected.max(),
    )


@pytest.mark.parametrize("name", [NAME, OF_CONTACT_WIRE.name])
def test_vertical_results_do_not_notice_what_is_lateral(name: str, mesh: LineMesh) -> None:
    damping = Damping(1e-4, 0.0125)
    runs = [march(scene(names, damping, 100.0, 1e-3), mesh) for names in (WHOLE, WHOLE | {name})]
    assert runs[0]["contact_force"].max() > 50.0
    # The same equations in another numbering: round-off, which differs in the factorisation and
    # adds up as the square root of the number of steps; a contact force is the difference of two
    # heights of 5.5 m on the contact spring.
    steps = len(runs[0].time)
    round_off = 8 * np.sqrt(steps) * np.finfo(float).eps * 5.5
    check(
        "contact force [N]",
        runs[1]["contact_force"],
        runs[0]["contact_force"],
        within=round_off * 5e4,
    )
    check(
        "dropper force [N]",
        runs[1]["dropper_force"],
        runs[0]["dropper_force"],
        within=round_off * 1e5,
    )
    check("arm uplift [m]", runs[1]["arm_uplift"], runs[0]["arm_uplift"], within=round_off)
