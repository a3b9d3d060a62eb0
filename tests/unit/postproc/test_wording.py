"""Numbers as people read them."""

from __future__ import annotations

import math

import pytest

from catenary.postproc.evaluate.wording import counted, duration, fixed, of_digits


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (-1e-9, 4, "0.0000"),
        (-0.0, 0, "0"),
        (-0.04, 1, "0.0"),
        (-0.05001, 1, "-0.1"),
        (-10.0, 1, "-10.0"),
        (100.0, 0, "100"),
        (math.nan, 2, "nan"),
        (-math.inf, 2, "-inf"),
    ],
)
def test_zero_has_no_sign(value: float, digits: int, text: str) -> None:
    assert fixed(value, digits) == text


def test_one_is_singular() -> None:
    assert [counted(n, "rank") for n in (0, 1, 2)] == ["0 ranks", "1 rank", "2 ranks"]


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(0.83, "0.83 s"), (42.0, "42 s"), (200.0, "3.3 min"), (5300.0, "88 min"), (7560.0, "2.1 h")],
)
def test_times_have_two_digits(seconds: float, said: str) -> None:
    assert duration(seconds) == said


def test_large_numbers_have_no_powers_of_ten() -> None:
    given = (12614.0, 1100.4, 342.4, 0.00874, 0.0)
    assert [of_digits(value, 3) for value in given] == ["12600", "1100", "342", "0.00874", "0"]
