"""Random sweeps of all contact laws under trains of several pantographs, by the command line.

FUZZ_SEED and FUZZ_SWEEPS say where seeds begin and how many there are; `make fuzz` runs many.
"""

from __future__ import annotations

import csv
import json
import os
import random
import sys
from pathlib import Path

import numpy as np
import pytest
from fuzzing import N_STEPS, RandomScene, wide_scene
from fuzzing_parts import law_variants
from program import assert_sound
from scenes import load_scene
from verb_runner import invoke

from catenary.postproc.read.results import Results

pytestmark = pytest.mark.study

FIRST = int(os.environ.get("FUZZ_SEED", "1"))
PLAIN = ("output.field_every_s=0",)
SEEDS = range(FIRST, FIRST + int(os.environ.get("FUZZ_SWEEPS", "2")))


def several(seed: int) -> tuple[random.Random, RandomScene]:
    """A random scene with two pantographs or more, whose law and numerics may be anything."""
    rng = random.Random(f"sweep {seed}")
    while True:
        made = wide_scene(rng.randrange(10**9))
        scene = load_scene(made.base, made.assignments)
        lowers = any(incident.type == "lowering" for incident in scene.incidents)
        if len(scene.train.pantographs) > 1 and not lowers:
            return rng, made


@pytest.mark.parametrize("seed", SEEDS)
def test_a_sweep_of_laws_has_a_row_for_each(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The command line installs an exception hook; it goes with the test.
    monkeypatch.setattr(sys, "excepthook", sys.excepthook)
    rng, made = several(seed)
    laws = law_variants(rng)
    file, out = tmp_path / "laws.toml", tmp_path / "out"
    file.write_text("".join(f"{name} = {json.dumps(words)}\n" for name, words in laws.items()))
    told = f"FUZZ_SEED={seed} FUZZ_SWEEPS=1 replays it: {' '.join(made.assignments)}, {laws}"
    words = ["sweep", made.base, "-o", str(out), "--variants", str(file), "--set"]
    done = invoke(*words, *made.assignments, *PLAIN)
    n = str(dict(word.split("=", 1) for word in made.assignments)["train.pantographs"])
    if done.exit_code == 1 and "would be slack at rest" in done.stderr:
        assert not list(out.glob("*/run.h5")), told  # of the line, and so of all laws
        return
    assert done.exit_code in (0, 1), (told, done.output, done.exception)
    with (out / "sweep.csv").open(encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    assert {row["variant"] for row in rows} == set(laws), told
    for name in laws:
        mine = [row for row in rows if row["variant"] == name]
        if mine[0]["outcome"] != "done":
            assert done.exit_code == 1 and "variants broke: " in done.stderr, told
            outcome = mine[0]["outcome"]
            stopped = "; take " in outcome and "t = " in outcome
            assert stopped or " coupling (numerics.coupling = " in outcome, (told, mine)
            continue
        assert len(mine) == n.count("name="), (told, mine)
        assert assert_sound(out / name / "run.h5") == N_STEPS + 1, told
        with Results(out / name) as results:
            assert np.isfinite(results.channel("contact_force")).all(), told
