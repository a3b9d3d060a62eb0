"""What hard spots and worn stretches of a wire send back, of a pulse, against closed forms."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from measuring import check, line_alone, release, step
from small_lines import BARE, EN_CONTACT_WIRE, bare_wires, mesh_of, numerics, problem_of

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.meshgen.wires import worn_round
from catenary.solver.problem.defects import Defect, HardSpot, WornWire
from catenary.solver.statics.form_finding import find_form
from catenary.solver.waves.reflection import change_of_wire, scattered

HZ = np.array([2.0, 5.0, 10.0, 15.0, 20.0])
OMEGA = 2 * np.pi * HZ
LENGTH, START, GAUGE, PLACE, WIDTH = 300.0, 60.0, 100.0, 150.3, 2.0
DT, STEPS, BETWEEN = 1e-3, 1800, 750


def sent_back(*defects: Defect) -> np.ndarray:
    """|R| by the amplitudes that pass a gauge before and after, at OMEGA.

    The pulse passes the gauge after 0.33 s and comes back after 1.16 s, before anything else does.
    What leaves it backwards at the start, as a beam is no string, is that of a sound wire.
    """
    sound = seen_at_gauge(())
    back = seen_at_gauge(defects) - sound
    time = DT * np.arange(STEPS)
    waves = np.exp(-1j * np.outer(OMEGA, time))
    before = time < BETWEEN * DT
    return np.asarray(
        np.abs(waves[:, ~before] @ back[~before] / (waves[:, before] @ sound[before]))
    )


@functools.cache
def seen_at_gauge(defects: tuple[Defect, ...]) -> np.ndarray:
    """Displacement at the gauge after each step, (STEPS,)."""
    problem = problem_of(bare_wires(LENGTH), BARE | {"hard_spot", "worn_wire"}, defects=defects)
    model, _ = find_form(problem, mesh_of(problem.line, 600))
    nodes = model.mesh.wires[CONTACT_WIRE]
    w, theta = model.dofs(nodes), model.dofs(nodes, "theta_y")
    away = (model.contact_x - START) / WIDTH
    pulse = np.exp(-(away**2))
    slope = -2 * away / WIDTH * pulse
    bend = (4 * away**2 - 2) / WIDTH**2 * pulse
    displacement, velocity = np.zeros((2, model.n_dofs))
    displacement[w], displacement[theta] = pulse, slope
    speed = EN_CONTACT_WIRE.wave_speed
    velocity[w], velocity[theta] = -speed * slope, -speed * bend
    gauge = w[int(np.argmin(np.abs(model.contact_x - GAUGE)))]
    seen = np.zeros(STEPS)
    with line_alone(model, numerics(DT)) as line:
        release(line, displacement, velocity, model)
        for i in range(STEPS):
            step(line)
            seen[i] = line.displacement[gauge]
    return seen


@pytest.mark.parametrize(
    ("mass", "stiffness"), [(1.0, 0.0), (5.0, 0.0), (0.0, 5000.0), (2.0, 5000.0)]
)
def test_a_hard_spot_within_an_element(mass: float, stiffness: float) -> None:
    """R = -D / (D + 2 i w Z), with bending, D = K - w^2 M, at 0.6 of an element of 0.5 m.

    What an element's own functions lack of the wire's cusp at the place is 0.02 m of wire, some
    3e-2 of what a heavy obstacle sends back at 20 Hz, and less below.
    """
    found = sent_back(HardSpot(CONTACT_WIRE, PLACE, mass, stiffness))
    obstacle = (stiffness - OMEGA**2 * mass)[:, None, None] + 0j
    expected = np.abs(scattered((EN_CONTACT_WIRE,), OMEGA, obstacle)[0][:, 0, 0])
    check("|R|", found, expected, within=0.01 * expected + 2e-3)


@pytest.mark.parametrize("lost", [0.1, 0.3])
def test_the_begin_of_a_worn_stretch(lost: float) -> None:
    """(Z1 - Z2) / (Z1 + Z2) with Z = sqrt(F m), and with bending; at a node of the mesh. Within an
    element of 0.5 m, which then has the mean of both, 0.1 less is sent back at 20 Hz."""
    found = sent_back(WornWire(CONTACT_WIRE, 150.0, LENGTH, lost))
    left = np.sqrt(1.0 - lost)
    strings = (1 - left) / (1 + left)
    check("|R| of strings at 2 Hz", found[0], strings, within=0.01 * strings)
    worn = replace(
        EN_CONTACT_WIRE,
        mass_per_length=(1.0 - lost) * EN_CONTACT_WIRE.mass_per_length,
        bending_stiffness=worn_round(lost).bending * EN_CONTACT_WIRE.bending_stiffness,
    )
    returned, _ = change_of_wire(EN_CONTACT_WIRE, worn, OMEGA)
    check("|R|", found, np.abs(returned), within=1e-4)
