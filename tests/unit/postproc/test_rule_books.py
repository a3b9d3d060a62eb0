"""Rule books of users: what a book may say, and the one sentence about each fault."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from catenary import InputError
from catenary.postproc.evaluate.observations import OBSERVED
from catenary.postproc.standards.rule_books import QUANTITIES, Conditions, book_of, shipped

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
