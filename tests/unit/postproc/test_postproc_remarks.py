"""Error indicators, and remarks about contact settings that shape the results."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from measuring import check
from scipy import linalg

from catenary.postproc.evaluate.error_indicators import (
    LINE_MEMORY,
    NEAR_MEMORY,
    Method,
    as_table,
    indicate,
    memory,
    required_by_bending,
    required_frequency,
    resolved_frequency,
    step_error,
)
from catenary.postproc.evaluate.remarks import remarks
from catenary.postproc.read.results import Results
from catenary.solver.model import beam
from catenary.solver.problem.integrator_parameters import Integration, integration_of

# --- error indicators -----------------------------------------------------------------------------


UNDAMPED = Method(0.0, 0.0)


def tone(frequency: float, dt: float, seconds: float = 6.0) -> np.ndarray:
    """A force of amplitude 10 N on 100 N."""
    t = np.arange(round(seconds / dt)) * dt
    return 100.0 + 10.0 * np.sin(2.0 * np.pi * frequency * t)


@pytest.mark.parametrize("dt", [0.5e-3, 1e-3, 2e-3])
def test_a_single_tone_is_late_by_the_period_elongation_of_the_method(dt: float) -> None:
    """Period elongation (w dt)^2 / 12 of the average acceleration (Bathe, ch. 9), for T seconds.

    The window spreads the tone over 2 / 6 s: up to w^3 (1 +- 3 * 0.17 / 10), and half of that on
    average cancels; 2 % is allowed.
    """
    omega, total = 2.0 * np.pi * 10.0, LINE_MEMORY + NEAR_MEMORY
    phase = total * omega * (omega * dt) ** 2 / 12.0
    expected = np.sqrt(2.0) * 10.0 * np.sin(0.5 * phase)
    found = step_error(tone(10.0, dt), dt, UNDAMPED)
    check("rms error [N]", found, expected, within=0.02 * expected)


def test_a_long_record_is_wrong_by_as_much_as_a_short_one() -> None:
    """Of 15 minutes the spectrum is a mean over three stretches: the tone's lines are narrower."""
    dt = 1e-3
    omega, total = 2.0 * np.pi * 10.0, LINE_MEMORY + NEAR_MEMORY
    expected = np.sqrt(2.0) * 10.0 * np.sin(0.5 * total * omega * (omega * dt) ** 2 / 12.0)
    found = step_error(tone(10.0, dt, 900.0), dt, UNDAMPED)
    check("rms error [N]", found, expected, within=1e-4 * expected)


def test_numerical_damping_counts_to_the_first_order_of_the_step() -> None:
    """Damping ratio (gamma - 1/2) w dt / 2: halving the step halves the error."""
    damped = Method(0.0, 0.0, Integration(0.3025, 0.6))
    coarse = step_error(tone(5.0, 1e-3), 1e-3, damped)
    fine = step_error(tone(5.0, 0.5e-3), 0.5e-3, damped)
    expected = 10.0 / np.sqrt(2.0) * (LINE_MEMORY + NEAR_MEMORY)
    expected *= 0.1 * (2.0 * np.pi * 5.0) ** 2 * 0.5e-3 / 2.0
    # The window's spread, and what the period elongation adds: (0.025)^2 / 2 of it.
    check("rms error [N]", fine, expected, within=0.03 * expected)
    check("ratio", coarse / fine, 2.0, within=0.02)


def test_methods_that_damp_with_order_3_are_late_by_their_own_period_elongation() -> None:
    """HHT with a_f = 1/3: beta = 4/9, E = 2/9 - 1/24 - 1/18; damping ratio 1/54 (w dt)^3."""
    method, dt = Method(0.0, 0.0, integration_of("hht", 0.5)), 1e-3
    omega, total = 2.0 * np.pi * 10.0, LINE_MEMORY + NEAR_MEMORY
    x = omega * dt
    phase = total * omega * x**2 * np.hypot(2 / 9 - 1 / 24 - 1 / 18, x / 54)
    expected = np.sqrt(2.0) * 10.0 * np.sin(0.5 * phase)
    found = step_error(tone(10.0, dt), dt, method)
    check("rms error [N]", found, expected, within=0.02 * expected)


def test_no_error_without_fluctuation() -> None:
    assert step_error(np.full(500, 120.0), 1e-3, UNDAMPED) == 0.0


def test_damped_waves_are_forgotten_at_the_rate_at_which_they_decay() -> None:
    """A lightly damped oscillation decays with (beta + alpha w^2) / 2 (Rayleigh)."""
    omega = np.array([20.0, 60.0, 120.0])
    alpha, beta = 1e-4, 0.02
    rate = 0.5 * (beta + alpha * omega**2)
    expected = NEAR_MEMORY + 1.0 / (1.0 / LINE_MEMORY + rate)
    # The next term of the root is (alpha w)^2 = 1.4e-4 of the first.
    check("memory [s]", memory(omega, alpha, beta), expected, within=1e-3 * expected)


def test_a_heavily_damped_line_leaves_the_memory_of_what_is_near() -> None:
    assert memory(np.array([120.0]), 1.0, 0.0)[0] < 1.6 * NEAR_MEMORY


@pytest.mark.parametrize(("length", "stiffness"), [(1.0, 195.0), (1.3, 195.0), (2.0, 0.0)])
def test_resolved_waves_are_the_modes_that_a_hinged_wire_gets_right(
    length: float, stiffness: float
) -> None:
    """Modes of 60 elements between hinges, sin(j pi x / L): the last right one in ascending order.

    Neighbouring modes are c / 2 L apart, which is the resolution of this way to count.
    """
    n, tension, mass = 60, 20e3, 1.35
    total = n * length
    size = 2 * (n + 1)
    matrices = np.zeros((2, size, size))
    lengths = np.full(n, length)
    for which, parts in enumerate(
        (beam.stiffness(lengths, stiffness, tension), beam.mass(lengths, mass))
    ):
        for e in range(n):
            matrices[which, 2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += parts[e]
    free = np.setdiff1d(np.arange(size), [0, size - 2])
    k, m = (matrix[np.ix_(free, free)] for matrix in matrices)
    found = np.sqrt(linalg.eigh(k, m, eigvals_only=True))
    number = np.arange(1, found.size + 1) * np.pi / total
    exact = number * np.sqrt((tension + stiffness * number**2) / mass)
    wrong = np.abs(found / exact - 1.0) > 0.01
    wrong[n - 1] = False  # two elements a wave: only one of its two standing waves fits
    last = int(np.argmax(wrong)) - 1
    spacing = (exact[last + 1] - exact[last]) / (2.0 * np.pi)
    check(
        "resolved [Hz]",
        resolved_frequency(length, tension, stiffness, mass),
        exact[last] / (2.0 * np.pi),
        within=1.5 * spacing,
    )


def test_waves_ahead_of_the_train_are_shortened_by_its_motion() -> None:
    """Doppler: 20 Hz / (1 - v / c)."""
    check("required [Hz]", required_frequency(20.0, 0.6, 0.0), 50.0, within=1e-6)
    assert required_frequency(20.0, 1.0, 0.0) == np.inf


def test_waves_ahead_on_a_rail_are_shortened_by_its_bending() -> None:
    """A train at rest excites waves of the frequency that it feels; without tension k is the root
    of sqrt(EI / m) k^2 - v k - w_0 = 0 and the frequency w_0 + v k."""
    rail = {"tension": 1e-6, "bending_stiffness": 2.7e5, "mass_per_length": 7.1}
    check("required [Hz]", required_by_bending(20.0, 0.0, **rail), 20.0, within=1e-9)
    stiff, speed, own = np.sqrt(2.7e5 / 7.1), 120.0 / 3.6, 2.0 * np.pi * 20.0
    k = (speed + np.sqrt(speed**2 + 4.0 * stiff * own)) / (2.0 * stiff)
    expected = (own + speed * k) / (2.0 * np.pi)
    check("required [Hz]", required_by_bending(20.0, speed, **rail), expected, within=1e-9)
    # A string as slow as that has none at all.
    assert required_by_bending(20.0, speed, 100.0, 0.0, 7.1) == np.inf


def test_waves_on_a_damped_line_need_no_more_than_their_length() -> None:
    """The root itself: w - v Re k = w_0 and f = |k| c / 2 pi with k = (w / c) / sqrt(1 + i a w).

    On a heavily damped line at rest k tends to sqrt(w / a) / c.
    """
    alpha = 50.0
    own = 2.0 * np.pi * 20.0
    expected = np.sqrt(own / alpha) / (2.0 * np.pi)
    # The next term of the root is 1 / (4 (alpha w)^2) = 6e-9 of it.
    check("required [Hz]", required_frequency(20.0, 0.0, alpha), expected, within=1e-6 * expected)
    found = [required_frequency(20.0, 0.7, alpha) for alpha in (0.0, 1e-4, 1e-3, 1e-2, 1e-1)]
    assert sorted(found, reverse=True) == found


def test_finer_elements_resolve_more() -> None:
    """Without bending stiffness nothing but the element's length has a length: f ~ 1 / h."""
    coarse, fine = (resolved_frequency(h, 20e3, 0.0, 1.35) for h in (2.0, 1.0))
    check("ratio", fine / coarse, 2.0, within=1e-9)


def test_a_run_is_told_its_indicators(run_folder: Path) -> None:
    """The made-up record has 10 N at 9 Hz beside the span's frequency, steps of 1 ms."""
    with Results(run_folder) as results:
        found = indicate(results)
        table = as_table(found)
    # 20 Hz / (1 - 83.3 / 122.6)
    check("required [Hz]", found.required_frequency, 62.4, within=0.1)
    assert table["mesh"]["resolved_hz"] == found.resolved_frequency
    assert ((found.relative_error > 1e-4) & (found.relative_error < 0.05)).all()
    # Elements of 5/3 m, about half as many as 62 Hz need.
    assert [text.split()[1] for text in found.warnings] == ["longest"]
    assert list(found.warnings) == table["warnings"]


# --- remarks about contact settings that shape the results ----------------------------------------


class Told:
    """What remarks read of a result file."""

    def __init__(self, mass: float, dt: float, stiffness: float, **facts: float) -> None:
        self.attributes: dict[str, Any] = {}
        self.dt = dt
        self.facts: dict[str, Any] = {
            "shortest_step": dt,
            "fixed_iterations": np.nan,
            "step_tolerance": np.nan,
            "strongest_gust": np.nan,
            "periodic_start": 0.0,
            "periodic_end": 0.0,
            "stiffest_dropper": 1e5,
            "dropper_stiffness_damping": 0.0,
            "added_dropper_damping": 0.0,
            "touching_mass": np.full(2, mass),
            "contact_stiffness": np.full(2, stiffness),
        } | facts
        self.stops: dict[str, list[float]] = {}

    def has(self, name: str) -> bool:
        return False

    def extremes(self, name: str) -> np.ndarray:
        largest = self.stops.get(name, [])
        return np.array([[0.0] * len(largest), largest])

    def line(self, name: str) -> np.ndarray:
        return np.array({"end_x": [0.0, 550.0, 1100.0]}[name])

    def fact(self, name: str) -> float:
        return float(self.facts[name])

    def facts_of(self, name: str) -> np.ndarray:
        return np.asarray(self.facts[name])


def said(mass: float, dt: float, stiffness: float, **facts: float) -> list[str]:
    return remarks(Told(mass, dt, stiffness, **facts))  # type: ignore[arg-type]


def test_a_resonance_that_the_filter_lets_pass_is_told_once() -> None:
    """sqrt(5e4 / 7.2) / 2 pi = 13.3 Hz."""
    (sentence,) = said(7.2, 1e-3, 5e4)
    assert "7.2 kg" in sentence and "13.3 Hz" in sentence and "inside the 20 Hz band" in sentence
    # Of a Hertzian contact the scene has another key, and a stiffness under the static force.
    assert "stiffness of the contact" in sentence and "_N_per_m" not in sentence
    # Four times as stiff, 26.5 Hz: its flank still shows below 20 Hz.
    (sentence,) = said(7.2, 1e-3, 2e5)
    assert "26.5 Hz, near the 20 Hz band" in sentence


def test_a_contact_between_both_limits_needs_no_remark() -> None:
    """59 Hz, and 0.37 rad a step."""
    assert said(7.2, 1e-3, 1e6) == []


def test_hops_that_a_step_does_not_resolve_are_told() -> None:
    """188 Hz and 1.2 rad in a step of 1 ms, 0.12 rad in 0.1 ms."""
    (sentence,) = said(7.2, 1e-3, 1e7)
    assert "does not resolve its hops" in sentence
    assert said(7.2, 1e-4, 1e7) == []


def test_the_shortest_step_is_the_one_that_resolves_hops() -> None:
    assert said(7.2, 1e-3, 1e7, shortest_step=1e-4) == []


def test_kinematic_contact_says_that_nothing_can_be_lost() -> None:
    (sentence,) = said(7.2, 1e-3, np.inf)
    assert "loss cannot occur" in sentence


def test_droppers_that_are_stiff_for_the_step_are_told() -> None:
    """1e8 N/m times (1 ms)^2 is far above the limit, whose step is sqrt(0.22 / 1e8) s = 0.047 ms.

    Droppers damped by a step do not ring; the line's own 1e-4 s is too little.
    """
    (sentence,) = said(7.2, 1e-3, 1e6, stiffest_dropper=1e8, dropper_stiffness_damping=1e-4)
    assert "100000 kN/m" in sentence and "0.047 ms" in sentence
    assert "effects.stiff_link_damping" in sentence
    assert said(7.2, 1e-3, 1e6, stiffest_dropper=1e8, dropper_stiffness_damping=1e-3) == []
    assert said(7.2, 1e-3, 1e6, stiffest_dropper=2e5) == []


def test_numerical_damping_of_stiff_droppers_is_told() -> None:
    damped = {"dropper_stiffness_damping": 1e-3, "added_dropper_damping": 9e-4}
    (sentence,) = said(7.2, 1e-3, 1e6, stiffest_dropper=1e8, **damped)
    assert "numerical damping of alpha = 0.9 ms" in sentence and "0.047 ms" in sentence


def test_steps_that_went_on_above_the_tolerances_are_told() -> None:
    """Only where the scene says how many iterations there are: otherwise the run ends there."""
    told = Told(7.2, 1e-3, 1e6)
    told.attributes["inner_iterations"] = {"steps": 900, "unconverged_steps": 7}
    assert remarks(told) == []  # type: ignore[arg-type]
    told.facts["fixed_iterations"] = 2.0
    (sentence,) = remarks(told)  # type: ignore[arg-type]
    assert "7 of 900 steps" in sentence and "numerics.iterations = 2 " in sentence
    told.attributes["inner_iterations"] = {"steps": 900, "unconverged_steps": 0}
    assert remarks(told) == []  # type: ignore[arg-type]


def test_steps_above_their_tolerance_are_told() -> None:
    told = Told(7.2, 1e-3, 1e6, step_tolerance=0.5)
    told.attributes["inner_iterations"] = {"steps": 900, "steps_above_tolerance": 7}
    (sentence,) = remarks(told)  # type: ignore[arg-type]
    assert "7 of 900 steps" in sentence and "numerics.adaptive_tolerance_N = 0.5," in sentence


def test_tensioners_that_met_a_stop_are_told() -> None:
    told = Told(7.2, 1e-3, 1e6)
    told.stops = {"tensioner_low_stop": [0.0, 0.0, 0.0], "tensioner_high_stop": [0.0, 0.0, 0.0]}
    assert remarks(told) == []  # type: ignore[arg-type]
    told.stops["tensioner_low_stop"] = [900.0, 0.0, 1234.0]
    (sentence,) = remarks(told)  # type: ignore[arg-type]
    assert "2 tensioners met a stop, the one at 1100 m with 1.23 kN the most" in sentence
    told.stops["tensioner_low_stop"] = [np.nan, np.nan, np.nan]
    assert remarks(told) == []  # type: ignore[arg-type]


def test_files_without_facts_have_no_remarks() -> None:
    told = Told(7.2, 1e-3, 1e7)
    told.facts = {name: value * np.nan for name, value in told.facts.items()}
    assert remarks(told) == []  # type: ignore[arg-type]


class Running(Told):
    """A run at 50 m/s from 100 m on, another pantograph 30 m behind; 150 to 200 m evaluated."""

    evaluation = (150.0, 200.0)
    time = 0.01 * np.arange(401)

    def __init__(self, *incidents: dict[str, Any]) -> None:
        super().__init__(7.2, 1e-3, 1e6)
        self.attributes["incidents"] = list(incidents)

    def blocks(self, name: str) -> Iterator[tuple[slice, np.ndarray]]:
        assert name == "contact_position"
        position = 100.0 + 50.0 * self.time[:, None] - np.array([0.0, 30.0])
        for start in range(0, 401, 50):
            part = slice(start, min(start + 50, 401))
            yield part, position[part]

    def time_at(self, row: int) -> float:
        return float(self.time[row])


def test_incidents_that_the_statistics_cover_are_told() -> None:
    """The trailing pantograph leaves the stretch at (200 + 30 - 100) / 50 = 2.6 s."""
    early, late = {"time_s": 2.59, "says": "it breaks"}, {"time_s": 2.61, "says": "it falls"}
    (sentence,) = remarks(Running(early, late))  # type: ignore[arg-type]
    assert sentence.startswith("At 2.59 s it breaks. ") and "statistics" in sentence
    assert remarks(Running(late)) == []  # type: ignore[arg-type]


def test_strong_gusts_of_linear_drag_are_told() -> None:
    """(U + g)^2 in place of U^2 + 2 U g: g^2 of it are left out, 25 % for g = U, 11 % for U / 2."""
    (sentence,) = said(7.2, 1e-3, 1e6, strongest_gust=1.0)
    assert "25 % of the load" in sentence and "quadratic" in sentence
    assert said(7.2, 1e-3, 1e6, strongest_gust=0.5) == []


class Ended(Told):
    """Four spans of 50 m that go on beyond both ends, with droppers 10 and 40 m into each."""

    evaluation = (60.0, 140.0)

    def __init__(self, *slack: float) -> None:
        ends = {"periodic_start": 1.0, "periodic_end": 1.0}
        super().__init__(7.2, 1e-3, 1e6, slack_stiffness_share=0.0, **ends)
        self._x = np.arange(4).repeat(2) * 50.0 + np.tile([10.0, 40.0], 4)
        self._lowest = np.where(np.isin(self._x, slack), 0.0, 5.0)

    def line(self, name: str) -> np.ndarray:
        return {"support_x": 50.0 * np.arange(5), "dropper_x": self._x}[name]

    def extremes(self, name: str) -> np.ndarray:
        if name != "dropper_force":
            return super().extremes(name)
        return np.array([self._lowest, self._lowest + 50.0])


def test_droppers_that_slacken_at_a_periodic_end_of_the_stretch_are_told() -> None:
    """Those beyond do not slacken; of spans outside of the stretch nothing is judged."""
    told = Ended(90.0, 160.0, 190.0)
    assert remarks(told) == []  # type: ignore[arg-type]
    told.evaluation = (60.0, 170.0)
    (sentence,) = remarks(told)  # type: ignore[arg-type]
    assert sentence.startswith("2 droppers of the span at the periodic end of the line slackened")
    assert "evaluation.to_m of 150 at most" in sentence
    told.facts["periodic_end"] = 0.0
    assert remarks(told) == []  # type: ignore[arg-type]
    early = Ended(10.0)
    early.evaluation = (40.0, 140.0)
    (sentence,) = remarks(early)  # type: ignore[arg-type]
    assert "1 droppers" not in sentence and "evaluation.from_m of 50 at least" in sentence
    early.facts["slack_stiffness_share"] = 1.0
    assert remarks(early) == []  # type: ignore[arg-type]
