"""Numbers that differ look different."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from catenary.cases.terminal.terminal_text import summary_text
from catenary.postproc.evaluate.compare import table_row
from catenary.postproc.evaluate.wording import decimals_that_tell, with_minus


@pytest.mark.parametrize(
    ("value", "limit", "fewest", "expected"),
    [
        (67.25, 45.29, 2, 2),
        (143.359, 143.356, 2, 3),
        (143.3563, 143.3562, 1, 4),
        (143.356, 143.356, 2, 2),
        (math.nan, 143.356, 2, 2),
        (None, 143.356, 2, 2),
        (math.inf, 350.0, 1, 1),
        (1.0, math.nextafter(1.0, 2.0), 2, 11),
    ],
)
def test_decimals_go_on_until_two_numbers_differ(
    value: float | None, limit: float, fewest: int, expected: int
) -> None:
    assert decimals_that_tell(value, limit, fewest) == expected


def test_negative_numbers_have_a_minus_and_all_else_keeps_its_hyphens() -> None:
    assert with_minus("-7.8 N, from -1 to 2") == "\u22127.8 N, from \u22121 to 2"
    for text in ("0-5 Hz", "2026-11-27", "mean - 3 sigma", "1e-05", "--set a.b=-3", "-o DIR"):
        assert with_minus(text) == text


def test_a_summary_shows_by_how_little_a_limit_is_missed() -> None:
    one = {"name": "pantograph", "loss_percent": 0.0}
    one |= {f"{name}_N": 1.0 for name in ("mean", "std", "max", "min", "stat_max", "stat_min")}
    summary = {
        "case": "made_up",
        "speed_km_h": 275.0,
        "evaluation_m": [0.0, 1.0],
        "pantographs": [one],
        "droppers": {"n_slackened": 0},
        "supports": {"max_uplift_mm": 1.0},
        "n_steps": 1,
        "n_dofs": 1,
        "n_ranks": 1,
        "real_time_factor": 76.2,
        "real_time_factor_with_records": 37.1,
        "acceptance": [
            {
                "criterion": "mean contact force",
                "value": 143.3591,
                "limit": 143.35625,
                "unit": "N",
                "passed": False,
            }
        ],
    }
    text = summary_text(summary, Path("results"), {"march": 0.24, "report": 0.75}, 2.04)
    assert "real-time factor 76.20, with all records 37.10" in text
    assert "2.0 s from the command to this summary: march 0.2, report 0.8" in text
    assert "FAILED      mean contact force: 143.359, limit 143.356 N" in text


@pytest.mark.parametrize(
    ("values", "cells"),
    [
        ([26.8048, 34.6212], ["26.8", "34.6", "7.8"]),  # a deviation is not known to 0.1 mN
        ([119.2703, 119.0911], ["119.27", "119.09", "-0.18"]),
        ([119.2703, 119.2706, 240.0], ["119.2703", "119.2706", "240.0000", "3.0e-04", "120.7297"]),
        ([119.2703, 119.2703], ["119.2703", "119.2703", "0.0000"]),  # equal to all four
        ([0.0, 0.0], ["0.0", "0.0", "0.0"]),
        ([1.0, math.nan], ["1.0000", "nan", "nan"]),
    ],
)
def test_compared_figures_have_the_decimals_of_their_difference(
    values: list[float], cells: list[str]
) -> None:
    assert table_row("mean [N]", values).split()[2:] == cells
