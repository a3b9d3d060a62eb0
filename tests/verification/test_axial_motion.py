"""Motion along the track: waves of a bar, the sagging cable, and what droppers and sag couple."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axial_lines import (
    ALONG,
    AXIAL,
    HANGING_ALONG,
    OF_CONTACT_WIRE,
    PotentialOfLine,
    elastic_line,
    elastic_wires,
    hessian_of,
    line_of_few_droppers,
)
from measuring import (
    check,
    free_dofs,
    free_matrices,
    line_alone,
    march,
    matrix_of,
    registered,
    release,
    step,
)
from scipy import optimize
from scipy.sparse import linalg as sparse_linalg
from small_lines import (
    BARE,
    EN_MESSENGER_WIRE,
    HANGING,
    WHOLE,
    ac_simple_line,
    mesh_of,
    numerics,
    problem_of,
    train,
)

from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.solver.effects.build_model import build
from catenary.solver.effects.effect import Effect
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.loads import ShapeLoad
from catenary.solver.model.model import Model
from catenary.solver.problem.ends import AlongTrack, Tensioner
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.form_finding import find_form

EPS = np.finfo(float).eps
STRAIGHT = BARE | AXIAL
UNDAMPED = ALONG - {"structural_damping"}


def straight_wires(length: float, n_elements: int) -> Model:
    """Two wires without weight, held at both ends."""
    line = elastic_wires(length)
    return build(problem_of(line, STRAIGHT), mesh_of(line, n_elements), np.zeros(0))


def test_a_wave_travels_at_the_speed_of_sound_of_the_wire() -> None:
    """A hump u = f(x - c t), c = sqrt(EA / m), over 600 m of contact wire.

    Of a wave of wavenumber k bars of length h with consistent mass are faster by (k h)^2 / 24, and
    average acceleration is slower by (k c dt)^2 / 12: the hump of width s is displaced by that
    share of its way for k up to some 4 / s, where exp(-(k s)^2 / 4) leaves 2 % of the spectrum.
    """
    length, n, dt, width = 1600.0, 1600, 1e-4, 40.0
    model = straight_wires(length, n)
    nodes = model.mesh.wires[CONTACT_WIRE]
    x, unknowns = model.mesh.x(nodes), model.dofs(nodes, "u")
    speed = np.sqrt(OF_CONTACT_WIRE / model.problem.line.wire(CONTACT_WIRE).mass_per_length)
    way = 600.0
    n_steps = round(way / speed / dt)
    way = n_steps * dt * speed

    def hump(middle: float) -> np.ndarray:
        return np.exp(-(((x - middle) / width) ** 2))

    displacement, velocity = np.zeros((2, model.n_dofs))
    displacement[unknowns] = 1e-3 * hump(400.0)
    velocity[unknowns] = 1e-3 * speed * 2.0 * (x - 400.0) / width**2 * hump(400.0)
    with line_alone(model, numerics(dt)) as stepper:
        release(stepper, displacement, velocity, model)
        for _ in range(n_steps):
            step(stepper)
        found = stepper.displacement[unknowns] / 1e-3
        vertical = stepper.displacement[model.dofs(np.arange(model.mesh.n_nodes))]
    arrived = (x * found).sum() / found.sum() - 400.0
    h, k = length / n, 4.0 / width
    off = abs((k * h) ** 2 / 24 - (k * speed * dt) ** 2 / 12)
    check("speed [m/s]", arrived / way * speed, speed, within=off * speed)
    check("hump", found, hump(400.0 + way), within=off * way * np.sqrt(2 / np.e) / width)
    assert not vertical.any(), "a straight wire that stretches does not bend"


@pytest.mark.parametrize("mode", [1, 3])
def test_bars_have_their_discrete_frequencies(mode: int) -> None:
    """omega^2 = (c / h)^2 6 (1 - cos k h) / (2 + cos k h) of bars with consistent mass."""
    length, n = 60.0, 20
    model = straight_wires(length, n)
    mass, stiffness = free_matrices(model)
    nodes = model.mesh.wires[CONTACT_WIRE]
    h, k = length / n, mode * np.pi / length
    speed = np.sqrt(OF_CONTACT_WIRE / model.problem.line.wire(CONTACT_WIRE).mass_per_length)
    expected = (speed / h) ** 2 * 6 * (1 - np.cos(k * h)) / (2 + np.cos(k * h))
    shape = np.zeros(model.n_dofs)
    shape[model.dofs(nodes, "u")] = np.sin(k * model.mesh.x(nodes))
    shape = shape[free_dofs(model)]
    found = shape @ (stiffness @ shape) / (shape @ (mass @ shape))
    check("omega^2 [1/s2]", found, expected, within=1e-10 * expected)
    assert np.abs(stiffness @ shape - found * (mass @ shape)).max() < 1e-9 * found


def test_a_sagging_cable_has_the_frequencies_of_irvine() -> None:
    """tan(x / 2) = x / 2 - 4 / lambda^2 (x / 2)^3 of symmetric modes, x = omega L / c.

    Irvine and Caughey (1974): lambda^2 = (m g L / T)^2 EA / T. They leave out the inertia along
    the wire, a share of (omega L / (pi c_a))^2, and the squares of slopes, (m g L / 2 T)^2 / 3.
    """
    length, n = 60.0, 24
    light = replace(
        EN_MESSENGER_WIRE,
        tension=1600.0,
        mass_per_length=0.1,
        bending_stiffness=0.0,
        axial_stiffness=11e6,
    )
    line = replace(elastic_wires(length), messenger_wire=light)
    problem = problem_of(line, HANGING_ALONG)
    model, _ = find_form(problem, mesh_of(line, n))
    mass, stiffness = free_matrices(model)
    numbers = free_dofs(model)
    nodes = model.mesh.wires[MESSENGER_WIRE]
    own = [model.dofs(nodes, name) for name in model.unknowns]
    mine = np.flatnonzero(np.isin(numbers, np.concatenate(own)))
    values = np.sort(
        np.sqrt(
            sparse_linalg.eigsh(
                stiffness[mine][:, mine],
                6,
                mass[mine][:, mine],
                sigma=0.0,
                return_eigenvectors=False,
            )
        )
    )
    speed = np.sqrt(light.tension / light.mass_per_length)
    sag = light.mass_per_length * problem.gravity * length / light.tension
    extends = sag**2 * 11e6 / light.tension

    def equation(x: float) -> float:
        half = 0.5 * x
        return np.sin(half) - (half - 4.0 / extends * half**3) * np.cos(half)

    first = optimize.brentq(equation, np.pi + 1e-6, 2.9 * np.pi) * speed / length
    inertia = (values[1] * length / (np.pi * np.sqrt(11e6 / light.mass_per_length))) ** 2
    print(f"lambda^2 = {extends:.2f}; a wire that keeps its tension: {np.pi * speed / length:.4f}")
    within = first * (inertia + sag**2 / 12.0 + 1e-4)
    check("first symmetric mode [rad/s]", values[0], first, within=within)
    # Antisymmetric modes do not stretch the cable.
    second = 2 * np.pi * speed / length
    check("first antisymmetric mode [rad/s]", values[1], second, within=second * (inertia + 1e-3))


def potential_of(problem: Problem, model: Model) -> PotentialOfLine:
    assert model.form is not None
    return PotentialOfLine(problem, model.mesh, model.form)


def test_the_stiffness_is_that_of_the_potential_energy() -> None:
    """Against an energy written down by itself: strain of a bar, geometry of droppers."""
    line = line_of_few_droppers()
    problem = problem_of(line, HANGING_ALONG)
    model, form = find_form(problem, mesh_of(line, 1))
    every = np.arange(model.mesh.n_nodes)
    at = np.concatenate([form.height, form.slope, np.zeros(every.size)])
    wanted = hessian_of(potential_of(problem, model), at)
    numbers = np.concatenate([model.dofs(every, name) for name in ("w", "theta_y", "u")])
    found = matrix_of(model, stiffness=1.0).toarray()[np.ix_(numbers, numbers)]
    free = ~np.isin(numbers, model.constrained)
    wanted, found = wanted[np.ix_(free, free)], found[np.ix_(free, free)]
    # Round-off of forces of 1e4 N over steps of 1e-6, and slopes rounded to 1e-10: EA times that.
    check("stiffness", found, wanted, within=1e-8 * np.abs(wanted).max())
    coupling = np.abs(found[-every.size :, : every.size]).max()
    assert coupling > 1e3, "sag couples height and place along the track"


def test_a_straight_line_moves_as_if_there_was_no_motion_along_the_track() -> None:
    """Without weight wires are straight at rest, and nothing joins the planes."""
    line, dt = elastic_line(2), 1e-3
    mesh = mesh_of(line, 2)
    ours = train(70.0, 20.0, 50.0)
    names = WHOLE - {"gravity", "dropper_slackening"}
    runs = [
        march(problem_of(line, effects, train=ours, numerics=numerics(dt)), mesh)
        for effects in (names, names | AXIAL)
    ]
    steps = len(runs[0].time)
    round_off = 8 * np.sqrt(steps) * EPS * 5.5 * 5e4
    check(
        "contact force [N]",
        runs[1]["contact_force"],
        runs[0]["contact_force"],
        within=round_off,
    )


def test_energy_stays_where_planes_are_coupled() -> None:
    """Average acceleration keeps it, with tensioners that turn at one end."""
    line = elastic_line(2)
    problem = problem_of(line, HANGING_ALONG, along=AlongTrack(end=True))
    model, _ = find_form(problem, mesh_of(line, 2))
    load = np.zeros(model.n_dofs)
    load[model.dofs(model.mesh.droppers[4, 1])] = 200.0
    stiffness = matrix_of(model, stiffness=1.0).tolil()
    stiffness[model.constrained, model.constrained] = 1.0
    lifted = sparse_linalg.spsolve(stiffness.tocsc(), load)
    n_steps, totals = 4000, []
    with line_alone(model, numerics(1e-3)) as stepper:
        release(stepper, lifted, np.zeros_like(lifted), model)
        for number in range(n_steps + 1):
            if number % 100 == 0:
                totals.append(sum(stepper.energies()))
            step(stepper)
        along = np.abs(stepper.displacement[model.dofs(model.mesh.anchors, "u")])
    assert along.max() > 1e-6, "the weights have moved"
    total = np.array(totals)
    # Entries of K are EA / h, forty times those of the vertical motion of the same wires.
    check("relative change", np.abs(total / total[0] - 1).max(), 0.0, within=40 * n_steps * EPS)


def test_weights_move_a_wire_like_a_mass_on_a_bar() -> None:
    """A massive tensioner on a light wire: omega^2 = (EA / L) / (r^2 W / g) but for the bar's mass,
    a third of which moves with it."""
    length = 60.0
    line = elastic_wires(length)
    tensioner = Tensioner(ratio=3.0)
    along = AlongTrack(tensioner, end=True)
    problem = problem_of(line, STRAIGHT, along=along)
    model = build(problem, mesh_of(line, 8), np.zeros(0))
    wire = problem.line.wire(CONTACT_WIRE)
    inertia = tensioner.inertia(CONTACT_WIRE, wire, problem.gravity)
    assert inertia == pytest.approx(3.0 * wire.tension / problem.gravity, rel=1e-12)
    mass, stiffness = free_matrices(model)
    own = model.dofs(model.mesh.wires[CONTACT_WIRE], "u")
    mine = np.flatnonzero(np.isin(free_dofs(model), own))
    mass, stiffness = mass[mine][:, mine], stiffness[mine][:, mine]
    (value,) = sparse_linalg.eigsh(stiffness, 1, mass, sigma=0.0, return_eigenvectors=False)
    bar = wire.mass_per_length * length
    expected = OF_CONTACT_WIRE / length / (inertia + bar / 3)
    # Rayleigh's quotient of the linear shape is off by a share of (m / M)^2 / 45.
    check("frequency", np.sqrt(value / expected), 1.0, within=(bar / inertia) ** 2 / 45)


def test_a_stop_holds_a_tensioner_that_has_gone_its_way() -> None:
    """A force F that pulls the end outwards, mass M of the weights, stop k at the gap g.

    The end moves to x with F x = k_w x^2 / 2 + k (x - g)^2 / 2, k_w that of the wire, whose own
    mass and sag take a few percent of it.
    """
    line, force, gap, stop = elastic_line(2), 30e3, 0.004, 5e7
    mesh = mesh_of(line, 2)
    end = mesh.wires[CONTACT_WIRE][-1:]

    def pull(builder: ModelBuilder) -> None:
        builder.add_load(ShapeLoad(builder.model.dofs(end, "u"), np.array([force])))

    puller = Effect("pull", "a force outwards", "a load", "test", default=False, build=pull)
    problem = problem_of(
        line,
        UNDAMPED | {"pull"},
        along=AlongTrack(Tensioner(travel=gap, stop_stiffness=stop), end=True),
        train=train(70.0, 20.0, 27.0),
        numerics=numerics(1e-3),
    )
    with registered(puller):
        history = march(problem, mesh, lambda view: view.checkpoint()["displacement"])
        model, _ = find_form(problem, mesh)
    states = np.array(history.watched).reshape(len(history.time), mesh.n_nodes, -1)
    moved = states[:, model.row_of_node[end[0]], model.unknowns.index("u")]
    own = OF_CONTACT_WIRE / 120.0
    # (k + k_w) x^2 - 2 (F + k g) x + k g^2 = 0
    half = force + stop * gap
    root = np.sqrt(half**2 - (stop + own) * stop * gap**2)
    expected = (half + root) / (stop + own)
    print(f"{1e3 * moved.max():.3f} mm with a stop at {1e3 * gap:g} mm")
    check("furthest [m]", moved.max(), expected, within=0.05 * (expected - gap) + 0.01 * gap)
    after = moved[np.argmax(moved) :]
    assert after.min() < gap, "the stop pushes, it does not hold on"


def test_arms_swing_along_the_track_by_their_radial_force() -> None:
    """P / l of each, P = 4 T a / L of a zig-zag +-a."""
    line = replace(
        ac_simple_line(4),
        contact_wire=replace(ac_simple_line(4).contact_wire, axial_stiffness=18e6),
        messenger_wire=replace(ac_simple_line(4).messenger_wire, axial_stiffness=11e6),
    )
    model, _ = find_form(problem_of(line, HANGING | {"axial_motion"}), mesh_of(line, 1))
    (arms,) = (
        block
        for block in model.blocks
        if block.component == "steady_arms" and block.stiffness is not None
    )
    assert np.array_equal(arms.dofs[:, 0], model.dofs(model.mesh.steady_arms, "u"))
    expected = 4 * 22e3 * 0.2 / 55.0 / 1.22
    assert arms.stiffness is not None
    check("P / l [N/m]", arms.stiffness[:, 0, 0], expected, within=1e-10 * expected)
