"""Arrivals of waves against what is found by hand, and the sentences that tell them."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from measuring import check
from scenes import load_scene, problem_of

from catenary.cases.run.arrivals import (
    Course,
    WaveLine,
    arrival_facts,
    run_in_for,
    start_share,
    wave_line,
)

# One string, 1000 m, waves of 100 m/s.
STRING = WaveLine(0.0, 1000.0, 50.0, 100.0, 100.0, 0.0, 0.0, 2.0 * math.pi)
ALONE = Course(STRING, 100.0, 900.0, 50.0, (300.0, 500.0), 100.0, 100.0)


def test_a_reflected_wave_meets_the_train_where_the_ways_add_up() -> None:
    """900 m to the end and d back while the train runs 900 - d: (900 + d) / 100 = (900 - d) / 50,
    d = 300: at 700 m after 12 s."""
    assert ALONE.far_end is not None and ALONE.near_end is not None
    check("met at [m]", ALONE.far_end.at, 700.0, within=1e-9)
    check("after [s]", ALONE.far_end.time, 12.0, within=1e-12)
    # Back 100 m to the end and 100 + 50 t forward again: 100 t = 200 + 50 t.
    check("from the near end at [m]", ALONE.near_end.at, 300.0, within=1e-9)
    check("after [s]", ALONE.near_end.time, 4.0, within=1e-12)
    check("run-in [m]", ALONE.run_in, 200.0, within=1e-12)
    check("run-in [spans]", ALONE.run_in_spans, 4.0, within=1e-12)
    assert not ALONE.feels_reflection


def test_a_trailing_pantograph_meets_the_wave_of_the_leading_one_first() -> None:
    """The leader's wave from 300 m: 700 m to the end, d back; the trailing one runs 900 - d from
    100 m: (700 + d) / 100 = (900 - d) / 50, d = 366.7."""
    trailing = ALONE._replace(leader=300.0)
    met = trailing.far_end
    assert met is not None
    check("met at [m]", met.at, 1000.0 - 1100.0 / 3.0, within=1e-9)


def test_the_shortest_line_without_a_reflection_is_met_at_the_end_of_the_stretch() -> None:
    course = ALONE._replace(stretch=(300.0, 800.0))
    assert course.feels_reflection
    end = course.least_end
    met = course._replace(line=STRING._replace(end=end)).far_end
    assert met is not None
    check("met at [m]", met.at, 800.0, within=1e-9)
    assert not course._replace(line=STRING._replace(end=end + 1.0)).feels_reflection
    assert course._replace(line=STRING._replace(end=end - 1.0)).feels_reflection


def test_damping_takes_amplitude_on_the_way() -> None:
    """Mass damping alone: exp(-beta t / 2). What is met at 800 m left the leader at x with
    (1000 - x + 200) / 100 = (800 - x) / 50: x = 400, 8 s before."""

    def course(**damping: float) -> Course:
        return ALONE._replace(line=STRING._replace(**damping), stretch=(300.0, 800.0))

    check("share", course(beta=0.5).far_share, math.exp(-2.0), within=1e-12)
    heavy = course(beta=2.0)
    assert heavy.far_share < 1e-3
    assert not heavy.feels_reflection
    # ln(1000) / 1 s at 50 m/s, there and back: 172.7 m behind the stretch they have faded.
    check("end [m]", heavy.least_end, 800.0 + 25.0 * math.log(1000.0), within=1e-9)
    # On stiffness: alpha w^2 / 2 with w = pi c / span = 2 pi 1/s.
    expected = math.exp(-0.01 * (2.0 * math.pi) ** 2 * 8.0)
    check("share", course(alpha=0.02).far_share, expected, within=1e-12)


def test_a_train_as_fast_as_the_waves_meets_none() -> None:
    fast = ALONE._replace(speed=100.0, stretch=(300.0, 800.0))
    assert fast.far_end is None and fast.near_end is None and fast.far_share == 0.0
    assert not fast.feels_reflection


def test_the_run_in_that_is_asked_for_leaves_the_limit() -> None:
    assert start_share(STRING, 50.0, 0.0) == 1.0
    check("four spans", start_share(STRING, 50.0, 200.0), 0.2, within=1e-12)
    check("undamped [m]", run_in_for(STRING, 50.0), 200.0, within=1e-6)
    damped = STRING._replace(beta=0.5)
    needed = run_in_for(damped, 50.0)
    assert 0.0 < needed < 200.0
    check("damped", start_share(damped, 50.0, needed), 0.2, within=1e-9)


def test_a_run_in_without_damping_is_found_whatever_is_rounded() -> None:
    for span in np.linspace(40.0, 70.0, 301):
        needed = run_in_for(STRING._replace(span=float(span)), 50.0)
        check("undamped [m]", needed, 4.0 * span, within=1e-9)


def test_a_line_for_waves_has_both_wires_and_what_hangs_on_them() -> None:
    """EN 50318 has massless droppers without clamps: (20 + 16) kN / (1.35 + 1.07) kg/m."""
    line = wave_line(problem_of(load_scene("en50318_2002")))
    check("both wires [m/s]", line.speed, math.sqrt(36000.0 / 2.42), within=1e-9)
    check("faster wire [m/s]", line.fastest, math.sqrt(16000.0 / 1.07), within=1e-9)
    assert (line.start, line.end, line.span) == (0.0, 1320.0, 60.0)
    assert (line.alpha, line.beta) == (1e-4, 0.0125)
    bare = problem_of(load_scene("en50318_2002", ["effects.structural_damping=false"]))
    assert wave_line(bare).decay == 0.0
    # Clamps of 0.36 kg and droppers every 6.1 m make the wires of ac_simple 3 % heavier.
    heavy = wave_line(problem_of(load_scene("ac_simple")))
    assert 0.975 < heavy.speed / math.sqrt(38000.0 / 2.43) < 0.99


TWO = 'train.pantographs=[{name="reference"}, {name="reference", behind_m=200}]'


@pytest.mark.parametrize(
    ("assignments", "words"),
    [
        ([], []),
        (["line.n_spans=14"], []),
        (["line.n_spans=13"], ["the pantograph at 591 m (7.2 s)", "line.n_spans = 14,"]),
        (["line.n_spans=12"], ["the pantograph at 547 m (6.6 s)", "evaluation.to_m = 547 at most"]),
        (
            ["train.start_m=290", TWO],
            ["The leading pantograph starts 70 m, 1.2 spans", "from_m = 524"],
        ),
        (["train.start_m=200"], ["starts 160 m, 2.7 spans", "train.start_m = 126 at most"]),
        (["evaluation.to_m=400"], ["stretch of 40 m is shorter than a span (60 m)", "= 420"]),
    ],
    ids=lambda words: " ".join(words) or "nothing",
)
def test_warnings_name_what_would_do(assignments: list[str], words: list[str]) -> None:
    scene = load_scene("en50318_2002", assignments)
    facts = arrival_facts(scene, problem_of(scene))
    json.dumps(facts, allow_nan=False)
    print(facts["warnings"])
    assert len(facts["warnings"]) == bool(words)
    for word in words:
        assert word in facts["warnings"][0]
    assert len(facts["pantographs"]) == len(scene.train.pantographs)


@pytest.mark.parametrize("remedy", [["line.n_spans=14"], ["evaluation.to_m=547"]])
def test_what_a_warning_advises_ends_it(remedy: list[str]) -> None:
    scene = load_scene("en50318_2002", ["line.n_spans=12", *remedy])
    assert arrival_facts(scene, problem_of(scene))["warnings"] == []


def test_the_start_that_is_advised_ends_the_warning() -> None:
    scene = load_scene("en50318_2002", ["train.start_m=126"])
    assert arrival_facts(scene, problem_of(scene))["warnings"] == []
