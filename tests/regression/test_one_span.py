"""The shortest line, from anchor to anchor: no masts in between, no supports, no steady arms."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from measuring import check
from verb_runner import invoke

import catenary

ONE = {
    "line.n_spans": 1,
    "train.start_m": 1.0,
    "train.end_m": 54.0,
    "train.raise_time_s": 0.1,
    "evaluation.from_m": 10.0,
    "evaluation.to_m": 50.0,
}
WORDS = ("--set", *(f"{key}={value}" for key, value in ONE.items()))


def test_a_wire_alone_sags_as_its_closed_form_says() -> None:
    """q L^2 / 8 T - q EI / T^2 between ends that turn freely, l = sqrt(EI / T) from which 1e-60 is
    felt at mid-span. Elements of 0.75 m have that within 1e-8 m."""
    scene = catenary.load("tramway", short=True).replace(
        {**ONE, "train.end_m": 29.0, "evaluation.to_m": 25.0}
    )
    heights = catenary.static(scene).contact_wires.height_m
    load, tension, bending, length = 0.95 * 9.81, 1e4, 110.0, 30.0
    sag = load * length**2 / (8 * tension) - load * bending / tension**2
    check("sag [m]", heights.max() - heights.min(), sag, within=1e-8)


@pytest.mark.parametrize("case", ["ac_simple", "ac_simple_3d"])
def test_every_verb_takes_a_line_of_one_span(case: str, tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for verb, name in (
            ("static", "droppers.csv"),
            ("check", ""),
            ("plan", ""),
            ("mesh", "line.png"),
            ("waves", "waves"),
            ("run", "run"),
        ):
            out = ("-o", str(tmp_path / name)) if name else ()
            ended = invoke(verb, case, *out, *WORDS)
            assert ended.exit_code == 0, (verb, ended.output, ended.exception)
    found = catenary.open(tmp_path / "run")
    assert found.outcome == "done" and np.isfinite(found.force.values).all()
