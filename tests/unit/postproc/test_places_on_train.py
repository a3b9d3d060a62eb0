"""Pantographs are called by their places on the train."""

from __future__ import annotations

import pytest

from catenary.postproc.evaluate.statistics import LateralRange, left_strips_sentence
from catenary.postproc.files.header import in_sentence, places_on_train


@pytest.mark.parametrize(
    ("n", "called"),
    [
        (1, ["the pantograph"]),
        (2, ["the leading pantograph", "the trailing pantograph"]),
        (3, ["the leading pantograph", "pantograph no. 2", "the trailing pantograph"]),
    ],
)
def test_a_sentence_calls_a_pantograph_by_its_place(n: int, called: list[str]) -> None:
    assert [in_sentence(place) for place in places_on_train(n)] == called


def test_a_pantograph_whose_strips_a_wire_leaves_is_called_so_too() -> None:
    second = places_on_train(3)[1]
    left = LateralRange(second, -0.9, 2.0, 150.0, 0.8, left_time=1.5, left_x=125.0)
    assert "leaves the strips of pantograph no. 2, which end 0.8 m" in left_strips_sentence(left)
