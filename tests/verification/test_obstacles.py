"""Reflection and transmission measured from signals, against closed forms within 3 %."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check
from small_lines import (
    EN_CONTACT_WIRE,
    EN_MESSENGER_WIRE,
    WHOLE,
    ac_simple_line,
    mesh_of,
    problem_of,
)

from catenary.cases.studies.waves.obstacles import Result, as_rows, obstacles_of, result_of
from catenary.meshgen.line import SteadyArm
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.wires import Conductor
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.waves.reflection import answer_of, change_of_wire, scattered

pytestmark = pytest.mark.study

HZ = np.array([2.0, 10.0, 20.0])
OMEGA = 2 * np.pi * HZ
STRING = Conductor(20e3, 1.35, 0.0)
FREQUENCY = np.array([2.0, 5.0, 10.0, 15.0, 20.0])


def resistance(stiffness: float, mass: float) -> np.ndarray:
    return (stiffness - OMEGA**2 * mass)[:, None, None] + 0j


@pytest.mark.parametrize(("stiffness", "mass"), [(300.0, 0.0), (0.0, 1.0), (300.0, 0.64)])
def test_a_string_has_the_closed_form(stiffness: float, mass: float) -> None:
    d = resistance(stiffness, mass)
    back, onward = scattered((STRING,), OMEGA, d)
    z = np.sqrt(STRING.tension * STRING.mass_per_length)
    expected = -d[:, 0, 0] / (d[:, 0, 0] + 2j * OMEGA * z)
    np.testing.assert_allclose(back[:, 0, 0], expected, rtol=1e-12)
    np.testing.assert_allclose(onward, 1.0 + back, rtol=1e-12)


def test_one_kilogram_and_an_arm_on_the_wire_of_en50318() -> None:
    """Published for this wire with its bending: |R| of 1 kg and of 300 N/m at 2, 10 and 20 Hz."""
    for part, expected in (
        (resistance(0.0, 1.0), [0.038, 0.185, 0.341]),
        (resistance(300.0, 0.0), [0.073, 0.0145, 0.007]),
    ):
        back, _ = scattered((EN_CONTACT_WIRE,), OMEGA, part)
        check("|R|", np.abs(back[:, 0, 0]), expected, within=6e-4)


def test_a_stiff_dropper_shares_by_impedances() -> None:
    """Strings: Z_m / (Z_c + Z_m) back, Z_c / (Z_c + Z_m) onward on either wire."""
    pair = STRING, Conductor(16e3, 1.07, 0.0)
    stiff = np.broadcast_to(1e9 * np.array([[1.0, -1.0], [-1.0, 1.0]]), (3, 2, 2)) + 0j
    back, onward = scattered(pair, OMEGA, stiff)
    z_c, z_m = (np.sqrt(w.tension * w.mass_per_length) for w in pair)
    np.testing.assert_allclose(back[:, 0, 0], -z_m / (z_c + z_m), rtol=1e-4)
    np.testing.assert_allclose(onward[:, :, 0], z_c / (z_c + z_m), rtol=1e-4)


def test_no_energy_is_lost_at_obstacles_with_bending() -> None:
    """A wave of amplitude a carries w k (T + 2 EI k^2) |a|^2 / 2 along a wire."""
    pair = EN_CONTACT_WIRE, EN_MESSENGER_WIRE
    k = 1e5 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    d = k - (OMEGA**2)[:, None, None] * np.diag([0.2, 0.3]) + 0j
    back, onward = scattered(pair, OMEGA, d)
    flux = np.stack([-OMEGA / answer_of(one, OMEGA).wave.imag for one in pair])
    for i in (0, 1):
        out = np.einsum("jf,fj->f", flux, np.abs(back[:, :, i]) ** 2 + np.abs(onward[:, :, i]) ** 2)
        np.testing.assert_allclose(out / flux[i], 1.0, rtol=1e-12)
    returned, passed = change_of_wire(*pair, OMEGA)
    out = np.abs(returned) ** 2 + np.abs(passed) ** 2 * flux[1] / flux[0]
    np.testing.assert_allclose(out, 1.0, rtol=1e-12)
    # Nearly strings: (Z1 - Z2) / (Z1 + Z2) and 2 Z1 / (Z1 + Z2), to EI m w^2 / T^2 = 1e-2.
    z = [np.sqrt(w.tension * w.mass_per_length) for w in pair]
    np.testing.assert_allclose(returned[0], (z[0] - z[1]) / sum(z), rtol=1e-3)
    np.testing.assert_allclose(passed[0], 2 * z[0] / sum(z), rtol=1e-3)


def results(line: LineData) -> dict[str, Result]:
    problem = problem_of(line, WHOLE)
    rest = line_at_rest(problem, mesh_of(line, 2))
    found = [result_of(one, problem, FREQUENCY) for one in obstacles_of(rest)]
    return {one.name.split(" ")[0]: one for one in found}


def test_obstacles_of_a_line_send_back_what_theory_says() -> None:
    """Dropper with clamps, support, arm with mass and spring, change of wire, end, 2 to 20 Hz.

    The bench's elements of 0.2 m are twice sqrt(EI / T) long: what bends beside a stiff obstacle is
    wrong by a part of n, of which n / |g| = k / q = 0.1 at 20 Hz counts: 1 or 2 %.
    """
    arm = SteadyArm(1.22, 0.73, 0.2, 300.0)
    found = results(replace(ac_simple_line(5), steady_arm=arm, support_stiffness=5e4))
    assert set(found) == {"droppers", "supports", "steady_arms", "from", "end"}
    for name, one in found.items():
        check(f"{name}: error of shares", one.error.max(), 0.0, within=0.02)
    rows = as_rows([found["droppers"]])
    assert len(rows) == 4 * FREQUENCY.size
    assert {row["wave_on"] for row in rows} == {"contact_wire", "messenger_wire"}
    assert rows[0]["back"] == pytest.approx(rows[0]["back_theory"], rel=0.01)
    end = found["end"]
    np.testing.assert_allclose(end.back[0], -1.0, atol=1e-3)
    assert not end.onward.any()
