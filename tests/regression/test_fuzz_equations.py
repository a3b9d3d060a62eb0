"""Every state of random marches, put into the equations of motion.

FUZZ_SEED and FUZZ_CASES are those of `test_fuzz.py`.
"""

from __future__ import annotations

import os

import pytest
from equations import residual_of
from fuzzing import BASE, sound_scene, twin_scene
from mpi4py import MPI
from scenes import load_scene

from catenary import InputError
from catenary.cases.studies.hard import runs as hard_runs

pytestmark = pytest.mark.study

FIRST = int(os.environ.get("FUZZ_SEED", "1"))
LAST = FIRST + int(os.environ.get("FUZZ_CASES", "100"))
BLOCKS = [range(first, min(first + 25, LAST)) for first in range(FIRST, LAST, 25)]


@pytest.mark.parametrize("seeds", BLOCKS, ids=str)
def test_random_scenes_keep_the_equations_of_motion(seeds: range) -> None:
    """With one contact wire, and with twin wires by turns as one and with relative motion."""
    for seed in seeds:
        made = twin_scene(seed, 60) if seed % 2 else sound_scene(seed)
        law = "released" if seed % 3 else "kept"
        words = [*made.assignments, f"line.dropper.slack_damping={law}"]
        if seed % 2:
            words.append(f"effects.relative_motion={'true' if seed % 4 == 3 else 'false'}")
        try:
            rest = hard_runs.at_rest(load_scene(BASE, words), MPI.COMM_SELF)
        except InputError as error:
            assert "slack at rest" in str(error) or "length of" in str(error)
            continue
        # Sums of up to a dozen terms, each known to round-off of the largest; droppers of some
        # 1e6 N/m see that of displacements.
        assert residual_of(rest) < 1e-10, (
            f"FUZZ_SEED={seed} FUZZ_CASES=1 replays it: {' '.join(words)}"
        )
