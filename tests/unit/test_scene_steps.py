"""Keys of steps that adapt: what they become, and what is refused."""

from __future__ import annotations

import pytest
from scenes import load_scene, problem_of

from catenary import InputError

GIVEN = ("numerics.adaptive_tolerance_N=0.5", "numerics.smallest_dt_s=1e-4")


def test_keys_reach_the_problem() -> None:
    numerics = problem_of(load_scene("en50318_2002", GIVEN)).numerics
    assert (numerics.adaptive_tolerance, numerics.smallest_dt) == (0.5, 1e-4)
    plain = problem_of(load_scene("en50318_2002")).numerics
    assert (plain.adaptive_tolerance, plain.smallest_dt) == (None, None)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (GIVEN[1:], "must not have smallest_dt_s without adaptive_tolerance_N"),
        ((GIVEN[0], "numerics.smallest_dt_s=6e-4"), "from dt_s / 4096 to dt_s / 2"),
        ((GIVEN[0], "numerics.smallest_dt_s=2e-7"), "from dt_s / 4096 to dt_s / 2"),
        (("numerics.adaptive_tolerance_N=0",), "greater than 0"),
        (
            (*GIVEN, "contact.law=kinematic", "contact.stiffness_N_per_m=",
             "numerics.newmark_gamma=0.55", "numerics.newmark_beta=0.28"),
            "contact.law kinematic has no stiffness to estimate an error with",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(words: tuple[str, ...], says: str) -> None:
    with pytest.raises(InputError, match=says):
        load_scene("en50318_2002", words)
