"""Quantities that rule books judge, beside plain second ways to find them."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest

from catenary.meshgen.wires import Role
from catenary.postproc.evaluate import statistics
from catenary.postproc.evaluate.compare import compare
from catenary.postproc.evaluate.observations import (
    OBSERVED,
    ObservedRun,
    bending_strain,
    observe,
    wire_at_rest,
)
from catenary.postproc.evaluate.verdict import Criterion, criteria_of
from catenary.postproc.files.hdf5 import ATTRIBUTE_SUMS
from catenary.postproc.read.results import ContactProfile, Results
from catenary.postproc.report.report import write_report
from catenary.postproc.standards.rule_books import KMH, QUANTITIES, shipped
from catenary.solver.effects.all_effects import registry
from catenary.solver.problem.watched_links import TENSION

pytestmark = pytest.mark.usefixtures("quick_reports")

NONE = np.zeros(0, dtype=int)
MASTS = np.arange(0.0, 301.0, 50.0)
OWN_BOOK = {
    "name": "mine",
    "title": "My rules",
    "criteria": [
        {
            "id": "sigma",
            "title": "sigma",
            "quantity": "force_std",
            "relation": "<=",
            "limit": {"value": 1.0},
        }
    ],
}


def at_rest(*profiles: ContactProfile, **more: Any) -> Any:
    """What observations ask of a result file, of wires at rest alone."""
    return SimpleNamespace(
        contact_profiles=lambda: {str(n): own for n, own in enumerate(profiles)},
        evaluation=(50.0, 250.0),
        line=lambda name: {"support_x": MASTS}[name],
        fact=lambda name: {"speed": 80.0}[name],
        **more,
    )


def observed(name: str, results: Any, **found: Any) -> Any:
    return OBSERVED[name](ObservedRun(results, SimpleNamespace(**found)))  # type: ignore[arg-type]


def rising() -> ContactProfile:
    """5.30 m up to 100 m, then 2 per mille up to 200 m, then level; sags by 30 mm in between."""
    x = np.linspace(0.0, 300.0, 601)
    height = 5.3 + np.interp(x, [100.0, 200.0], [0.0, 0.2])
    return ContactProfile(NONE, x, height - 0.03 * np.sin(np.pi * x / 50.0) ** 2)


def test_gradients_are_those_from_mast_to_mast() -> None:
    results = at_rest(rising())
    assert observed("wire_gradient", results).values[""] == pytest.approx(2.0, rel=1e-10)
    assert observed("wire_gradient_change", results).values[""] == pytest.approx(2.0, rel=1e-10)
    # The lowest point is in the middle of a level span, the highest at its mast beyond 200 m.
    assert observed("wire_height_min", results).values[""] == pytest.approx(5270.0)
    assert observed("wire_height_max", results).values[""] == pytest.approx(5500.0)


def test_a_level_wire_has_no_gradient_at_all() -> None:
    """Above 250 km/h no gradient is allowed: what form finding leaves of one must not fail."""
    wire = rising()
    for rise, found in ((0.9e-3, 0.0), (1.1e-3, 0.022)):  # over 50 m
        level = wire._replace(height=5.3 + rise * wire.x / 50.0)
        assert observed("wire_gradient", at_rest(level)).values[""] == pytest.approx(found)


def test_a_train_as_fast_as_a_limit_does_not_exceed_it() -> None:
    """120 / 3.6 * 3.6 is 120.00000000000001."""
    speeds = [float(v) for v in range(1, 401)]
    assert [v for v in speeds if KMH * (v / KMH) > v]
    for v in speeds:
        run = SimpleNamespace(fact=lambda name, v=v: {"speed": v / KMH}[name])
        assert observed("train_speed", run).values == {"": v}


def test_pantographs_at_the_largest_distance_are_not_too_far_apart() -> None:
    """50 - (50 - 8.6) is 8.600000000000001."""
    names = ["leading", "trailing"]
    run = SimpleNamespace(
        pantograph_names=lambda: names,
        n_rows=lambda name: 1,
        first_position=np.array([50.0, 50.0 - 8.6]),
    )
    assert run.first_position[0] - run.first_position[1] > 8.6
    assert observed("distance_ahead", run).values == {"trailing": 8.6}


def test_few_masts_have_no_gradient() -> None:
    results = at_rest(rising())
    results.evaluation = (60.0, 140.0)
    assert observed("wire_gradient", results).absent.startswith("the evaluation stretch has 1 mast")
    results.evaluation = (60.0, 160.0)
    assert observed("wire_gradient", results).values[""] == pytest.approx(2.0)
    assert "fewer than 3" in observed("wire_gradient_change", results).absent


def test_where_wires_overlap_the_lower_one_is_met() -> None:
    """Two wires that cross in height at 150 m: the head meets the lower envelope."""
    x = np.linspace(0.0, 300.0, 601)
    out = ContactProfile(
        NONE, x[:401], 5.3 + 0.005 * np.maximum(x[:401] - 150.0, 0), np.full(401, 0.2)
    )
    into = ContactProfile(
        NONE, x[200:], 5.3 + 0.005 * np.maximum(150.0 - x[200:], 0), np.full(401, -0.3)
    )
    found = wire_at_rest(at_rest(out, into))
    assert found is not None and found.y is not None
    assert np.ptp(found.height) == pytest.approx(0.0, abs=1e-12)
    # Each is met on its side alone, within the 1 mm that both are met in.
    first, second = found.y[found.y[:, 1] > 0], found.y[found.y[:, 1] < 0]
    assert first[:, 0].max() <= 150.5 and second[:, 0].min() >= 149.5
    assert observed("wire_lateral_place", at_rest(out, into)).values[""] == pytest.approx(300.0)


def test_pieces_of_a_wire_are_not_joined() -> None:
    """Between two pieces of the same wire there is none, and no sweep from one to the other."""
    x = np.concatenate([np.arange(0.0, 151.0), np.arange(150.0, 301.0)])
    y = np.concatenate([np.full(151, 0.3), np.full(151, -0.3)])
    wire = ContactProfile(np.array([151]), x, np.full(x.size, 5.3), y)
    found = wire_at_rest(at_rest(wire))
    assert found is not None and found.sweep == 0.0


def test_the_sweep_of_a_zigzag() -> None:
    """200 mm to either side, from mast to mast: 8 mm a metre, 640 mm/s at 80 m/s."""
    wire = rising()
    y = 0.2 * np.interp(wire.x, MASTS, [1, -1, 1, -1, 1, -1, 1])
    results = at_rest(wire._replace(y=y))
    assert observed("lateral_sweep", results).values[""] == pytest.approx(640.0, rel=1e-9)
    assert observed("wire_lateral_place", results).values[""] == pytest.approx(200.0)
    for name in ("lateral_sweep", "wire_lateral_place"):
        assert observed(name, at_rest(wire)).absent == "no contact wire moves sideways in this run"


@pytest.mark.study
def test_bending_strain_is_that_of_a_beam_in_finite_differences() -> None:
    """EI w'''' - (F - m v^2) w'' = P delta on 8 m between hinges, far beyond sqrt(EI / F).

    The curvature has a kink under the force, so that central differences of step h are off by a
    share of about h / (2 l), l = sqrt(EI / (F - m v^2)); half the step halves that.
    """
    force, speed, tension, mass, bending = 250.0, 70.0, 20e3, 1.07, 137.0
    axial = 4.0 * bending / 6.2e-3**2  # radius of 6.2 mm
    exact = bending_strain(force, speed, tension, mass, bending, axial)
    errors = []
    for n in (1600, 3200):
        h = 8.0 / n
        second = (
            np.diag(np.full(n - 1, -2.0)) + np.diag(np.ones(n - 2), 1) + np.diag(np.ones(n - 2), -1)
        ) / h**2
        load = np.zeros(n - 1)
        load[n // 2 - 1] = force / h
        w2 = np.linalg.solve(bending * second - (tension - mass * speed**2) * np.eye(n - 1), load)
        errors.append(abs(np.abs(w2).max() * 6.2e-3 / exact - 1.0))
    length = math.sqrt(bending / (tension - mass * speed**2))
    assert errors[0] < (8.0 / 1600) / (2 * length) and errors[1] < 0.6 * errors[0]


def strain_of(**changes: float) -> Any:
    facts = {
        "contact_wire_tension": 20e3,
        "contact_wire_mass": 1.07,
        "contact_wire_bending_stiffness": 137.0,
        "contact_wire_axial_stiffness": 1.4e7,
        "contact_wire_lost_section": 0.0,
        "speed": 70.0,
        **changes,
    }
    results = SimpleNamespace(
        facts_of_wires=lambda name: {"contact_wire": facts[name]}, fact=facts.__getitem__
    )
    one = SimpleNamespace(stat_max=250.0, complaint="", unjudged="")
    return observed("contact_wire_strain", results, pantographs=[one])


def test_strain_is_judged_where_its_data_are_known() -> None:
    found = strain_of().values[""]
    assert found == pytest.approx(1e6 * bending_strain(250.0, 70.0, 20e3, 1.07, 137.0, 1.4e7))
    assert 300.0 < found < 700.0  # what copper wires of 120 mm2 have in line tests
    unknown = "the axial or bending stiffness of the wire is not known"
    assert strain_of(contact_wire_axial_stiffness=math.nan).absent == unknown
    assert strain_of(contact_wire_bending_stiffness=0.0).absent == unknown
    unknown = "how far the contact wire is worn is not known"
    assert strain_of(contact_wire_lost_section=math.nan).absent == unknown
    assert strain_of(speed=137.0).absent == "the train is faster than waves of the contact wire"


def test_strain_of_a_worn_wire_is_that_of_its_section() -> None:
    """A half round: EI is R^4 (pi / 8 - 8 / 9 pi) E, its top 1 - 4 / 3 pi of R above its axis."""
    radius, bending, tension, mass, speed = 6.2e-3, 137.0, 20e3, 1.07, 70.0
    half = bending * (math.pi / 8 - 8 / (9 * math.pi)) / (math.pi / 4)
    curvature = 250.0 / (2 * math.sqrt(half * (tension - 0.5 * mass * speed**2)))
    expected = 1e6 * curvature * (1 - 4 / (3 * math.pi)) * radius
    axial = 4 * bending / radius**2
    worn = strain_of(contact_wire_axial_stiffness=axial, contact_wire_lost_section=0.5).values[""]
    assert worn == pytest.approx(expected, rel=1e-9)
    new = strain_of(contact_wire_axial_stiffness=axial).values[""]
    assert 1.4 * new < worn < 1.6 * new


def test_tension_is_the_largest_at_ends_of_contact_wires() -> None:
    """Where wires move along the track; otherwise the one at the start."""
    own: dict[str, Any] = {
        "roles": {"messenger": Role.MESSENGER, "contact": Role.CONTACT},
        "line": lambda name: np.array([0, 0, 1, 1]),
        "n_rows": lambda name: 10,
        "extremes": lambda name: np.array([[0.0] * 4, [30e3, 31e3, 19e3, 22e3]]),
        "facts_of_wires": lambda name: {"contact": 20e3},
    }
    along = SimpleNamespace(has=lambda name: name == TENSION, **own)
    still = SimpleNamespace(has=lambda name: False, **own)
    assert observed("contact_wire_tension", along).values[""] == 22e3
    assert observed("contact_wire_tension", still).values[""] == 20e3


def test_quantities_of_a_recorded_run(run_folder: Path, march: Any) -> None:
    with Results(run_folder) as results:
        found = statistics.evaluate(results)
        seen = observe(QUANTITIES, results, found)
        force = results.channel("dropper_force")
        inside = found.droppers.evaluated
    assert set(seen) == set(QUANTITIES)
    assert seen["distance_ahead"].values == {"trailing": pytest.approx(100.0)}
    assert seen["train_speed"].values[""] == pytest.approx(300.0)
    assert seen["mean_force"].values.keys() == {"leading", "trailing"}
    assert seen["dropper_compression"].values[""] == 0.5
    assert seen["elasticity_variation"].values[""] == pytest.approx(100 * 0.12 / 0.78)
    for name in ("strip_place", "wire_lateral_place", "lateral_sweep"):
        assert seen[name].absent == "no contact wire moves sideways in this run"
    # How often each dropper begins to be slack, counted one by one.
    begun = [
        sum(slack for slack, _ in itertools.groupby((column <= 0.0).tolist()))
        for column in force[:, inside].T
    ]
    assert seen["dropper_slackenings"].values[""] == max(begun) >= 2


def test_every_reader_of_a_run_tells_the_same_list(
    tmp_path: Path, make_march: Any, record_run: Any
) -> None:
    """Summary, report and comparison, of all shipped books and one of the scene's own."""
    march = make_march(separations=(0.0,), n_steps=3750, dt=2e-3)
    limits = {"uplift_space_mm": 200.0, "dropper_slackenings": 1.0}
    rules = [*(key for key in shipped() if key != "en50367:2006"), OWN_BOOK]
    record_run(tmp_path / "run.h5", march, attributes={"rules": rules, "limits": limits})
    written = write_report(tmp_path, tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text())
    with Results(tmp_path) as results:
        criteria = criteria_of(results, statistics.evaluate(results))
    assert {c.book for c in criteria} == {*rules[:-1], "mine"}
    rows = [(c.book, c.rule, c.passed) for c in criteria if not c.absent]
    assert [(r["book"], r["rule"], r["passed"]) for r in summary["acceptance"]] == rows
    left = [(c.book, c.rule, c.because) for c in criteria if c.absent]
    assert [(r["book"], r["rule"], r["because"]) for r in summary["not_judged"]] == left
    assert len(rows) >= 15 and all(because for *_, because in left)
    assert summary["passed"] is written.verdict is False
    page = (tmp_path / "report.html").read_text()
    text = compare(tmp_path, tmp_path)
    for one in criteria:
        assert _escaped(f"{one.criterion} ({one.book})") in page, one
        assert f"{one.criterion} ({one.book})" in text
        assert not one.because or _escaped(one.because) in page
    assert page.count("not compared with the text") >= sum(not c.compared for c in criteria) - len(
        left
    )
    assert by_rule(criteria, "mine")["sigma"].passed is False
    uplift = by_rule(criteria, "tsi_ene:2023")["uplift_space"]
    assert (uplift.limit, uplift.passed) == (100.0, True)
    assert by_rule(criteria, "line")["dropper_slackenings"].limit == 1.0
    assert "edition" not in summary


def test_of_a_part_of_the_passage_limits_are_exceeded_but_not_kept(
    tmp_path: Path, make_march: Any, record_run: Any
) -> None:
    """Uplift and droppers' forces grow as pantographs pass: half a passage proves no maximum."""
    march = make_march(separations=(0.0,), n_steps=1500, dt=2e-3)
    for limit, verdict in ((1.0, False), (400.0, None)):
        about = {"rules": ["line"], "limits": {"uplift_space_mm": limit, "dropper_force_N": limit}}
        record_run(tmp_path / "run.h5", march, attributes=about)
        with Results(tmp_path) as results:
            found = by_rule(criteria_of(results, statistics.evaluate(results)), "line")
        for rule in ("uplift_space", "dropper_force"):
            assert found[rule].passed is verdict and found[rule].value > 1.0
            reason = "" if verdict is False else "the record does not cover the evaluation stretch"
            assert found[rule].because == reason


@pytest.mark.parametrize(("effects", "limit"), [([], 90.0), (["uplift_stops"], 120.0)])
def test_a_stop_is_seen_by_its_effect(
    tmp_path: Path, make_march: Any, record_run: Any, effects: list[str], limit: float
) -> None:
    march = make_march(separations=(0.0,), n_steps=100)
    on = [(name, name, "default") for name in ("vertical", *effects)]
    about = {"rules": ["line"], "limits": {"uplift_space_mm": 180.0}, "effects_on": on}
    record_run(tmp_path / "run.h5", march, attributes=about)
    with Results(tmp_path) as results:
        criteria = criteria_of(results, statistics.evaluate(results))
    assert by_rule(criteria, "line")["uplift_space"].limit == limit
    assert "uplift_stops" in registry()


def by_rule(criteria: list[Criterion], book: str) -> dict[str, Criterion]:
    return {c.rule: c for c in criteria if c.book == book}


def _escaped(text: str) -> str:
    return (
        text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace("'", "&#39;")
    )


def test_a_file_before_there_were_rule_books_is_judged_by_its_edition(
    tmp_path: Path, record_run: Any, march: Any
) -> None:
    record_run(tmp_path / "run.h5", march)
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        for name in ("rules", "limits", ATTRIBUTE_SUMS):
            file.attrs.pop(name, None)
        file.attrs["edition"] = "2012"
    with Results(tmp_path) as results:
        criteria = criteria_of(results, statistics.evaluate(results))
    assert {c.book for c in criteria} == {"en50367:2012"}
