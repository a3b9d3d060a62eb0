"""A run that is killed again and again at random ends as one that never was (`make long-runs`).

By default 60 s on 1000 spans, all of which move, on two ranks, killed 20 times. ``CATENARY_KILLS``,
``CATENARY_SPANS`` and ``CATENARY_SECONDS`` choose others; no spans are those of a shipped case.
"""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from program import MPIRUN, assert_same_histories, catenary_started, n_rows

from catenary.postproc.read.results import Results

KILLS = int(os.environ.get("CATENARY_KILLS", "20"))
SPANS = int(os.environ.get("CATENARY_SPANS", "1000"))
SECONDS = float(os.environ.get("CATENARY_SECONDS", "60"))
# Where the paper's train starts [m], and its speed [m/s].
START, SPEED = 110.0, 300.0 / 3.6
RANKS = 2
# Longest time that a part of the run goes on once it has written rows, as a share of its part of
# the whole march and at most, and that anything takes [s].
_SHARE, _MOST, _LONGEST = 0.6, 1.5, 7200.0


def words() -> list[str]:
    """The scene: the shipped case, or the paper's line as long as asked for."""
    if not SPANS:
        return ["run", "en50318_2002", "--short"]
    end = START + SPEED * SECONDS
    return [
        "run", "ambrosio2012", f"line.n_spans={SPANS}", f"train.end_m={end:.1f}",
        f"evaluation.to_m={min(800.0, end - 10.0):.1f}",
        f"output.line_channels_spans=[1,{min(SPANS, 100)}]", "output.field_window_m=[300,200]",
    ]  # fmt: skip


@pytest.mark.timeout(4 * 3600)
@pytest.mark.skipif(MPIRUN is None, reason="needs mpirun")
def test_a_run_that_is_killed_many_times_ends_as_one_that_never_was(tmp_path: Path) -> None:
    whole, out = tmp_path / "whole", tmp_path / "killed"
    with catenary_started(*words(), "-o", str(whole), cwd=tmp_path, ranks=RANKS) as program:
        done = program.end(_LONGEST)
    assert done.code == 0, done.stderr
    with Results(whole) as results:
        wall = float(results.attributes["march_wall_s"])
    # So short that all kills fall into the march.
    most = min(_MOST, _SHARE * wall / KILLS)
    random, kills = np.random.default_rng(7), 0
    begin = [*words(), "-o", str(out)]
    while kills < KILLS:
        known = n_rows(out / "run.h5")
        with catenary_started(*begin, cwd=tmp_path, ranks=RANKS) as program:
            program.limit = _LONGEST
            program.wait_for(lambda: n_rows(out / "run.h5") > known, may_have_ended=True)  # noqa: B023
            time.sleep(float(random.uniform(0.0, most)))
            if program.process.poll() is not None:
                break
            os.kill(program.pid_of_rank(int(random.integers(RANKS))), signal.SIGKILL)
            program.end()
            kills += 1
        begin = ["restart", str(out)]
    print(f"killed {kills} times in a march of {wall:.1f} s")
    # Of a short case fewer fit in.
    assert kills >= min(KILLS, KILLS if SPANS else 2), "it had ended before it was killed"
    with catenary_started("restart", str(out), cwd=tmp_path, ranks=RANKS) as program:
        program.end(_LONGEST)
    assert_same_histories(out, whole)
