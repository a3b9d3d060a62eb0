"""Rule books: every criterion at, below and above its limit, and books of users."""

from __future__ import annotations

import copy
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catenary import InputError
from catenary.postproc.evaluate.observations import OBSERVED, Observation
from catenary.postproc.evaluate.verdict import (
    Criterion,
    judge,
    judged_by,
    labels,
    quantities_of,
    verdict,
)
from catenary.postproc.standards.rule_books import (
    PANTOGRAPH,
    QUANTITIES,
    Conditions,
    book_named,
    book_of,
    books_of_entries,
    shipped,
)

# --- acceptance -----------------------------------------------------------------------------------


# A run that satisfies every book; the wave speed is in km/h, strips are 1.2 m long.
GOOD = {
    "mean_force": 150.0,
    "force_std": 40.0,
    "force_max": 260.0,
    "force_min": 40.0,
    "force_stat_max": 270.0,
    "force_stat_min": 30.0,
    "contact_height_range": 50.0,
    "arcing": 0.0,
    "strip_place": 300.0,
    "strip_half_length": 600.0,
    "distance_ahead": 100.0,
    "arm_uplift": 60.0,
    "train_speed": 300.0,
    "wave_speed": 441.0,
    "wire_height_max": 5100.0,
    "wire_height_min": 5090.0,
    "wire_gradient": 0.0,
    "wire_gradient_change": 0.0,
    "wire_lateral_place": 200.0,
    "lateral_sweep": 400.0,
    "elasticity_variation": 10.0,
    "dropper_force_max": 500.0,
    "dropper_compression": 0.0,
    "dropper_slackenings": 3.0,
    "contact_wire_tension": 27e3,
    "contact_wire_strain": 300.0,
}
KEYS = {
    "uplift_space_mm": 180.0,
    "working_width_mm": 800.0,
    "wire_lateral_place_mm": 250.0,
    "wire_height_min_mm": 5000.0,
    "wire_height_max_mm": 5500.0,
    "lateral_sweep_mm_per_s": 330.0,
    "elasticity_variation_percent": 12.0,
    "arcing_percent": 0.4,
    "dropper_force_N": 2000.0,
    "dropper_compression_N": 20.0,
    "dropper_slackenings": 5.0,
    "contact_wire_tension_N": 30e3,
    "contact_wire_strain_um_per_m": 450.0,
}
# Book, criterion, supply, speed [km/h], limit. Curves by hand: 0.00097 * 300^2 + 70 = 157.3.
LIMITS = [
    *(
        row
        for year in ("2006", "2012", "2020")
        for row in (
            (f"en50367:{year}", "mean_force", "ac", 300.0, 157.3),
            (f"en50367:{year}", "mean_force", "ac", 200.0, 108.8),
            (f"en50367:{year}", "mean_force", "ac", 160.0, 102.032),
            (f"en50367:{year}", "mean_force", "dc_3kv", 200.0, 148.8),
            (f"en50367:{year}", "mean_force", "dc_1500v", 100.0, 149.7),
            (f"en50367:{year}", "std_of_mean", "ac", 300.0, 45.0),
            (f"en50367:{year}", "std_of_allowed_mean", "ac", 300.0, 47.19),
            (f"en50367:{year}", "contact_height_range", "ac", 300.0, 80.0),
            (f"en50367:{year}", "arcing", "dc_3kv", 100.0, 0.2),
            (f"en50367:{year}", "strip_place", "ac", 300.0, 600.0),
            (f"en50367:{year}", "arm_uplift", "ac", 300.0, 120.0),
            (f"en50367:{year}", "speed", "ac", 300.0, 308.7),
        )
    ),
    ("en50367:2006", "force_max", "ac", 160.0, 350.0),
    *(
        row
        for year in ("2012", "2020")
        for row in (
            (f"en50367:{year}", "force_max", "ac", 200.0, 300.0),
            (f"en50367:{year}", "force_max", "ac", 200.01, 350.0),
            (f"en50367:{year}", "force_max", "dc_3kv", 250.0, 400.0),
            (f"en50367:{year}", "force_min", "ac", 300.0, 0.0),
            (f"en50367:{year}", "mean_force_lower", "ac", 300.0, 102.3),
        )
    ),
    ("en50119:2020", "force_stat_max", "ac", 200.0, 300.0),
    ("en50119:2020", "force_stat_max", "ac", 320.0, 350.0),
    ("en50119:2020", "force_stat_max", "ac", 321.0, 400.0),
    ("en50119:2020", "force_stat_max", "dc_1500v", 201.0, 400.0),
    ("en50119:2020", "force_stat_min", "ac", 300.0, 0.0),
    ("en50119:2020", "uplift_space", "ac", 300.0, 90.0),
    ("en50119:2020", "wire_gradient", "ac", 100.0, 6.0),
    ("en50119:2020", "wire_gradient", "ac", 250.0, 1.0),
    ("en50119:2020", "wire_gradient", "ac", 300.0, 0.0),
    ("en50119:2020", "wire_gradient_change", "ac", 120.0, 2.0),
    ("en50119:2020", "speed", "ac", 300.0, 308.7),
    ("en50119:2020", "contact_wire_tension", "ac", 300.0, 30e3),
    ("tsi_ene:2023", "mean_force", "ac", 300.0, 157.3),
    ("tsi_ene:2023", "std_of_mean", "ac", 300.0, 45.0),
    ("tsi_ene:2023", "arcing", "ac", 160.0, 0.1),
    ("tsi_ene:2023", "arcing", "ac", 249.0, 0.1),
    ("tsi_ene:2023", "arcing", "ac", 250.0, 0.2),
    ("tsi_ene:2023", "arcing", "dc_3kv", 160.0, 0.1),
    ("tsi_ene:2023", "arcing", "dc_3kv", 200.0, 0.2),
    ("tsi_ene:2023", "uplift_space", "ac", 300.0, 90.0),
    ("tsi_ene:2023", "distance_ahead", "ac", 80.0, 8.0),
    ("tsi_ene:2023", "distance_ahead", "ac", 120.0, 15.0),
    ("tsi_ene:2023", "distance_ahead", "ac", 249.0, 85.0),
    ("tsi_ene:2023", "distance_ahead", "ac", 250.0, 200.0),
    ("tsi_ene:2023", "wire_height_min", "ac", 250.0, 5080.0),
    ("tsi_ene:2023", "wire_height_min", "ac", 200.0, 5000.0),
    ("tsi_ene:2023", "wire_height_max", "ac", 250.0, 5300.0),
    ("tsi_ene:2023", "wire_height_max", "ac", 200.0, 6200.0),
    ("tsi_ene:2023", "wire_lateral_place", "ac", 300.0, 250.0),
    ("tsi_ene:2023", "working_width", "ac", 300.0, 400.0),
    ("tsi_loc_pas:2023", "mean_force", "dc_3kv", 200.0, 148.8),
    ("tsi_loc_pas:2023", "std_of_mean", "ac", 300.0, 45.0),
    ("tsi_loc_pas:2023", "arcing", "ac", 160.0, 0.1),
    ("ife:2023", "force_stat_max", "ac", 321.0, 400.0),
    ("ife:2023", "force_stat_min", "ac", 300.0, 0.0),
    ("ife:2023", "std_of_mean", "ac", 300.0, 45.0),
    ("ife:2023", "uplift_space", "ac", 300.0, 90.0),
    ("ife:2023", "wire_gradient", "ac", 300.0, 0.4),
    ("ife:2023", "wire_gradient_change", "ac", 160.0, 1.0),
    ("ife:2023", "wire_height_min", "ac", 300.0, 5080.0),
    ("ife:2023", "wire_height_max", "ac", 200.0, 6000.0),
    ("iec62486:2017", "mean_force", "ac", 300.0, 157.3),
    ("iec62486:2017", "std_of_mean", "ac", 300.0, 45.0),
    ("iec62486:2017", "std_of_allowed_mean", "ac", 300.0, 47.19),
    ("iec62486:2017", "force_stat_min", "ac", 300.0, 0.0),
    ("iec62486:2017", "arcing", "ac", 300.0, 0.2),
    ("iec62486:2017", "uplift_space", "ac", 300.0, 90.0),
    ("tb_t_3271:2011", "mean_force", "ac", 300.0, 157.3),
    ("tb_t_3271:2011", "std_of_mean", "ac", 300.0, 45.0),
    ("tb_t_3271:2011", "force_stat_min", "ac", 300.0, 0.0),
    ("tb_t_3271:2011", "uplift_space", "ac", 300.0, 90.0),
    ("tb_t_3271:2011", "elasticity_variation", "ac", 300.0, 12.0),
    ("gb_t_32592:2016", "arcing", "ac", 300.0, 0.2),
    ("gb_t_32592:2016", "arcing", "ac", 299.0, 0.4),
    ("bane_nor:2020", "wire_height_min", "ac", 200.0, 5070.0),
    ("bane_nor:2020", "wire_height_max", "ac", 200.0, 5130.0),
    ("bane_nor:2020", "distance_ahead", "ac", 121.0, 85.0),
    ("jr", "contact_wire_strain", "ac", 270.0, 500.0),
    ("line", "uplift_space", "ac", 300.0, 90.0),
    ("line", "working_width", "ac", 300.0, 400.0),
    ("line", "wire_lateral_place", "ac", 300.0, 250.0),
    ("line", "wire_height_min", "ac", 300.0, 5000.0),
    ("line", "wire_height_max", "ac", 300.0, 5500.0),
    ("line", "lateral_sweep", "ac", 300.0, 330.0),
    ("line", "elasticity_variation", "ac", 300.0, 12.0),
    ("line", "dropper_force", "ac", 300.0, 2000.0),
    ("line", "dropper_compression", "ac", 300.0, 20.0),
    ("line", "dropper_slackenings", "ac", 300.0, 5.0),
    ("line", "contact_wire_tension", "ac", 300.0, 30e3),
    ("line", "contact_wire_strain", "ac", 300.0, 450.0),
    ("line", "arcing", "ac", 300.0, 0.4),
]
ONE = ("pantograph",)


def observed(values: dict[str, float], names: tuple[str, ...] = ONE) -> dict[str, Observation]:
    """Quantities of a run, the same for every pantograph."""
    return {
        name: Observation(
            dict.fromkeys(names, value) if QUANTITIES[name].per == PANTOGRAPH else {"": value}
        )
        for name, value in values.items()
    }


def judged(
    book: str,
    values: dict[str, float] | None = None,
    supply: str = "ac",
    speed: float = 300.0,
    keys: dict[str, float] = KEYS,
    **observations: Observation,
) -> dict[str, Criterion]:
    seen = observed({**GOOD, "train_speed": speed, **(values or {})}) | observations
    criteria = judge([book_named(book)], seen, Conditions(speed, supply), keys, ONE)
    assert len({c.rule for c in criteria}) == len(criteria)
    return {c.rule: c for c in criteria}


def test_the_table_has_every_criterion_of_every_book() -> None:
    there = {(book.key, rule.id) for book in shipped().values() for rule in book.criteria}
    assert there == {row[:2] for row in LIMITS}
    assert len({book for book, _ in there}) >= 5 and len(there) >= 15


def test_a_run_that_is_good_passes_every_book() -> None:
    for key in shipped():
        found = judged(key)
        assert [c.rule for c in found.values() if not c.passed] == [], key
        assert verdict(list(found.values())) is True


@pytest.mark.parametrize(("book", "rule", "supply", "speed", "limit"), LIMITS)
def test_a_criterion_at_below_and_above_its_limit(
    book: str, rule: str, supply: str, speed: float, limit: float
) -> None:
    entry = book_named(book).rule(rule)
    found = judged(book, supply=supply, speed=speed)[rule]
    # The limits are worked out in another order of operations: rounding, no more.
    assert found.limit == pytest.approx(limit, rel=1e-14, abs=1e-13)
    assert found.unit == QUANTITIES[entry.quantity].unit and found.book == book
    # Of what is itself in its limit the limit moves along; the mean stands apart from sigma.
    at, below, above = found.limit, np.nextafter(found.limit, -1e9), np.nextafter(found.limit, 1e9)
    met = {"<=": (True, True, False), "<": (False, True, False)}
    met |= {">=": (True, False, True), ">": (False, False, True)}
    for value, passes in zip((at, below, above), met[entry.relation], strict=True):
        again = judged(book, {entry.quantity: float(value)}, supply, speed)[rule]
        assert again.passed is passes, (value, again)
        assert again.limit == found.limit


@pytest.mark.parametrize(("book", "rule", "supply", "speed", "limit"), LIMITS)
def test_a_criterion_without_data_says_why_and_does_not_count(
    book: str, rule: str, supply: str, speed: float, limit: float
) -> None:
    entry = book_named(book).rule(rule)
    lost = Observation(absent="nobody looked")
    found = judged(book, supply=supply, speed=speed, **{entry.quantity: lost})
    one = found[rule]
    assert (one.passed, one.absent, one.because) == (None, True, "nobody looked")
    assert np.isnan(one.value) and np.isnan(one.limit)
    others = [c for c in found.values() if not c.absent]
    assert verdict(list(found.values())) is verdict(others)
    # Where the limit is the scene's own, it may be absent as well.
    for row in entry.limit:
        if row.of_key and row is entry.row(Conditions(speed, supply)):
            one = judged(book, supply=supply, speed=speed, keys={})[rule]
            assert one.because == f"the scene has no evaluation.limits.{row.of_key}"
            assert (one.passed, one.absent) == (None, True)


def test_a_supply_that_a_book_lacks_is_not_judged() -> None:
    one = judged("en50367:2020", supply="dc_3kv", speed=200.0)["mean_force_lower"]
    assert (one.passed, one.absent) == (None, True)
    assert one.because == "the book has no limit for DC 3 kV at 200 km/h"


def test_a_stop_allows_more_of_the_space() -> None:
    """1.5 S0 in place of 2 S0: 180 mm / 1.5 = 120 mm."""
    conditions = Conditions(300.0, "ac", stops=True)
    for key in ("tsi_ene", "en50119", "line"):
        criteria = judge([book_named(key)], observed(GOOD), conditions, KEYS, ONE)
        (one,) = [c for c in criteria if c.rule == "uplift_space"]
        assert one.limit == 120.0 and one.passed


def test_a_speed_from_metres_a_second_is_the_whole_one() -> None:
    """200 km/h comes from 55.555... m/s with a rounding error, and 250 km/h is not below 250."""
    for bound, rule, book, limit in ((200.0, "force_max", "en50367", 300.0),):
        for speed in (np.nextafter(bound, 0), bound, np.nextafter(bound, 999)):
            assert judged(book, speed=float(speed))[rule].limit == limit
    for speed in (np.nextafter(250.0, 0), 250.0, np.nextafter(250.0, 999)):
        assert judged("tsi_ene", speed=float(speed))["arcing"].limit == 0.2


def test_limits_of_the_strips_are_those_of_the_pantograph_itself() -> None:
    seen = observed(GOOD, ("leading", "trailing"))
    seen["strip_half_length"] = Observation({"trailing": 250.0})
    criteria = judge(
        [book_named("en50367")], seen, Conditions(300.0, "ac"), {}, ("leading", "trailing")
    )
    first, second = (c for c in criteria if c.rule == "strip_place")
    assert first.absent and first.because == "there is no strip_half_length of this pantograph"
    assert second.passed is False and second.criterion.endswith(", trailing")


def test_every_pantograph_is_judged_under_its_name() -> None:
    seen = observed(GOOD, ("leading", "trailing"))
    seen["force_std"] = Observation({"leading": 40.0, "trailing": 60.0})
    seen["distance_ahead"] = Observation({"trailing": 100.0})
    criteria = judge(
        [book_named("en50367:2006"), book_named("tsi_ene")],
        seen,
        Conditions(300.0, "ac"),
        KEYS,
        ("leading", "trailing"),
    )
    assert len(criteria) == 2 * 7 + 2 + 2 * 4 + 1 + 4
    named = labels(criteria)
    assert (
        len(set(named)) == len(named) and named[0] == "mean contact force, leading (en50367:2006)"
    )
    failed = [c.criterion for c in criteria if c.passed is False]
    assert failed == [
        "standard deviation, 0.3 of the mean, trailing",
        "standard deviation, 0.3 of the allowed mean, trailing",
        "standard deviation, 0.3 of the mean, trailing",
    ]
    (apart,) = [c for c in criteria if c.rule == "distance_ahead"]
    assert apart.criterion == "distance to the pantograph ahead, trailing"


def test_what_has_no_value_in_the_record_leaves_the_verdict_open() -> None:
    lost = Observation({"pantograph": np.nan}, {"pantograph": "too short"})
    found = judged("en50367:2006", mean_force=lost)
    assert (found["mean_force"].passed, found["mean_force"].absent) == (None, False)
    assert found["mean_force"].because == "too short"
    # Its limit has no value either.
    assert found["std_of_mean"].passed is None and not found["std_of_mean"].absent
    assert found["std_of_allowed_mean"].passed is True
    assert verdict(list(found.values())) is None


def test_nothing_of_a_pantograph_passes_by_statistics_that_judge_nothing() -> None:
    """A force that is zero all the way is below every limit; the line is judged all the same."""
    book = book_named("en50367:2006")
    seen = observed({**GOOD, "mean_force": 0.0, "force_std": 0.0, "force_max": 0.0})
    forces = [n for n in quantities_of([book]) if QUANTITIES[n].per == PANTOGRAPH]
    for name in set(forces) - {"strip_place", "strip_half_length"}:
        seen[name] = replace(seen[name], unjudged={"pantograph": "zero all the way"})
    criteria = judge([book], seen, Conditions(300.0, "ac"), {}, ONE)
    judged_ones = [c.rule for c in criteria if c.passed is not None]
    assert judged_ones == ["strip_place", "arm_uplift", "speed"]
    assert verdict(criteria) is None


def test_nothing_is_passed_where_nothing_is_judged() -> None:
    found = judged("line", keys={})
    assert verdict(list(found.values())) is None
    assert all(c.absent for c in found.values())


def test_the_rule_on_speed_says_where_it_is_taken_over() -> None:
    """EN 50119 states it for tensioned wires; a conductor rail is judged by its slowest wave."""
    noted = Observation({"": 441.0}, note="C of the slowest bending wave (assumed)")
    one = judged("en50367", wave_speed=noted)["speed"]
    assert one.passed is True
    assert one.clause == "EN 50119: V <= 0.7 C; C of the slowest bending wave (assumed)"
    assert judged("en50367")["speed"].clause == "EN 50119: V <= 0.7 C"


def test_the_verdict_counts_what_it_rests_on() -> None:
    on_ac: Any = SimpleNamespace(attributes={"system": "ac"})
    criteria = list(judged("tsi_ene", {"arcing": 0.3}, keys={}).values())
    assert judged_by(on_ac, criteria) == (
        "TSI Energy (EU) 1301/2014, 2023 (AC): 5 of 6 criteria passed, 3 not judged; 6 of 6 "
        "limits not compared with the text of their standard"
    )
    mixed = [*criteria, *judged("bane_nor").values()]
    # Which of several books a line fails is told: their titles hold commas.
    assert judged_by(on_ac, mixed) == (
        "TSI Energy (EU) 1301/2014, 2023 (5 of 6) and Bane NOR, teknisk regelverk, System 25 "
        "(3 of 3) (AC): 8 of 9 criteria passed, 3 not judged; 6 of 9 limits not compared with the "
        "text of their standard"
    )


@pytest.mark.parametrize("name", ["en50367:1999", "en5036", "", "EN50367", "../books/line"])
def test_an_unknown_book_is_an_input_error(name: str) -> None:
    with pytest.raises(InputError, match="it must be one of|It must be one of"):
        book_named(name)


def test_a_name_alone_is_the_newest_edition() -> None:
    assert book_named("en50367").key == "en50367:2020"
    assert book_named("line").key == "line"
    with pytest.raises(InputError, match="en50367:2020 is named twice"):
        books_of_entries(["en50367", "en50367:2020"])


# --- rule books of users --------------------------------------------------------------------------


BOOK: dict[str, Any] = {
    "name": "mine",
    "title": "My line",
    "criteria": [
        {
            "id": "mean",
            "title": "mean force",
            "quantity": "mean_force",
            "relation": "<=",
            "limit": [{"supply": ["ac"], "up_to_km_h": 200, "value": 120}, {"value": 150}],
        },
        {
            "id": "sigma",
            "title": "sigma",
            "quantity": "force_std",
            "relation": "<",
            "limit": {"of_limit": "mean", "times": 0.25},
        },
    ],
}


def changed(*path: str | int, to: Any) -> dict[str, Any]:
    """The book with another value at a place; ``None`` takes it away."""
    book = copy.deepcopy(BOOK)
    here: Any = book
    for part in path[:-1]:
        here = here[part]
    if to is None:
        del here[path[-1]]
    else:
        here[path[-1]] = to
    return book


def limit(**row: Any) -> dict[str, Any]:
    return changed("criteria", 1, "limit", to=row)


def test_quantities_are_taken_from_runs_under_the_same_names() -> None:
    assert list(OBSERVED) == list(QUANTITIES)


def test_every_quantity_is_judged_or_limits_in_a_shipped_book() -> None:
    rules = [rule for book in shipped().values() for rule in book.criteria]
    used = {rule.quantity for rule in rules}
    used |= {row.of_quantity for rule in rules for row in rule.limit if row.of_quantity}
    assert used == set(QUANTITIES)


def test_a_criterion_without_a_quantity_judges_that_of_its_id() -> None:
    table = changed("criteria", 1, "quantity", to=None)
    table["criteria"][1]["id"] = "force_std"
    assert book_of(table, "book").criteria[1].quantity == "force_std"
    table["criteria"][1]["id"] = "sigma"
    with pytest.raises(InputError, match="quantity 'sigma', but it must be one of mean_force"):
        book_of(table, "book")


def test_a_book_says_its_limits_in_words() -> None:
    book = book_of(BOOK, "book")
    assert [rule.words() for rule in book.criteria] == [
        "<= 120 N (AC, up to 200 km/h); 150 N",
        "< 0.25 x the limit of mean",
    ]


@pytest.mark.parametrize("speed", [0.0, 37.5, 300.0])
def test_a_polynomial_is_that_of_numpy(speed: float) -> None:
    coefficients = [70.0, -0.25, 0.00097, 1e-6]
    book = book_of(limit(polynomial=coefficients), "book")
    row = book.criteria[1].row(Conditions(speed, "ac"))
    assert row is not None
    expected = np.polynomial.Polynomial(coefficients)(speed)
    assert row.number(speed) == pytest.approx(expected, rel=1e-14)
    assert row.words("N") == "1e-06 v^3 + 0.00097 v^2 - 0.25 v + 70 N"


FAULTS = {
    "no name": (changed("name", to=None), "has no name"),
    "spaces": (changed("name", to="my line"), "has name = 'my line'; it "),
    "misspelt": (changed("titel", to="x"), "has an unknown key titel"),
    "no criteria": (changed("criteria", to=[]), "has criteria = []; it "),
    "criteria a number": (changed("criteria", to=3), "has criteria = 3; it "),
    "twice": (
        changed("criteria", 1, "id", to="mean"),
        "has several criteria with the id mean",
    ),
    "quantity": (
        changed("criteria", 0, "quantity", to="mean_forces"),
        "has criteria.0.quantity, which has quantity 'mean_forces', but it must be one of",
    ),
    "relation": (
        changed("criteria", 0, "relation", to="=="),
        "has criteria.0.relation = '=='; it ",
    ),
    "code": (
        limit(value="__import__('os').system('id')"),
        "has criteria.1.limit.0.value = \"__import__('os').system('id')\"; it should be a valid",
    ),
    "formula": (limit(formula="0.3*Fm"), "has an unknown key criteria.1.limit.0.formula"),
    "no form": (limit(supply=["ac"]), "needs exactly one of value, polynomial, of_quantity"),
    "two forms": (limit(value=3, of_key="uplift_space_mm"), "value and of_key are given"),
    "share of a number": (limit(value=3, times=2), "has times or over, which value does not take"),
    "supply": (limit(supply=["ac25"], value=3), "has supply 'ac25', but it must be one of ac, "),
    "bounds": (
        limit(up_to_km_h=3, below_km_h=4, value=3),
        "needs one of up_to_km_h and below_km_h, but both are given",
    ),
    "infinite": (limit(value=float("inf")), "has criteria.1.limit.0.value = inf; it "),
    "over nothing": (
        limit(of_key="dropper_force_N", over=0),
        "has criteria.1.limit.0.over = 0; it ",
    ),
    "no such key": (limit(of_key="os_environ"), "has of_key 'os_environ', but it must be one of "),
    "key in mm": (
        limit(of_key="uplift_space_mm"),
        "has a criterion sigma whose limit in N is a share of uplift_space_mm, which is in mm",
    ),
    "quantity in mm": (
        limit(of_quantity="arm_uplift"),
        "whose limit in N is a share of arm_uplift, which is in mm",
    ),
    "no such limit": (
        limit(of_limit="means"),
        "whose limit is a share of that of means, which the book does not have",
    ),
    "share of itself": (
        limit(of_limit="sigma"),
        "whose limit is a share of that of sigma, which is itself a share of a limit",
    ),
    "limit of another unit": (
        changed("criteria", 0, "quantity", to="arcing"),
        "whose limit is a share of that of mean, which is in %",
    ),
    "control character": (changed("title", to="a\x1b[31m"), "has title = "),
    "no table": ([1], "is no table"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_faulty_book_is_refused_in_one_sentence(name: str) -> None:
    book, says = FAULTS[name]
    with pytest.raises(InputError) as refused:
        book_of(book, "mine.toml")
    text = str(refused.value)
    assert text.startswith("mine.toml ") and says in text, text
    assert text.isprintable() and len(text) < 1500


def test_the_run_has_no_limit_of_each_pantograph() -> None:
    book = changed("criteria", 1, "quantity", to="dropper_force_max")
    with pytest.raises(InputError, match="that of mean, which each pantograph has"):
        book_of(book, "mine.toml")
