"""Waves on a tensioned beam: omega^2 = (T k^2 + EI k^4) / rho, long ones at c = sqrt(T / rho)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check, line_alone, release, step
from small_lines import BARE, EN_CONTACT_WIRE, bare_wires, mesh_of, numerics, problem_of

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.effects.build_model import build
from catenary.solver.model.model import Model


def wire_model(length: float, n_elements: int, bending_stiffness: float) -> Model:
    wire = replace(EN_CONTACT_WIRE, bending_stiffness=bending_stiffness)
    line = bare_wires(length, contact_wire=wire)
    return build(problem_of(line, BARE), mesh_of(line, n_elements), np.zeros(0))


def test_standing_waves_oscillate_by_the_dispersion_relation() -> None:
    """Waves of 40 to 2 m on a wire whose bending matters for the short ones.

    A step of average acceleration turns a mode by phi with tan(phi / 2) = omega dt / 2, so that
    omega follows from three states in a row, cos(phi) = (w_+ + w_-) / (2 w), free of the error of
    the time step. What is left is the error of the elements, half of
    ((k h)^6 / 30240 + s (k h)^4 / 720) / (1 + s), s = EI k^2 / T, for omega.
    """
    length, n_elements, dt = 40.0, 160, 1e-3
    bending = EN_CONTACT_WIRE.tension * 0.5**2
    model = wire_model(length, n_elements, bending)
    nodes = model.mesh.wires[CONTACT_WIRE]
    w, theta = model.dofs(nodes), model.dofs(nodes, "theta_y")
    tension, density = EN_CONTACT_WIRE.tension, EN_CONTACT_WIRE.mass_per_length
    with line_alone(model, numerics(dt)) as line:
        for half_waves in (2, 5, 10, 20, 40):
            k = half_waves * np.pi / length
            shape = np.zeros(model.n_dofs)
            shape[w], shape[theta] = np.sin(k * model.contact_x), k * np.cos(k * model.contact_x)
            release(line, shape, np.zeros_like(shape), model)
            amplitude = []
            for _ in range(400):
                amplitude.append(line.displacement[w] @ np.sin(k * model.contact_x))
                step(line)
            a = np.array(amplitude)
            cosine = (a[2:] + a[:-2]) @ a[1:-1] / (2 * a[1:-1] @ a[1:-1])
            omega = 2 / dt * np.tan(np.arccos(cosine) / 2)
            expected = np.sqrt((tension * k**2 + bending * k**4) / density)
            kh, s = k * length / n_elements, bending * k**2 / tension
            element = ((kh**6 / 30240 + s * kh**4 / 720) / (1 + s)) / 2
            # The interpolated sine is not the discrete mode: it contains other ones by as much as
            # the elements' error, which enters squared. Round-off: sums of 400 states, and acos
            # close to one, eps / phi^2.
            round_off = 400 * np.finfo(float).eps / (omega * dt) ** 2
            check(
                f"wave of {2 * length / half_waves:g} m, s = {s:.3f}: omega [1/s]",
                omega,
                expected,
                within=expected * (element + round_off),
            )


@pytest.mark.parametrize("rounding", [0.0, 0.5], ids=["string", "beam"])
def test_a_pulse_arrives_at_two_stations_at_the_wave_speed(rounding: float) -> None:
    """The centre of gravity in time of what passes a station moves at the speed of long waves.

    It depends only on d(omega)/dk at k = 0. There dispersion by bending, by the elements and by
    the time step vanishes, as all of them are even in k: the centre arrives exactly on time.
    """
    length, n_elements, dt, width = 400.0, 1600, 1e-3, 4.0
    tension = EN_CONTACT_WIRE.tension
    model = wire_model(length, n_elements, tension * rounding**2)
    nodes = model.mesh.wires[CONTACT_WIRE]
    w, theta = model.dofs(nodes), model.dofs(nodes, "theta_y")
    x = model.contact_x
    speed = EN_CONTACT_WIRE.wave_speed
    start, stations, duration = 150.0, (190.0, 220.0), 0.95

    def gauss(x: np.ndarray, derivative: int) -> np.ndarray:
        u = (x - start) / width
        factors = (1.0, -u / width, (u**2 - 1) / width**2)
        return factors[derivative] * np.exp(-0.5 * u**2)

    # A pulse that runs to the right: w(x - c t), so that its velocity is -c w'.
    displacement, velocity = np.zeros(model.n_dofs), np.zeros(model.n_dofs)
    displacement[w], displacement[theta] = gauss(x, 0), gauss(x, 1)
    velocity[w], velocity[theta] = -speed * gauss(x, 1), -speed * gauss(x, 2)
    rows = [w[np.argmin(np.abs(x - station))] for station in stations]
    time, passed = [], []
    with line_alone(model, numerics(dt)) as line:
        release(line, displacement, velocity, model)
        while not time or time[-1] < duration:
            time.append(len(time) * dt)
            passed.append(line.displacement[rows].copy())
            step(line)
    t, signal = np.array(time), np.array(passed)
    arrival = (t @ signal) / signal.sum(axis=0)
    found = (stations[1] - stations[0]) / (arrival[1] - arrival[0])
    # Before and after the run the pulse is 10 widths away from the stations, exp(-50). Waves so
    # short that they come back from the ends in time, faster than 2 c or k > 7 / width, are
    # exp(-24) of the pulse. The rest is round-off of 950 states, weighed by their time.
    within = speed * (np.exp(-24) + 950 * np.finfo(float).eps)
    check("wave speed [m/s]", found, speed, within=within)
