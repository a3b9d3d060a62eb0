"""Remarks about contact settings that shape the results."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from catenary.postproc.evaluate.remarks import remarks


class Told:
    """What remarks read of a result file."""

    def __init__(self, mass: float, dt: float, **contact: Any) -> None:
        self.attributes = {
            "config": {"contact": contact, "numerics": {"dt_s": dt}},
            "pantographs": [{"touching_mass_kg": mass, "static_force_N": 120.0}] * 2,
        }


def said(mass: float, dt: float, **contact: Any) -> list[str]:
    return remarks(Told(mass, dt, **contact))  # type: ignore[arg-type]


def test_a_resonance_that_the_filter_lets_pass_is_told_once() -> None:
    """sqrt(5e4 / 7.2) / 2 pi = 13.3 Hz."""
    (sentence,) = said(7.2, 1e-3, law="linear", stiffness_N_per_m=5e4)
    assert "7.2 kg" in sentence and "13.3 Hz" in sentence and "below 20 Hz feel" in sentence


def test_a_contact_between_both_limits_needs_no_remark() -> None:
    """59 Hz, and 0.37 rad a step."""
    assert said(7.2, 1e-3, law="linear", stiffness_N_per_m=1e6) == []


def test_hops_that_a_step_does_not_resolve_are_told() -> None:
    """188 Hz and 1.2 rad in a step of 1 ms, 0.12 rad in 0.1 ms."""
    (sentence,) = said(7.2, 1e-3, law="linear", stiffness_N_per_m=1e7)
    assert "does not resolve the hops" in sentence
    assert said(7.2, 1e-4, law="linear", stiffness_N_per_m=1e7) == []


def test_hertz_s_spring_counts_with_its_tangent() -> None:
    """Secant 5e4 at 120 N: tangent 7.5e4, sqrt(7.5e4 / 7.2) / 2 pi = 16.2 Hz, given either way."""
    stiffness = 120.0 / (120.0 / 5e4) ** 1.5
    one = said(7.2, 1e-3, law="hertz", stiffness_N_per_m=5e4)
    other = said(7.2, 1e-3, law="hertz", hertz_stiffness_N_per_m1_5=stiffness)
    assert one == other
    assert "16.2 Hz" in one[0]


def test_kinematic_contact_says_that_nothing_can_be_lost() -> None:
    (sentence,) = said(7.2, 1e-3, law="kinematic")
    assert "loss cannot occur" in sentence


def test_droppers_that_are_stiff_for_the_step_are_told() -> None:
    """1e8 N/m times (1 ms)^2 is ten times the limit, whose step is sqrt(10 / 1e8) s = 0.32 ms."""
    told = Told(7.2, 1e-3, law="linear", stiffness_N_per_m=1e6)
    told.attributes["config"]["line"] = {"dropper": {"stiffness_N_per_m": 1e8}}  # type: ignore[index]
    (sentence,) = remarks(told)  # type: ignore[arg-type]
    assert "1e+08 N/m" in sentence and "0.32 ms" in sentence
    assert "alpha_s = 0.001" in sentence
    # Droppers damped by as much as a step do not ring; the line's own 1e-4 s is too little.
    for alpha, said_so in ((1e-4, 1), (1e-3, 0)):
        droppers = {"alpha_s": alpha, "beta_per_s": 0.0}
        for damping in ({"per_component": {"droppers": droppers}}, droppers):
            config: Any = told.attributes["config"]
            config["line"]["damping"] = damping
            assert len(remarks(told)) == said_so  # type: ignore[arg-type]
    told.attributes["config"]["line"] = {"dropper": {"stiffness_N_per_m": 1e6}}  # type: ignore[index]
    assert remarks(told) == []  # type: ignore[arg-type]


def test_steps_that_went_on_above_the_tolerances_are_told() -> None:
    """Only where the scene says how many iterations there are: otherwise the run ends there."""
    told = Told(7.2, 1e-3, law="linear", stiffness_N_per_m=1e6)
    told.attributes["inner_iterations"] = {"steps": 900, "unconverged_steps": 7}  # type: ignore[assignment]
    assert remarks(told) == []  # type: ignore[arg-type]
    told.attributes["config"]["numerics"]["iterations"] = 2  # type: ignore[index,call-overload]
    (sentence,) = remarks(told)  # type: ignore[arg-type]
    assert "7 of 900 steps" in sentence and "numerics.iterations = 2" in sentence
    told.attributes["inner_iterations"] = {"steps": 900, "unconverged_steps": 0}  # type: ignore[assignment]
    assert remarks(told) == []  # type: ignore[arg-type]


@pytest.mark.parametrize("facts", [[], [{"static_force_N": 120.0}]])
def test_older_files_without_masses_have_no_remarks(facts: list[dict[str, Any]]) -> None:
    told = Told(7.2, 1e-3, law="linear", stiffness_N_per_m=5e4)
    told.attributes["pantographs"] = facts
    assert remarks(told) == []  # type: ignore[arg-type]


class Running(Told):
    """A run at 50 m/s from 100 m on, another pantograph 30 m behind; 150 to 200 m evaluated."""

    evaluation = (150.0, 200.0)
    time = 0.01 * np.arange(401)

    def __init__(self, *incidents: dict[str, Any]) -> None:
        super().__init__(7.2, 1e-3, law="linear", stiffness_N_per_m=1e6)
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
