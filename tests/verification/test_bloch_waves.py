"""Waves of periodic lines against closed forms and against figures found by other means."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from scenes import load_scene, mesh_of, problem_of
from studies import few

from catenary import InputError
from catenary.cases.studies.waves.theory import WaveTheory, wave_theory
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.waves import bloch
from catenary.solver.waves.bloch import Period, bloch_waves, period_of

TENSION, MASS, LENGTH = 10e3, 1.0, 50.0


def string(lumped: float, n: int = 200) -> Period:
    """A string of n elements a period with a lumped mass [kg] at the start of each period."""
    h = LENGTH / n
    stiffness, mass = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    for e in range(n):
        at = np.ix_([e, e + 1], [e, e + 1])
        stiffness[at] += TENSION / h * np.array([[1.0, -1.0], [-1.0, 1.0]])
        mass[at] += MASS * h / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    parts = []
    for matrix in (stiffness, mass):
        own, joined = matrix[:n, :n].copy(), np.zeros((n, n))
        own[0, 0] += matrix[n, n]
        joined[n - 1, 0] = matrix[n - 1, n]
        parts += [own, joined]
    parts[2][0, 0] += lumped
    k, k_next, m, m_next = parts
    return Period(LENGTH, k, m, k_next, m_next, np.arange(n), h * np.arange(n))


def test_a_string_passes_everything_at_its_wave_speed() -> None:
    waves = bloch_waves(string(0.0), 8.0)
    # Linear elements: frequencies are too high by (k h)^2 / 24, 1e-3 at 8 Hz.
    speed = np.abs(waves.group_velocity[1:-1])
    print(f"group velocity: {speed.min():.3f} to {speed.max():.3f} m/s, string {100.0:.3f}")
    np.testing.assert_allclose(speed, 100.0, rtol=4e-3)
    bands = waves.pass_bands(8.0)
    # Branches meet where one ends and the next begins: it is one band.
    assert bands.shape == (1, 2) and bands[0] == pytest.approx((0.0, 8.0), abs=1.1)


@pytest.mark.parametrize("lumped", [1.0, 10.0])
def test_a_string_with_masses_has_the_bands_of_the_closed_form(lumped: float) -> None:
    """cos q = cos kL - (m omega^2 / (2 T k)) sin kL (Brillouin's chain of a loaded string)."""
    waves = bloch_waves(string(lumped), 8.0)
    omega = 2 * np.pi * waves.frequency
    k = omega * np.sqrt(MASS / TENSION)
    with np.errstate(invalid="ignore", divide="ignore"):
        right = np.cos(k * LENGTH) - lumped * omega**2 / (2 * TENSION * k) * np.sin(k * LENGTH)
    error = np.abs(right - np.cos(waves.phase)[:, None])[:, 1:]
    print(f"largest error of cos q: {error.max():.2e}")
    # Frequencies are wrong by (k h)^2 / 24 = 7e-4 at 8 Hz; d cos q / d omega is some L / c there,
    # 0.5 s, times a factor of (1 + m omega / (2 T k) omega), 13 for 10 kg.
    assert error.max() < 0.5 * 7e-4 * 50.0 * (1.0 + lumped * 50.0 / (2 * 100.0)) * 1.5


@pytest.mark.study
def test_group_velocities_are_slopes_of_the_branches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bloch, "N_PHASES", 401)
    waves = bloch_waves(string(10.0), 8.0)
    step = waves.phase[1] - waves.phase[0]
    slope = np.gradient(2 * np.pi * waves.frequency, step, axis=0)[2:-2] * LENGTH
    # Central differences: error of step^2 / 6 times the third derivative, largest near the ends.
    np.testing.assert_allclose(waves.group_velocity[2:-2], slope, atol=0.15)


# Pass bands [Hz] that another program found for these lines, on a grid of 0.05 Hz, by sending
# waves of one frequency each through ten spans; and its greatest group velocity [m/s] near [Hz].
BANDS = {
    "en50318_2002": [
        (0.84, 1.02), (1.68, 2.04), (2.56, 3.05), (3.45, 4.10), (4.35, 5.10), (7.15, 7.90),
        (8.15, 8.70),
    ],
    "ambrosio2012": [(1.04, 1.22), (2.06, 2.42), (3.10, 3.65), (4.10, 4.85), (5.15, 6.00)],
    "ac_simple": [(0.94, 1.12), (1.86, 2.24), (2.80, 3.40), (3.80, 4.50), (4.75, 5.60)],
}  # fmt: skip
REFLECTION = {"en50318_2002": 0.443, "ambrosio2012": 0.361, "ac_simple": 0.433}


@functools.cache
def rest_of(case: str) -> tuple[WaveTheory, LineAtRest]:
    scene = load_scene(case, [], False)
    problem = problem_of(scene)
    rest = line_at_rest(problem, mesh_of(scene))
    return wave_theory(problem, rest), rest


@pytest.mark.parametrize("case", few(BANDS, "ambrosio2012"))
def test_bands_of_the_shipped_lines_are_those_of_another_program(case: str) -> None:
    theory, _ = rest_of(case)
    found = theory.bands()
    for low, high in BANDS[case]:
        nearest = found[np.abs(found.mean(axis=1) - 0.5 * (low + high)).argmin()]
        print(f"{case}: {low:.2f}-{high:.2f} Hz, found {nearest[0]:.3f}-{nearest[1]:.3f}")
        assert nearest == pytest.approx((low, high), abs=0.055)
    assert theory.reflection == pytest.approx(REFLECTION[case], abs=5e-4)


@pytest.mark.study
def test_the_fastest_waves_of_en50318_2002() -> None:
    """114 m/s near 6 Hz and 116 m/s near 18 Hz by the same program; and what outruns 250 km/h."""
    theory, _ = rest_of("en50318_2002")
    assert theory.bloch is not None
    for highest, speed, near in ((10.0, 114.0, 6.0), (20.0, 116.0, 18.0)):
        found, at = theory.bloch.fastest(highest)
        print(f"up to {highest:g} Hz: {found:.1f} m/s at {at:.2f} Hz, expected {speed:g}, {near:g}")
        assert found == pytest.approx(speed, abs=0.6) and at == pytest.approx(near, abs=0.25)
    outrun = theory.outrunning()
    # Only waves of 2.6 to 8.7 Hz and of 13 to 20 Hz do.
    assert outrun[0, 0] == pytest.approx(2.6, abs=0.1)
    inside = outrun[(outrun[:, 0] < 8.7)]
    assert inside[-1, 1] == pytest.approx(8.6, abs=0.15)
    assert not ((outrun[:, 0] < 12.5) & (outrun[:, 1] > 8.8)).any()
    # gamma = r / alpha of the literature at 250 km/h.
    assert theory.amplification == pytest.approx(1.62, abs=0.01)


def test_what_outruns_the_train_travels_at_all() -> None:
    """Narrow stop bands, such as 6.10 to 6.12 Hz, lie in no range of frequencies that outrun."""
    theory, _ = rest_of("en50318_2002")
    bands = theory.bands()
    stops = np.column_stack([bands[:-1, 1], bands[1:, 0]])
    for low, high in theory.outrunning():
        assert ((stops[:, 1] <= low + 1e-9) | (stops[:, 0] >= high - 1e-9)).all(), (low, high)


def test_spans_that_differ_are_refused() -> None:
    _, rest = rest_of("en50318_2002")
    masts = rest.problem.line.support_positions
    with pytest.raises(InputError, match="alike"):
        period_of(rest.model, masts[0] + 0.0, masts[1])
