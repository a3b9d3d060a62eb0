"""Another temperature than that of the installation: ends that move, droppers that lean."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axial_lines import (
    ALONG,
    HANGING_ALONG,
    PotentialOfLine,
    elastic_line,
    elastic_wires,
    gradient_of,
    hessian_of,
    line_of_few_droppers,
)
from measuring import check, energies_of_free_motion, march, matrix_of
from scipy import optimize
from small_lines import mesh_of, problem_of, train

from catenary import InputError
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.ends import AlongTrack, Tensioner
from catenary.solver.statics.form_finding import find_form

ALPHA = 1.7e-5
EPS = np.finfo(float).eps


def at(line: LineData, along: AlongTrack, elements: int = 2) -> tuple[Model, Equilibrium]:
    return find_form(problem_of(line, HANGING_ALONG, along=along), mesh_of(line, elements))


def rigid_line(n_spans: int) -> LineData:
    """Wires that do not stretch; the messenger wire neither grows nor sags."""
    line = elastic_line(n_spans)
    assert line.messenger_wire is not None
    return replace(
        line,
        steady_arm=replace(line.steady_arm, stiffness=0.0),
        contact_wire=replace(line.contact_wire, axial_stiffness=1e12),
        messenger_wire=replace(
            line.messenger_wire, tension=1e7, axial_stiffness=1e12, expansion=0.0
        ),
    )


def test_tilting_droppers_take_tension_off_a_wire_that_grows() -> None:
    """Sum of N_i alpha dT x_i / l_i, which is q alpha dT L^2 / (2 l) of many equal droppers.

    The end moves by alpha dT L, and weights on a wheel of ratio 3 three times as far.
    """
    n, warmer = 8, 10.0
    model, form = at(rigid_line(n), AlongTrack(end=True, warmer=warmer))
    mesh = model.mesh
    upper, lower = mesh.droppers.T
    moved = ALPHA * warmer * mesh.x(lower)
    length = form.height[upper] - form.height[lower]
    expected = -(form.dropper_force * moved / np.hypot(length, moved)).sum()
    gained = form.gained_tension[CONTACT_WIRE]
    # The wire itself sags by (q a / T)^2 / 24 of its length between droppers, and by more, a share
    # of twice the loss of tension, where that is less.
    sag = (1.35 * 9.81 * 6.5 / 20e3) ** 2 / 12
    check("tension at the fixed end [N]", gained[0], expected, within=sag * 1e3 * -expected)
    # Round-off of strains, times 1e12 N.
    check("tension at the weights [N]", gained[-1], 0.0, within=1e-4)
    whole = 60.0 * n
    check("end [m]", form.along[mesh.wires[CONTACT_WIRE][-1]], ALPHA * warmer * whole, within=1e-5)
    weight = model.problem.line.wire(CONTACT_WIRE).mass_per_length * model.problem.gravity
    rough = -weight * ALPHA * warmer * whole**2 / 2 / length.mean()
    print(f"q alpha dT L^2 / (2 l) with the mean l: {rough:.1f} N")
    assert expected == pytest.approx(rough, rel=0.05)


def test_swinging_arms_take_tension_off_a_wire_in_a_curve() -> None:
    """T alpha dT L^2 n (n - 1) / (2 R l): each of the n - 1 arms swings by alpha dT x."""
    n, warmer, radius, arm = 12, 30.0, 1000.0, 1.2
    line = rigid_line(n)
    curved = replace(
        line,
        dropper_positions=((),) * n,
        pre_sag=((),) * n,
        stagger=tuple((60.0 * i) ** 2 / (2 * radius) for i in range(n + 1)),
        steady_arm=replace(line.steady_arm, length=arm),
        contact_wire=replace(line.contact_wire, mass_per_length=1e-6),
    )
    _, form = at(curved, AlongTrack(end=True, warmer=warmer), elements=4)
    expected = -20e3 * ALPHA * warmer * 60.0**2 * n * (n - 1) / (2 * radius * arm)
    found = form.gained_tension[CONTACT_WIRE][0]
    # The wire stretches by the loss over its length, a share of 1e-5 of what it grows.
    check("tension at the fixed end [N]", found, expected, within=1e-5 * -expected)


@pytest.mark.parametrize("warmer", [-40.0, 60.0])
def test_a_wire_between_fixed_ends_has_the_tension_of_the_cubic(warmer: float) -> None:
    """T^3 + (a - T0 + b dT) T^2 ...: T - (m g l)^2 EA / (24 T^2) = T0 - (m g l)^2 EA / (24 T0^2) -
    alpha EA dT of a parabola.

    The mean of z'^2 over the chord of a cable of n elements is that of the parabola but for a
    share of 1 / n^2, which cubic elements of a string without bending do not have.
    """
    line = elastic_wires(60.0)
    assert line.messenger_wire is not None
    wire = replace(line.messenger_wire, bending_stiffness=0.0)
    model, form = at(replace(line, messenger_wire=wire), AlongTrack(warmer=warmer), elements=8)
    assert wire.axial_stiffness is not None
    sag = (wire.mass_per_length * model.problem.gravity * 60.0) ** 2 * wire.axial_stiffness / 24

    def lacks(tension: float) -> float:
        given = wire.tension - sag / wire.tension**2 - ALPHA * wire.axial_stiffness * warmer
        return tension - sag / tension**2 - given

    expected = optimize.brentq(lacks, 100.0, 1e6)
    found = wire.tension + form.gained_tension[MESSENGER_WIRE]
    print(f"at the installation {wire.tension:g} N")
    check("tension [N]", found, expected, within=1e-8 * expected)


@pytest.mark.parametrize(
    ("warmer", "efficiency", "travel", "state"),
    [
        (2.0, 0.97, None, "stands"),
        (30.0, 0.97, None, "sinks"),
        (-30.0, 0.97, None, "rises"),
        (30.0, 1.0, None, "sinks"),
        (30.0, 0.97, 0.01, "down"),
        (-30.0, 1.0, 0.01, "up"),
    ],
)
def test_a_tensioner_keeps_the_tension_within_its_band(
    warmer: float, efficiency: float, travel: float | None, state: str
) -> None:
    """It stands in r W eta < T < r W / eta, turns at its edges, and ends at its stop.

    u / L = alpha dT + (T - T0) / EA - (m g L)^2 (1 / T^2 - 1 / T0^2) / 24 of a single wire.
    """
    line, length = elastic_wires(60.0), 60.0
    wire = replace(line.contact_wire, bending_stiffness=0.0)
    line = replace(line, contact_wire=wire)
    tensioner = Tensioner(efficiency=efficiency, travel=travel)
    model, form = at(line, AlongTrack(tensioner, end=True, warmer=warmer), elements=8)
    assert wire.axial_stiffness is not None
    tension = float(wire.tension + form.gained_tension[CONTACT_WIRE][-1])
    end = float(form.along[model.mesh.wires[CONTACT_WIRE][-1]])
    hung = (wire.mass_per_length * model.problem.gravity * length) ** 2 / 24
    strain = ALPHA * warmer + (tension - wire.tension) / wire.axial_stiffness
    strain -= hung * (1 / tension**2 - 1 / wire.tension**2)
    print(f"{state}: {tension:.1f} N of {wire.tension:g} N, end {1e3 * end:.2f} mm")
    check("end [m]", end, strain * length, within=1e-9)
    low, high = tensioner.band(CONTACT_WIRE, wire, model.problem.gravity)
    if state == "stands":
        assert low < tension < high and end == 0.0
    elif state in ("sinks", "rises"):
        check("tension [N]", tension, low if state == "sinks" else high, within=1e-5)
        assert np.sign(end) == np.sign(warmer)
    else:
        assert travel is not None
        check("stop [m]", abs(end), travel, within=1e-15)
        assert tension < low if state == "down" else tension > high
    held = np.isin(model.dofs(model.mesh.wires[CONTACT_WIRE][[-1]], "u"), model.constrained)
    assert held.all() == (state in ("down", "up"))


def test_rest_and_stiffness_at_a_temperature_are_those_of_the_potential_energy() -> None:
    """Against an energy written down by itself: its gradient is zero, its Hessian is K."""
    line = line_of_few_droppers()
    assert line.messenger_wire is not None
    line = replace(line, messenger_wire=replace(line.messenger_wire, expansion=0.0))
    problem = problem_of(line, HANGING_ALONG, along=AlongTrack(end=True, warmer=60.0))
    mesh = mesh_of(line, 1)
    _, installed = find_form(replace(problem, along=AlongTrack(end=True)), mesh)
    model, form = find_form(problem, mesh)
    lean = form.leaning(mesh.droppers)
    assert np.abs(lean).max() > 0.02
    every = np.arange(mesh.n_nodes)
    energy = PotentialOfLine(problem, mesh, installed)
    place = np.concatenate([form.height, form.slope, form.along])
    numbers = np.concatenate([model.dofs(every, name) for name in ("w", "theta_y", "u")])
    free = ~np.isin(numbers, model.constrained)
    # The weights pull with the tension of the installation.
    weights = np.zeros(numbers.size)
    for wire in problem.line.wires:
        weights[2 * every.size + mesh.wires[wire.name][-1]] = wire.tension
    check("force left [N]", (gradient_of(energy, place) - weights)[free], 0.0, within=1e-3)
    wanted = hessian_of(energy, place)[np.ix_(free, free)]
    found = matrix_of(model, stiffness=1.0).toarray()[np.ix_(numbers, numbers)][np.ix_(free, free)]
    check("stiffness", found, wanted, within=1e-8 * np.abs(wanted).max())


def line_that_leans() -> LineData:
    """Two spans whose messenger wire does not grow."""
    line = elastic_line(2)
    assert line.messenger_wire is not None
    return replace(line, messenger_wire=replace(line.messenger_wire, expansion=0.0))


def test_energy_stays_where_droppers_lean() -> None:
    line = line_that_leans()
    model, form = at(line, AlongTrack(end=True, warmer=50.0))
    assert form.leaning(model.mesh.droppers).any()
    assert model.droppers.direction.unknowns.shape[1] == 4
    struck = np.zeros(model.n_dofs)
    struck[model.dofs(model.mesh.droppers[4, 1])] = 1.0
    n_steps = 2000
    _, total = energies_of_free_motion(model, np.zeros_like(struck), struck, n_steps, 100)
    check("relative change", np.abs(total / total[0] - 1).max(), 0.0, within=40 * n_steps * EPS)


def test_a_march_starts_from_the_rest_at_its_temperature() -> None:
    """Without a train's force the line stays where it is, droppers as they lean."""
    line = line_that_leans()
    ours = train(70.0, 20.0, 30.0, static_force=0.0)
    problem = problem_of(
        line,
        ALONG - {"structural_damping"},
        along=AlongTrack(end=True, warmer=40.0),
        train=replace(ours, start_below=0.5),
    )
    history = march(problem, mesh_of(line, 2))
    _, form = at(line, AlongTrack(end=True, warmer=40.0))
    first = history["dropper_force"][0]
    check("dropper force [N]", history["dropper_force"], form.dropper_force, within=1e-6 * first)


def test_what_cannot_rest_is_refused_in_a_sentence() -> None:
    wires = elastic_wires(60.0)
    light = replace(wires, contact_wire=replace(wires.contact_wire, mass_per_length=1e-4))
    with pytest.raises(InputError, match="150 K above its installation"):
        at(light, AlongTrack(warmer=150.0))


def test_no_difference_is_no_effect() -> None:
    line = elastic_line(2)
    model, form = at(line, AlongTrack(end=True, warmer=0.0))
    assert "temperature" not in model.terms_of and not form.along.size and not form.gained_tension
