"""Remarks about contact settings that shape the results."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from catenary.postproc.evaluate.remarks import remarks


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
