"""Random scenes as processes: killed at a random moment, and on a random number of ranks.

What the program leaves when it is killed can be read up to the last flush, and a restart ends where
an uninterrupted run ends. `make fuzz` runs many; FUZZ_SEED and FUZZ_PROCESSES say where seeds begin
and how many there are of each.
"""

from __future__ import annotations

import os
import random
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from fuzzing import N_STEPS, RandomScene, wide_scene
from mpi4py import MPI
from program import MPIRUN, Done, Program, assert_sound, catenary, catenary_started, n_rows
from scenes import load_scene

from catenary import InputError
from catenary.cases.studies.hard import runs as hard_runs
from catenary.cases.studies.hard.runs import RunHistories
from catenary.postproc.read.results import Results

pytestmark = pytest.mark.study

FIRST = int(os.environ.get("FUZZ_SEED", "1"))
CASES = int(os.environ.get("FUZZ_PROCESSES", "2"))
SEEDS = range(FIRST, FIRST + CASES)
# Steps of a run that is killed: about a second, so that a random moment mostly lies in the march.
LONG = 4000
# As long as a process takes to start, at most [s].
START = 3.0
# Scenes are compared if round-off leaves this share of the largest force certain.
TELLING = 1e-3
NUMBERS = (signal.SIGKILL, signal.SIGTERM)


def drawn(
    kind: str, seed: int, n_steps: int
) -> tuple[random.Random, RandomScene, RunHistories, float]:
    """A random scene that runs to its end, its run here on one rank, and what round-off does to it.

    The last is the largest difference of a contact force [N] if the static force differs in the
    12th digit: a head that hops on a stiff contact without damping is chaotic, and not drawn.
    """
    rng = random.Random(f"{kind} {seed}")
    while True:
        made = wide_scene(rng.randrange(10**9), n_steps)
        scene = load_scene(made.base, made.assignments)
        try:
            rest = hard_runs.at_rest(scene, MPI.COMM_SELF)
            run = hard_runs.run(rest, MPI.COMM_SELF, self_watched=True)
        except InputError:
            continue  # slack at rest
        if run.outcome != "done":
            continue  # a law or coupling that these steps break
        if any(remark.startswith("A run would end here") for remark in run.remarks):
            continue  # a wire turns further than its model holds
        kind_of = scene.train.pantographs[0].name
        force = scene.pantographs[kind_of].static_force_N
        assert force is not None
        key = f"pantographs.{kind_of}.static_force_N={force * (1 + 1e-12)!r}"
        beside = load_scene(made.base, (*made.assignments, key))
        other = hard_runs.run(hard_runs.at_rest(beside, MPI.COMM_SELF), MPI.COMM_SELF)
        if other.force.shape != run.force.shape:
            continue
        sensitive = float(np.abs(other.force - run.force).max())
        if 100.0 * sensitive > TELLING * np.abs(run.force).max():
            continue  # of which nothing could be said
        return rng, made, run, sensitive


def words_for(made: RandomScene, out: Path, *more: str) -> list[str]:
    return ["run", made.base, "-o", str(out), "--set", *made.assignments, *more]


def check_same(out: Path, run: RunHistories, sensitive: float) -> None:
    """The force of a result file is that of a run: as well as its scene lets round-off grow.

    1e-6 of the largest is what 4000 steps make of some 1e-10 a step; the sensitivity is to one
    change, a restart or a sum over ranks makes some at every step: a hundred times as much.
    """
    with Results(out) as results:
        assert results.outcome == "done"
        force = results.channel("contact_force")
    assert force.shape == run.force.shape
    apart = float(np.abs(force - run.force).max())
    within = 1e-6 * max(float(np.abs(run.force).max()), 1.0) + 100.0 * sensitive
    print(f"forces differ by {apart:.1e} N, allowed {within:.1e} N")
    assert apart <= within


@pytest.mark.parametrize("seed", SEEDS)
def test_a_run_killed_at_any_moment_can_be_read_and_continued(seed: int, tmp_path: Path) -> None:
    rng, made, run, sensitive = drawn("kill", seed, LONG)
    flush = rng.choice([1, 7, 50, 400])
    number = NUMBERS[seed % 2]
    out = tmp_path / "out"
    words = words_for(made, out, f"output.flush_every_steps={flush}", "output.field_every_s=0")
    # At a random row, or at a random moment, which may be before the first or after the last.
    row = rng.randrange(LONG) if rng.random() < 0.7 else -1
    moment = rng.uniform(0.0, 2.0 * START)
    print(f"{number.name}, row {row}, moment {moment:.2f} s, flush {flush}; {made}")
    with catenary_started(*words, cwd=tmp_path) as program:
        wait_until(program, out, row, moment)
        program.send(number)
        done = program.end()
    assert done.left == []
    if not (out / "run.h5").exists() or not n_rows(out / "run.h5"):
        # Before there was a first row: nothing to continue, which is said; a new run needs no more.
        check_nothing_left(tmp_path, out, words)
    else:
        check_what_is_left(out, number, done, flush, run, sensitive)
        if done.code != 0:
            with Results(out) as results:
                marched = results.outcome == "done"
            # Killed after the last step, only the report may be missing.
            again = catenary("report" if marched else "restart", str(out), cwd=tmp_path)
            assert again.code == 0, again.stderr
    assert assert_sound(out / "run.h5") == LONG + 1
    check_same(out, run, sensitive)


def wait_until(program: Program, out: Path, row: int, moment: float) -> None:
    """Until a row is written, or a moment has passed; or until the program has ended."""
    if row >= 0:
        result = out / "run.h5"
        program.wait_for(
            lambda: program.process.poll() is not None or n_rows(result) > row,
            may_have_ended=True,
        )
        return
    end = time.monotonic() + moment
    program.wait_for(
        lambda: program.process.poll() is not None or time.monotonic() > end, may_have_ended=True
    )


def check_nothing_left(folder: Path, out: Path, words: list[str]) -> None:
    refused = catenary("restart", str(out), cwd=folder)
    assert refused.code == 2 and len(refused.sentences) == 1, refused.stderr
    again = catenary(*words, cwd=folder)
    assert again.code == 0, again.stderr


def check_what_is_left(
    out: Path, number: signal.Signals, done: Done, flush: int, run: RunHistories, sensitive: float
) -> None:
    """Every channel can be read, as far as the last flush, and is what it would have been."""
    with Results(out) as results:
        n = results.n_steps
        assert results.outcome in ("done", "interrupted", "running")
        if number == signal.SIGKILL and results.outcome == "running":
            assert (n + 1) % flush == 0 or n in (0, LONG)
            assert n - flush <= results.checkpoint["step"] <= n
        if number == signal.SIGTERM and done.code == 1:
            # While the report was written the run itself was done.
            ended = "done" if "is complete" in done.stderr else "interrupted"
            assert results.outcome == ended and results.checkpoint["step"] == n
        force = results.channel("contact_force")
        assert np.isfinite(force).all() and np.isfinite(results.channel("dropper_force")).all()
    within = 1e-6 * max(float(np.abs(run.force).max()), 1.0) + 100.0 * sensitive
    assert np.abs(force - run.force[: force.shape[0]]).max() <= within


@pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")
@pytest.mark.parametrize("seed", SEEDS)
def test_any_number_of_ranks_gives_the_same_forces(seed: int, tmp_path: Path) -> None:
    rng, made, run, sensitive = drawn("ranks", seed, N_STEPS)
    ranks = rng.randint(2, 4)
    print(f"{ranks} ranks; {made}")
    words = words_for(made, tmp_path / "out", "output.field_every_s=0")
    done = catenary(*words, cwd=tmp_path, ranks=ranks)
    assert done.code == 0, done.stderr
    assert done.left == []
    assert assert_sound(tmp_path / "out" / "run.h5") == N_STEPS + 1
    with Results(tmp_path / "out") as results:
        assert results.attributes["n_ranks"] == ranks
    check_same(tmp_path / "out", run, sensitive)
