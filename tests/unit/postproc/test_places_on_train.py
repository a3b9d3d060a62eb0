"""Pantographs are called by their places on the train."""

from __future__ import annotations

import pytest

from catenary.postproc.channels.header import in_sentence, places_on_train


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
