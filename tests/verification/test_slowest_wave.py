"""Slowest waves of wires on supports: closed forms, pass bands, and a load that moves as fast."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from measuring import check
from scenes import line_of, load_scene, mesh_of, problem_of, shipped

from catenary import InputError
from catenary.meshgen.slowest_wave import slowest_phase_speed, slowest_wave, supported_wave
from catenary.meshgen.wires import Role
from catenary.solver.statics.elasticity import elasticity, middle_span
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.waves.bloch import bloch_waves, period_of

RAIL = "conductor_rail"
TENSION, BENDING, MASS, SPAN, STIFFNESS, CLAMP = 100.0, 2.7e5, 7.1, 8.5, 6e5, 7.0
ORDERS = np.arange(-10, 11)


@functools.cache
def rail_at_rest() -> LineAtRest:
    scene = load_scene(RAIL, [], True)
    return line_at_rest(problem_of(scene), mesh_of(scene))


def alone(k: np.ndarray) -> np.ndarray:
    """omega^2 of the rail without supports."""
    return k**2 * (TENSION + BENDING * k**2) / MASS


@pytest.mark.parametrize("stiffness", [1e2, 1e4, 1e6])
def test_a_string_on_supports_has_its_own_speed(stiffness: float) -> None:
    """The wave as long as two spans has its nodes at the supports: sqrt(T / m) exactly."""
    found = supported_wave(10e3, 0.0, 0.95, 30.0, stiffness)
    check("slowest wave [m/s]", found, np.sqrt(10e3 / 0.95), within=1e-7)


def test_shipped_lines_of_strings_have_the_speed_of_the_standard() -> None:
    for case in shipped():
        line = line_of(load_scene(case))
        strings = min(wire.wave_speed for wire in line.wires_of(Role.CONTACT))
        if case != RAIL:
            assert slowest_wave(line) == strings, case
        else:
            check("rail, wave of a string [m/s]", strings, 3.753, within=1e-3)
            assert slowest_wave(line) > 60.0


def test_on_soft_supports_it_is_that_of_an_elastic_foundation() -> None:
    """sqrt(T / m + 2 sqrt(k EI / L) / m), for waves that are long beside a span.

    With k L = 0.69 the wavenumbers that supports couple, at 2 pi / L and beyond, give way by
    2 zeta(4) (0.69 / 2 pi)^4 = 3e-4 more: a quarter of that in the speed; phases every pi / 256
    are off by (pi / 512 / 0.69)^2 = 8e-5 at most.
    """
    soft = 100.0
    expected = np.sqrt((TENSION + 2.0 * np.sqrt(soft / SPAN * BENDING)) / MASS)
    found = supported_wave(TENSION, BENDING, MASS, SPAN, soft)
    check("slowest wave [m/s]", found, expected, within=2e-4 * expected)


def test_on_rigid_supports_it_is_that_of_the_three_moment_equation() -> None:
    """cos q = -(coth b - cot b) / (csc b - csch b), omega = b^2 sqrt(EI / m) / L^2, b from pi.

    The phases are dense enough for 1e-5; ten orders of wavenumber on both sides leave out
    1 / (2 pi 10)^4 of the shape.
    """
    b = np.linspace(np.pi, 4.730, 20001)[1:-1]
    cosine = -(1 / np.tanh(b) - 1 / np.tan(b)) / (1 / np.sin(b) - 1 / np.sinh(b))
    inside = np.abs(cosine) <= 1.0
    k = (2 * np.pi - np.arccos(cosine[inside])) / SPAN
    speed = (b[inside] / SPAN) ** 2 * np.sqrt(BENDING / MASS) / k
    lower = np.flatnonzero((speed[1:-1] < speed[:-2]) & (speed[1:-1] < speed[2:])) + 1
    found = supported_wave(1e-6, BENDING, MASS, SPAN, 1e11)
    check("slowest wave [m/s]", found, speed[lower].min(), within=1e-3)
    check("share of (pi / L) sqrt(EI / m)", found / (np.pi / SPAN * np.sqrt(BENDING / MASS)),
          0.923, within=1e-3)  # fmt: skip


def test_the_rail_has_the_slowest_wave_of_its_pass_bands() -> None:
    """Of the periodic line that the program marches; phases every pi / 48 are off by 1e-4."""
    rest = rail_at_rest()
    line = rest.model.problem.line
    waves = bloch_waves(period_of(rest.model, *middle_span(line)), 20.0)
    found = slowest_wave(line)
    print(f"pass bands [Hz]: {waves.pass_bands(20.0).round(2).tolist()}")
    branch = 2 * np.pi * waves.frequency[:, 0]
    expected = slowest_phase_speed(waves.phase, branch, waves.length)
    check("slowest wave [m/s]", found, expected, within=2e-4 * found)


def support_motion(speed: float) -> float:
    """Root of the integral of |w|^2 of a support over frequency, under a unit force that moves
    along an endless rail (L. Jezequel, J. Appl. Mech. 48, 1981):

    w = g(omega / v) / v / (1 + D / L sum_n g(omega / v + 2 pi n / L)), g = 1 / (T k^2 + EI k^4 -
    m omega^2), D = k_s - m_s omega^2, with the line's damping in both.
    """
    omega = np.arange(0.5, 90.0, 0.02)
    k = omega[:, None] / speed + 2 * np.pi * ORDERS / SPAN
    damped, inert = 1.0 + 1e-4j * omega, omega**2 - 0.0125j * omega
    g = 1.0 / (MASS * (alone(k) * damped[:, None] - inert[:, None]))
    support = STIFFNESS * damped - CLAMP * inert
    w = g[:, ORDERS.size // 2] / speed / (1.0 + support / SPAN * g.sum(axis=1))
    return float(np.sqrt((np.abs(w) ** 2).sum()))


def test_a_load_that_moves_as_fast_as_the_slowest_wave_moves_the_rail_most() -> None:
    """And not at sqrt(2 sqrt(k EI / L) / m) = 197 m/s, where waves would be 8.8 m long, about a
    span: no elastic foundation has supports as far apart as that.

    The first speed at which the support moves more than at all around is looked for. Speeds are
    0.25 m/s apart; damping of 0.04 1/s widens the peak by less.
    """
    expected = slowest_wave(rail_at_rest().model.problem.line)
    speeds = np.arange(50.0, 72.0, 0.25)
    motion = np.array([support_motion(speed) for speed in speeds.tolist()])
    check("speed of most motion [m/s]", speeds[motion.argmax()], expected, within=0.5)
    assert support_motion(50.0) < 0.5 * motion.max() and support_motion(197.0) < 0.2 * motion.max()


def test_the_elasticity_of_the_rail_has_its_closed_form() -> None:
    """A mean over phases q of the answer of all wavenumbers less that of the supports:

    e(x) = mean_q [G_q(0) - |G_q(x)|^2 / (1 / k_s + G_q(0))], G_q(x) = sum_n exp(i k_n x) / (T k^2
    + EI k^4) / L. Beam elements are exact at their nodes but for the tension, 1e-4 of what bending
    adds; the line's ends are 14 spans away, of which each leaves a fifth.
    """
    rest = rail_at_rest()
    start, end = middle_span(rest.model.problem.line)
    found = elasticity(rest.model, start, end)
    orders, n = np.arange(-300, 301), 400
    q = (np.arange(n) + 0.5) * 2 * np.pi / n
    k = (q[:, None] + 2 * np.pi * orders) / SPAN
    g = 1.0 / (MASS * SPAN * alone(k))
    own = g.sum(axis=1)
    expected = []
    for x in (found.x - start).tolist():
        across = np.abs((g * np.exp(1j * k * x)).sum(axis=1)) ** 2
        expected.append(float((own - across / (1.0 / STIFFNESS + own)).mean()))
    largest = max(expected)
    print(f"elasticity: {1e6 * min(expected):.3f} to {1e6 * largest:.3f} um/N")
    check("elasticity [m/N]", found.compliance[:, 0, 0], expected, within=2e-4 * largest)


def test_speeds_of_a_rail_are_refused_by_its_slowest_wave() -> None:
    load_scene(RAIL, ["train.speed_km_h=237"])
    with pytest.raises(InputError, match=r"contact wire \(237\.7 km/h, which bending_stiffness"):
        load_scene(RAIL, ["train.speed_km_h=238"])
    # Its tension carries nothing.
    load_scene(RAIL, ['incidents=[{type="tension_loss", at_s=1, wire="contact_wire", share=0.1}]'])
