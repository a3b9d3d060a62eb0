"""Acceptance: limits at 300 km/h, limits of all systems, and values exactly at a limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catenary.base.errors import InputError
from catenary.postproc.evaluate.statistics import (
    DropperStatistics,
    PantographStatistics,
    RunStatistics,
    SupportStatistics,
)
from catenary.postproc.evaluate.verdict import Criterion, judge, verdict
from catenary.postproc.standards import en50367 as standards

SPEED = 300.0 / 3.6
WAVE = 441.0 / 3.6
GOOD = PantographStatistics(
    name="pantograph",
    mean=150.0,
    std=40.0,
    maximum=260.0,
    minimum=40.0,
    loss_percent=0.0,
    arcing_percent=0.0,
    contact_height_range=0.05,
)


def run(*pantographs: PantographStatistics, uplift: float = 0.06) -> RunStatistics:
    one = np.ones(1)
    return RunStatistics(
        pantographs,
        SupportStatistics(one, uplift * one, one.astype(bool), uplift),
        DropperStatistics(one, one, one, one.astype(bool), 0, 1.0, 1.0),
    )


def judged(
    statistics: RunStatistics, speed: float = SPEED, system: str = "ac", edition: str = "2006"
) -> dict[str, Criterion]:
    criteria = judge(statistics, speed, WAVE, system, edition)
    assert len({c.criterion for c in criteria}) == len(criteria)
    return {c.criterion: c for c in criteria}


def test_limits_at_300_km_h() -> None:
    found = judged(run(GOOD))
    assert found["mean contact force"].limit == pytest.approx(157.3, abs=1e-9)
    assert found["standard deviation, 0.3 of the allowed mean"].limit == pytest.approx(
        47.19, abs=1e-9
    )
    assert found["standard deviation, 0.3 of the mean"].limit == pytest.approx(45.0)
    assert found["maximum contact force"].limit == 350.0
    assert found["contact-wire uplift at steady arms"].limit == pytest.approx(120.0)
    assert found["vertical amplitude of the contact point"].limit == pytest.approx(80.0)
    assert found["arcing NQ"].limit == 0.2
    speed = found["train speed against 0.7 of the wave speed"]
    assert (speed.value, speed.limit) == pytest.approx((300.0, 0.7 * 441.0))
    assert all(c.passed for c in found.values())
    assert verdict(list(found.values())) is True


@pytest.mark.parametrize(
    ("system", "v", "limit"),
    [
        ("ac", 160.0, 0.00047 * 160**2 + 90),
        ("ac", 200.0, 108.8),
        ("ac", 250.0, 0.00097 * 250**2 + 70),
        ("dc_3kv", 200.0, 0.00097 * 200**2 + 110),
        ("dc_1500v", 200.0, 0.00097 * 200**2 + 140),
    ],
)
def test_mean_force_rules(system: str, v: float, limit: float) -> None:
    for edition in standards.EDITIONS:
        assert standards.mean_force_limit(v / 3.6, system, edition) == pytest.approx(limit)


def test_editions_differ_in_extreme_forces_only_where_they_do() -> None:
    assert standards.max_force_limit(160 / 3.6, "ac", "2006") == 350.0
    assert standards.max_force_limit(200 / 3.6, "ac", "2012") == 300.0
    assert standards.max_force_limit(201 / 3.6, "ac", "2012") == 350.0
    assert standards.max_force_limit(250 / 3.6, "dc_3kv", "2020") == 400.0
    assert "minimum contact force" not in judged(run(GOOD))
    assert judged(run(GOOD), edition="2012")["minimum contact force"].passed
    touching = replace(GOOD, minimum=0.0)
    assert judged(run(touching), edition="2020")["minimum contact force"].passed is False


LIMIT_AT_300 = standards.mean_force_limit(SPEED, "ac", "2006")


@pytest.mark.parametrize(
    ("change", "criterion", "passes"),
    [
        ({"mean": LIMIT_AT_300}, "mean contact force", True),
        ({"mean": np.nextafter(LIMIT_AT_300, 999)}, "mean contact force", False),
        ({"std": 0.3 * 150.0}, "standard deviation, 0.3 of the mean", True),
        ({"std": 45.01}, "standard deviation, 0.3 of the mean", False),
        ({"std": 47.2}, "standard deviation, 0.3 of the allowed mean", False),
        ({"maximum": 350.0}, "maximum contact force", False),
        ({"maximum": 349.99}, "maximum contact force", True),
        ({"contact_height_range": 0.0801}, "vertical amplitude of the contact point", False),
        ({"arcing_percent": 0.2}, "arcing NQ", True),
        ({"arcing_percent": 0.21}, "arcing NQ", False),
    ],
)
def test_values_at_and_beyond_a_limit(change: dict, criterion: str, passes: bool) -> None:
    found = judged(run(replace(GOOD, **change)))
    assert found[criterion].passed is passes
    if not passes:
        assert verdict(list(found.values())) is False


def test_uplift_and_speed_beyond_their_limits() -> None:
    assert judged(run(GOOD, uplift=0.1201))["contact-wire uplift at steady arms"].passed is False
    fast = judged(run(GOOD), speed=309.0 / 3.6)
    assert fast["train speed against 0.7 of the wave speed"].passed is False


def test_every_pantograph_is_judged_under_its_name() -> None:
    leading, trailing = replace(GOOD, name="leading"), replace(GOOD, name="trailing", std=60.0)
    found = judged(run(leading, trailing))
    assert found["standard deviation, 0.3 of the mean, leading"].passed
    assert found["standard deviation, 0.3 of the mean, trailing"].passed is False
    assert len(found) == 2 * 6 + 2


def test_what_has_no_value_is_not_judged() -> None:
    found = judged(run(PantographStatistics("pantograph", complaint="too short")))
    assert found["mean contact force"].passed is None
    assert verdict(list(found.values())) is None


@pytest.mark.parametrize(("system", "edition"), [("dc_750v", "2006"), ("ac", "1999")])
def test_unknown_system_or_edition_is_an_input_error(system: str, edition: str) -> None:
    with pytest.raises(InputError, match="choose one of"):
        judge(run(GOOD), SPEED, WAVE, system, edition)


def test_nothing_of_a_pantograph_passes_by_statistics_that_judge_nothing() -> None:
    """A force that is zero all the way is below every limit; the line is judged all the same."""
    silent = replace(GOOD, mean=0.0, std=0.0, maximum=0.0, unjudged="zero all the way")
    criteria = judge(run(silent), SPEED, WAVE, "ac", "2006")
    own = [c for c in criteria if c.clause not in ("", None) and "uplift" not in c.criterion]
    assert [c.passed for c in own if "speed" not in c.criterion] == [None] * (len(own) - 1)
    assert verdict(criteria) is None
    assert run(silent).complaints == ["zero all the way"]


def test_the_rule_on_speed_says_where_it_is_taken_over() -> None:
    """EN 50119 states it for tensioned wires; a conductor rail is judged by its slowest wave."""
    criteria = judge(run(GOOD), SPEED, WAVE, "ac", "2020", by_bending=True)
    (speed,) = [c for c in criteria if c.criterion.startswith("train speed")]
    assert speed.passed is True and "bending" in speed.clause and "assumed" in speed.clause
    assert "bending" not in judged(run(GOOD))[speed.criterion].clause
