"""A hunt for runs that run away without a word: random scenes at the bounds of the schema.

Each is run with its step and with a quarter of it. Where the line gets many times the energy, or
turns many times as far, in the longer steps, the run must have been ended or have told what decides
its results. FUZZ_SEED and FUZZ_CASES choose the seeds; a failure names its own.
"""

from __future__ import annotations

import os
from typing import NamedTuple

import pytest
from fuzzing import extreme_scene
from scenes import with_words

import catenary

pytestmark = pytest.mark.study

FIRST = int(os.environ.get("FUZZ_SEED", "1"))
CASES = int(os.environ.get("FUZZ_CASES", "40"))
BLOCK = 20
BLOCKS = [
    range(first, min(first + BLOCK, FIRST + CASES)) for first in range(FIRST, FIRST + CASES, BLOCK)
]
# Steps of four times the length differ by some ten per cent where they resolve what happens, and by
# a factor where contacts hop by chance; a march that runs away gains decades.
WILDLY = 10.0
# Remarks that say that a run may run away; those on mesh, step and statistics excuse nothing.
TELLING = (
    "The time integration makes energy",
    "they give the line energy",
    "does not resolve its hops",
    "has turned by",
    "is lifted by",
    "touches no wire",
    "has not touched a wire",
)
# Energies and rotations below these are no motion to speak of [J], [rad].
LITTLE_ENERGY, LITTLE_ROTATION = 10.0, 0.02


class Seen(NamedTuple):
    """How a run ended, what it told, and the largest energy [J] and rotation [rad] of the line."""

    outcome: str
    remarks: list[str]
    energy: float
    rotation: float


def seen(scene: catenary.Scene) -> Seen:
    try:
        run = catenary.run(scene, force=True)
    except catenary.RunBroken as error:
        if error.run is None:
            raise
        run = error.run
    watched = run.summary.get("watched", {})
    remarks = run.summary.get("remarks", [])
    return Seen(
        run.outcome,
        [text for text in remarks if any(words in text for words in TELLING)],
        watched.get("most_line_energy_J", 0.0),
        watched.get("largest_rotation_rad", 0.0),
    )


def judged(seed: int) -> str:
    """How a scene ended; AssertionError if it ran away without a word."""
    made = extreme_scene(seed)
    dt = float(dict(word.split("=", 1) for word in made.assignments)["numerics.dt_s"])
    few = ("output.field_every_s=0", "output.energy_every_s=0")
    try:
        whole = with_words(made.base, [*made.assignments, *few])
        fine = whole.replace(numerics={"dt_s": dt / 4})
        one = seen(whole)
    except (catenary.InputError, catenary.RunBroken) as error:
        assert "\n" not in str(error)
        return "refused"
    if one.outcome != "done":
        return "ended"
    if one.remarks:
        return "told"
    four = seen(fine)
    if four.outcome != "done":
        return "ended with a quarter of the step"
    assert one.energy <= WILDLY * max(four.energy, LITTLE_ENERGY), (one, four)
    assert one.rotation <= WILDLY * max(four.rotation, LITTLE_ROTATION), (one, four)
    return "alike"


@pytest.mark.parametrize("seeds", BLOCKS, ids=str)
def test_nothing_runs_away_without_a_word(seeds: range) -> None:
    ends: dict[str, int] = {}
    for seed in seeds:
        try:
            how = judged(seed)
        except (Exception, AssertionError) as error:
            replay = f"FUZZ_SEED={seed} FUZZ_CASES=1 replays it"
            raise AssertionError(replay) from error
        ends[how] = ends.get(how, 0) + 1
    print(ends)
    assert sum(ends.values()) > ends.get("refused", 0)
