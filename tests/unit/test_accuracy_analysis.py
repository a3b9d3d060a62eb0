"""Errors, orders, Pareto front and advice on made-up runs whose answers are known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from measuring import check

from catenary import InputError
from catenary.cases.studies.accuracy.analysis import (
    HISTORY,
    Found,
    Row,
    advice,
    cheapest,
    compare,
    observed_orders,
    pareto,
    parse_target,
    separate,
    uncertainties,
)

FIGURES = {
    "mean_N": 120.0,
    "std_N": 30.0,
    "std_0_5_N": 20.0,
    "std_5_20_N": 22.0,
    "max_N": 200.0,
    "min_N": 40.0,
    "max_uplift_mm": 55.0,
}
PLACES = np.linspace(0.0, 6.0 * np.pi, 3001)


def found(change: float = 0.0, **figures: float) -> Found:
    """Two pantographs; ``change`` of the second one's history is a cosine of that amplitude."""
    first = {**FIGURES, **figures}
    histories = [np.sin(PLACES), np.sin(PLACES) + change * np.cos(PLACES)]
    return Found([first, dict(FIGURES)], histories)


def row(dt: float, h: float, percent: float, cost: float, outcome: str = "done") -> Row:
    sizes = {"dt": dt, "h": h}
    errors = {"std": 0.3 * percent, HISTORY: 0.3 * percent}
    shares = {"std": percent, HISTORY: percent}
    level = f"{1e3 * dt:g}_ms_{round(1 / h)}"
    if outcome != "done":
        return Row("grid", level, outcome, sizes)
    return Row("grid", level, outcome, sizes, errors, shares, cost, 3)


def test_errors_are_those_of_the_worse_pantograph() -> None:
    """A cosine of 3 N over whole periods has the rms 3 / sqrt(2), 7.1 % of 30 N."""
    errors, percent = compare(found(3.0, std_N=33.0, max_N=195.0), found())
    check("std [N]", errors["std"], 3.0, within=1e-12)
    check("std [%]", percent["std"], 10.0, within=1e-12)
    check("max [N]", errors["max"], -5.0, within=1e-12)
    check("max, of the deviation [%]", percent["max"], 100.0 * 5.0 / 30.0, within=1e-9)
    # Both ends of the cosine are counted: 1 / 3001 of the mean square.
    check("history [N]", errors[HISTORY], 3.0 / math.sqrt(2.0), within=1e-3)
    assert percent["uplift"] == 0.0


def test_what_a_run_does_not_have_is_left_out() -> None:
    empty = Found([dict.fromkeys(FIGURES, None)] * 2, [np.zeros(0)] * 2)
    assert compare(empty, found()) == ({}, {})


def test_observed_orders_of_a_known_law() -> None:
    """e = 5 dt^2 whatever the order of the rows and the ratio of the steps."""
    steps = (1e-3, 4e-3, 2e-3, 5e-4)
    rows = [row(dt, 0.2, 5e6 * dt**2, 1.0) for dt in steps] + [row(8e-3, 0.2, 0, 0, "broke")]
    orders = observed_orders(rows, "dt", "std")
    assert [size for size, _ in orders] == [4e-3, 2e-3, 1e-3]
    check("orders", [order for _, order in orders], 2.0, within=1e-12)


def test_the_front_holds_what_nothing_beats() -> None:
    cheap, good, beaten, best = (
        row(4e-3, 0.2, 9.0, 0.02),
        row(1e-3, 0.2, 1.0, 0.1),
        row(2e-3, 0.1, 2.0, 0.15),
        row(5e-4, 0.1, 0.1, 0.4),
    )
    broken = row(8e-3, 1.0, 0.0, 0.0, "broke")
    assert pareto([best, beaten, broken, good, cheap]) == [cheap, good, best]
    # Of two with the same error the dearer one is beaten; of the same cost the worse one.
    assert pareto([good, replace(good, cost=0.2), replace(good, percent={HISTORY: 3.0})]) == [good]


def test_an_error_that_is_small_by_chance_is_no_reason() -> None:
    """4 ms changes its sign there: 2 ms, which is finer, is not within 1 %."""
    lucky, worse = row(4e-3, 0.2, 0.5, 0.02), row(2e-3, 0.2, 3.0, 0.05)
    right, finest = row(1e-3, 0.2, 0.8, 0.1), row(5e-4, 0.2, 0.2, 0.2)
    assert cheapest([lucky, worse, right, finest], HISTORY, 1.0) == right
    assert cheapest([lucky, worse, right, finest], HISTORY, 4.0) == lucky
    assert cheapest([lucky, worse], HISTORY, 1.0) is None


def test_a_coarser_mesh_is_not_finer_for_its_smaller_step() -> None:
    """1 ms on 5 elements stands although 0.5 ms on 2 elements is worse."""
    stands, other = row(1e-3, 0.2, 0.8, 0.1), row(5e-4, 0.5, 30.0, 0.05)
    assert cheapest([stands, other], HISTORY, 1.0) == stands


def modelled(dt: float, n: int) -> Found:
    """A run whose errors are known: the step's is 4e5 dt^2 N of the deviation, the mesh's -60 / n^2
    N; of the history they are as much, as a cosine of that rms. Half a step takes 1/4 of either.
    """
    wrong = 4e5 * dt**2 - 60.0 / n**2
    history = math.sqrt(2.0) * (30.0 * np.sin(PLACES) + wrong * np.cos(PLACES))
    return Found([{**FIGURES, "std_N": 30.0 + wrong}], [history])


def modelled_row(dt: float, n: int, reference: tuple[float, int]) -> Row:
    """A row of a grid as the study makes it, the cheaper the coarser."""
    finest = modelled(*reference)
    errors, percent = compare(modelled(dt, n), finest)
    apart = separate(modelled(dt, n), modelled(reference[0], n), finest)
    sizes = {"dt": dt, "h": 1.0 / n}
    return Row(
        "grid", f"{dt}_{n}", "done", sizes, errors, percent, 1e-4 * n / dt, 1, 0.0, 1.0, *apart
    )


def test_errors_of_step_and_mesh_that_cancel_are_no_reason() -> None:
    """2 ms on six elements: 1.60 N less 1.67 N of 30 N, as ``--quick`` once recommended."""
    lucky = modelled_row(2e-3, 6, (2e-4, 40))
    assert lucky.percent["std"] < 1.0 and lucky.percent[HISTORY] < 1.0  # together
    assert lucky.by_step["std"] > 4.0 and lucky.by_mesh["std"] > 4.0  # apart
    assert cheapest([lucky], "std", 1.0) is None
    assert "No setting tried is reliably within 1 %" in advice([lucky], HISTORY, 1.0, 0.1)
    # The logic before errors were measured apart recommends it.
    assert cheapest([replace(lucky, by_step={}, by_mesh={})], "std", 1.0) is not None


def test_a_setting_whose_own_errors_are_small_is_recommended() -> None:
    """0.5 ms is wrong by 0.10 N of 30 N, twelve elements by 0.42 N, twenty by 0.15 N."""
    rows = [modelled_row(5e-4, n, (2e-4, 40)) for n in (12, 20)]
    found = cheapest(rows, HISTORY, 1.0)
    assert found is rows[1]
    check(
        "mesh alone [%]", found.by_mesh[HISTORY], 100 * 60 / 30 * (1 / 400 - 1 / 1600), within=0.05
    )


def test_the_uncertainty_of_a_reference_is_that_of_its_known_law() -> None:
    """Second order in both: 1.25 times the errors of step and mesh, which are known."""
    dt, n = 2e-4, 40
    meshes = [modelled(dt, k) for k in (n, n // 2, n // 4)]
    steps = [modelled(m * dt, n // 4) for m in (1, 2, 4)]
    told = uncertainties(meshes[0], [meshes, steps])
    true = 100.0 * (4e5 * dt**2 + 60.0 / n**2) / 30.0
    check("std [%]", told["std"], 1.25 * true, within=0.01 * true)
    check("history [%]", told[HISTORY], 1.25 * true, within=0.02 * true)


def test_a_reference_that_does_not_converge_is_not_trusted() -> None:
    """Differences that grow with the fineness: three times the larger; none known: infinite."""
    runs = [found(std_N=30.0), found(std_N=30.9), found(std_N=31.2)]
    check("std [%]", uncertainties(runs[0], [runs])["std"], 9.0, within=1e-6)
    assert math.isinf(uncertainties(runs[0], [[*runs[:2], None]])["std"])
    assert math.isinf(uncertainties(None, [runs])[HISTORY])


def test_an_uncertain_reference_recommends_nothing() -> None:
    """The published 1 % of 0.5 ms and 12 elements came from a reference that was wrong by 1 %."""
    rows = [row(5e-4, 1 / 12, 0.25, 0.1)]
    assert advice(rows, HISTORY, 1.0, 0.33).startswith("For 1 % in the force history")
    for own, said in ((0.34, "may be wrong by 0.34 % itself"), (math.inf, "is not known")):
        sentence = advice(rows, HISTORY, 1.0, own)
        assert sentence.startswith(
            "Settings for 1 % in the force history (rms, 0-20 Hz) are not known"
        )
        assert said in sentence and "dt =" not in sentence
    assert "are not known" in advice(rows, HISTORY, 1.0, math.nan)


def test_what_is_refined_alone_is_recommended_alone() -> None:
    said = advice([row(1e-3, 0.2, 0.5, 0.1)], "std", 1.0, 0.1, "mesh")
    assert said.endswith("; the error of the mesh comes on top and is not judged.")


def test_advice_is_a_sentence_with_settings_and_speed() -> None:
    rows = [row(1e-3, 0.125, 0.83, 0.1), row(2e-3, 0.125, 4.0, 0.05)]
    said = advice(rows, "std", 1.0)
    assert said == (
        "For 1 % in the standard deviation (0-20 Hz): dt = 1 ms, elements per gap = 8; error "
        "0.83 %, 10 times faster than real time."
    )
    assert "0.2 times the speed of real time" in advice([row(1e-3, 0.2, 0.5, 5.0)], "std", 1.0)
    coarse = replace(row(8e-3, 0.2, 0.4, 0.01), percent={"std": 0.4, HISTORY: 51.0})
    assert "; the force history is wrong by 51 % there" in advice([coarse], "std", 1.0)
    assert "reliably within 0.1 %" in advice(rows, "std", 0.1)
    assert "smallest error among them is 0.83 %" in advice(rows, "std", 0.1)
    assert advice([], "std", 1.0).startswith("No setting")


@pytest.mark.parametrize(("text", "value"), [("1%", 1.0), (" 0.5 % ", 0.5), ("2", 2.0)])
def test_a_target_is_a_percentage(text: str, value: float) -> None:
    assert parse_target(text) == value


@pytest.mark.parametrize("text", ["", "0", "-1%", "nan", "101%", "one", "1%%"])
def test_other_targets_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="percentage above 0"):
        parse_target(text)
