"""The verdicts on the paper's nine statements: figures made up so that each holds or fails."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from measuring import check
from small_lines import BARE, bare_wires, mesh_of, problem_of

from catenary import InputError
from catenary.cases.ambrosio2012.study import TABLE
from catenary.cases.studies import paper_study as conclusion
from catenary.cases.studies.paper_study import PaperStudy, Rows
from catenary.cases.studies.waves.theory import first_band
from catenary.postproc.report.study_report import NOT_REPRODUCED, REPRODUCED, UNDECIDED
from catenary.solver.effects.build_model import build

LIGHT, AVERAGE = "light", "average"
TRAINS = ("single", "31m", "85m", "200m")
PAPER = PaperStudy.read(TABLE)
STATEMENTS = conclusion.statements_of(PAPER.table)
Runs = dict[tuple[str, str], list[dict[str, Any]] | None]


def force(std: float, reach: float, slack: tuple[int, int]) -> dict[str, Any]:
    """Figures of a pantograph whose extreme forces lie ``reach`` [N] from its mean."""
    return {
        "mean_N": 150.0, "std_N": std, "max_N": 150.0 + reach, "min_N": 150.0 - reach,
        "loss_percent": 0.0, "std_0_5_N": 0.8 * std, "std_5_20_N": 0.6 * std, "uplift_mm": 50.0,
        "onset_m": 12.0, "slack_before": slack[0], "slack_after": slack[1],
        "wave_speed_km_h": 441.2, "speed_over_wave": 300.0 / 441.2,
    }  # fmt: skip


def as_the_paper_says() -> Runs:
    """Runs that satisfy all nine statements."""
    runs: Runs = {
        (LIGHT, "single"): [force(50, 110, (4, 0))],
        (AVERAGE, "single"): [force(38, 80, (0, 0))],
    }
    for train in TRAINS[1:]:
        worst = 10.0 if train == "200m" else 0.0
        pair = force(52 if train == "31m" else 50, 112, (4, 6))
        runs[LIGHT, train] = [pair, force(55 + worst, 125 + worst, (4, 6))]
        slack = (0, 2 if worst else 0)
        runs[AVERAGE, train] = [
            force(38, 80, slack),
            force(40 + worst / 4, 86 + worst / 4, slack),
        ]
    return runs


def findings(runs: Runs) -> list[Any]:
    return conclusion.judge(STATEMENTS, Rows.of(runs))


def verdicts(runs: Runs) -> list[str]:
    return [finding.verdict for finding in findings(runs)]


def changed(damping: str, train: str, place: int | None = None, **values: Any) -> Runs:
    """The paper's runs with figures of one run, or of one of its pantographs, replaced."""
    runs = as_the_paper_says()
    own = runs[damping, train]
    assert own is not None
    for number, one in enumerate(own):
        if place in (None, number):
            one |= values
    return runs


def test_runs_as_the_paper_says_reproduce_all_nine() -> None:
    found = findings(as_the_paper_says())
    assert [finding.number for finding in found] == list(range(1, 10))
    assert [finding.verdict for finding in found] == [REPRODUCED] * 9


@pytest.mark.parametrize(
    ("number", "runs", "told"),
    [
        (1, changed(AVERAGE, "85m", 1, mean_N=156.0), "to 156.0 (85m trailing, average), 13 of 14"),
        (1, changed(LIGHT, "single", 0, mean_N=144.0), "mean [N] 144.0 (single, light) to 150.0"),
        (2, changed(AVERAGE, "31m", 1, std_N=45.1), "to 30.1 (31m trailing), 6 of 7 as stated"),
        (2, changed(LIGHT, "single", 0, std_N=44.9), "light: std / mean [%] 29.9 (single) to"),
        (3, changed(LIGHT, "85m", 1, max_N=400.0), "max [N] largest 400.0 (85m trailing)"),
        (3, changed(AVERAGE, "31m", 0, min_N=1.0), "min [N] smallest 1.0 (31m leading)"),
        (3, changed(AVERAGE, "single", 0, std_N=60.0), "std [N] largest 60.0 (single)"),
        (4, changed(LIGHT, "31m", 1, max_N=200.0), "leading one's [N] -49.0 (31m trailing)"),
        (4, changed(AVERAGE, "200m", 1, max_N=400.0, min_N=20.0), "average +32.7, average +81.3"),
        (5, changed(LIGHT, "31m", 0, std_N=49.0), "-2.0 (31m leading)"),
        (5, changed(LIGHT, "31m", 0, std_N=60.0), "+20.0 (31m leading)"),
        (
            6,
            changed(AVERAGE, "200m", 1, loss_percent=0.4),
            "to 0.4 (200m trailing, average), 13 of",
        ),
        (7, changed(AVERAGE, "85m", uplift_mm=70.1), "to 70.1 (85m, average), 7 of 8 as stated"),
        (7, changed(LIGHT, "31m", onset_m=-0.5), "-0.5 (31m, light)"),
        (8, changed(LIGHT, "31m", slack_before=0, slack_after=0), "slack at mid-span 0 (31m)"),
        (8, changed(AVERAGE, "85m", slack_after=1), "to 1 (85m), 2 of 3 as stated"),
        (8, changed(AVERAGE, "200m", slack_before=1), "before the trailing one 1 (200m)"),
        (8, changed(AVERAGE, "200m", slack_after=0), "after the trailing one 0 (200m)"),
        (9, changed(LIGHT, "single", wave_speed_km_h=440.0), "wave speed [km/h] 440.0"),
        (9, changed(LIGHT, "single", speed_over_wave=0.703), "over wave speed 0.703"),
    ],
)
def test_one_figure_is_enough_to_refute(number: int, runs: Runs, told: str) -> None:
    finding = findings(runs)[number - 1]
    assert finding.verdict == NOT_REPRODUCED
    assert told in finding.found


def test_a_run_that_broke_leaves_open_what_it_would_decide() -> None:
    runs = as_the_paper_says()
    runs[AVERAGE, "85m"] = None
    found = verdicts(runs)
    # The statements about light damping at 31 m and about the wire's data need no such run.
    assert [number for number, one in enumerate(found, 1) if one != UNDECIDED] == [5, 9]
    assert "85m, average" in findings(runs)[0].found


def test_without_the_separation_of_200_m_its_statements_are_open() -> None:
    runs = {key: own for key, own in as_the_paper_says().items() if key[1] != "200m"}
    found = verdicts(runs)
    assert found[2] == found[7] == UNDECIDED
    assert found[1] == REPRODUCED
    assert verdicts({}) == [UNDECIDED] * 9


def test_a_difference_within_the_discretisations_error_decides_nothing() -> None:
    assert verdicts(changed(LIGHT, "31m", 0, std_N=50.2))[4] == UNDECIDED


def test_missing_arms_leave_the_uplift_open() -> None:
    assert verdicts(changed(LIGHT, "31m", onset_m=None))[6] == UNDECIDED


def test_only_the_separations_of_the_text_may_be_judged() -> None:
    runs = changed(AVERAGE, "85m", 1, std_N=80.0, max_N=400.0)
    assert PAPER.named_trains == ["single", "31m", "200m"]
    assert verdicts(runs)[1:3] == [NOT_REPRODUCED] * 2
    named = conclusion.judge(STATEMENTS, Rows.of(runs).only(PAPER.named_trains))
    assert [one.verdict for one in named][1:3] == [REPRODUCED] * 2


@pytest.mark.parametrize(
    ("condition", "says"),
    [({"figure": "mean", "above": 1.0}, "must be one of mean_N"),
     ({"figure": "mean_N", "over": 1.0}, "over: Extra inputs")],
)  # fmt: skip
def test_a_wrong_condition_is_told(condition: dict[str, Any], says: str) -> None:
    table = {"statements": [{"says": "A.", "criterion": "B", "conditions": [condition]}]}
    with pytest.raises(InputError, match=says):
        conclusion.statements_of(table)


def single(light: float, average: float | None) -> Rows:
    return Rows.of({
        (LIGHT, "single"): [force(light, 100, (2, 0))],
        (AVERAGE, "single"): None if average is None else [force(average, 100, (2, 0))],
    })  # fmt: skip


def ranked() -> list[conclusion.Ranked]:
    varied = {
        "little": single(70.5, 71), "much": single(50, 44), "broke": single(10, None),
        "worse": single(70, 81),
    }  # fmt: skip
    return conclusion.rank(single(70, 71), varied, PAPER)


def test_variations_are_ranked_by_their_larger_effect_on_the_deviation() -> None:
    assert [row.title for row in ranked()] == ["", "much", "worse", "little"]
    rows = conclusion.ranking_table(PAPER, ranked()).texts()
    assert [row[0] for row in rows] == ["the case", "much", "worse", "little"]
    assert rows[1][1:5] == ["50.0", "44.0", "-20.0", "-27.0"]


def test_the_reason_names_what_moves_a_figure_and_what_meets_the_statement() -> None:
    text = conclusion.movers(STATEMENTS[1], ranked())
    assert "std [N] 71.0 in the case; moved most by much: 44.0; worse: 81.0." in text
    assert "The statement holds for it with much." in text
    none = conclusion.movers(STATEMENTS[1], [row for row in ranked() if row.title != "much"])
    assert "None of the 2 variations alone makes the statement hold" in none
    alone = conclusion.movers(STATEMENTS[5], ranked())
    assert "It satisfies the statement: the second pantograph makes" in alone
    assert conclusion.movers(STATEMENTS[2], ranked()) == ""


def test_without_the_case_itself_nothing_is_ranked() -> None:
    assert conclusion.rank(single(70, None), {}, PAPER) == []
    assert conclusion.ranking_table(PAPER, []).rows == []
    assert conclusion.movers(STATEMENTS[1], []) == ""


def test_the_first_mode_of_bare_wires_is_that_of_a_string_with_some_stiffness() -> None:
    # Two pinned wires that are not coupled. A pinned beam under tension has in its first mode
    # f = sqrt((F k^2 + EI k^4) / rho) / 2 pi with k = pi / L. Hermite elements overestimate the
    # share of EI, 3e-5, by (k h)^4 / 720 = 1e-8, and that of the tension by less: 1e-12. The
    # solver of the eigenvalues leaves round-off times the matrix's condition, some 1e6.
    length = 60.0
    line = bare_wires(length)
    model = build(problem_of(line, BARE), mesh_of(line, 60), np.zeros(0))
    k = math.pi / length
    expected = sorted(
        math.sqrt((w.tension * k**2 + w.bending_stiffness * k**4) / w.mass_per_length) / math.tau
        for w in (line.contact_wire, line.messenger_wire)
    )
    band = first_band(model, 2)
    check("lower first mode [Hz]", band[0], expected[0], within=1e-9)
    check("higher first mode [Hz]", band[1], expected[1], within=1e-9)


def test_the_delay_is_told_in_periods_and_the_deviation_beside_the_single_ones() -> None:
    runs = as_the_paper_says()
    runs[AVERAGE, "200m"] = None
    rows = conclusion.separation_table(PAPER, {"case": ((1.0, 1.25), Rows.of(runs))}).texts()
    # 200 m at 300 km/h are 2.4 s; 65 N beside 50 N with light damping.
    assert rows[-1] == ["case", "1.00 to 1.25", "200m", "2.40", "2.40 to 3.00", "1.30", "-"]
    assert [row[2] for row in rows] == ["31m", "85m", "200m"]
