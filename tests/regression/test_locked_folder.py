"""A result folder in use is refused to all others, by every verb that writes results."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from program import MPIRUN, assert_sound, catenary, catenary_started, n_rows, short_run

LOCK = ".catenary.lock"
# Two million steps, each by a correction, some minutes: the run goes on while others try to take
# its folder, and has few rows to look at. Its line's channels are recorded whole, and not around
# the train as their size would have it. Without snapshots a report works out no waves.
LONG = (
    "numerics.dt_s=1e-6",
    "numerics.scheme=fixed_point",
    "output.flush_every_steps=500",
    "output.line_channels_every_s=5e-3",
    "output.field_every_s=0",
)


def test_a_live_run_is_left_alone_and_can_be_looked_at(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with catenary_started(*short_run(out, *LONG), cwd=tmp_path) as program:
        program.wait_for(lambda: n_rows(out / "run.h5") > 500)
        looked = catenary("report", str(out), cwd=tmp_path)
        assert looked.code == 0, looked.stderr
        for other in ([*short_run(out), "--force"], ["restart", str(out)]):
            refused = catenary(*other, cwd=tmp_path)
            assert refused.code == 2, refused.stderr
            (sentence,) = refused.sentences
            pid = program.process.pid
            assert f"{out} is in use by process {pid} on " in sentence
            assert "`catenary run en50318_2002`" in sentence and "sign of life" in sentence
        rows = n_rows(out / "run.h5")
        program.wait_for(lambda: n_rows(out / "run.h5") > rows)
        program.send(signal.SIGTERM)
        done = program.end()
    assert done.code == 1 and "was interrupted" in done.stderr
    assert assert_sound(out / "run.h5") > rows
    assert not (out / LOCK).exists()


@pytest.mark.study
@pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")
def test_several_ranks_hold_one_lock_and_leave_it_when_killed(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with catenary_started(*short_run(out, *LONG), cwd=tmp_path, ranks=2) as program:
        program.wait_for(lambda: n_rows(out / "run.h5") > 500)
        refused = catenary(*short_run(out), "--force", cwd=tmp_path, ranks=2)
        assert refused.code == 2, refused.stderr
        (sentence,) = refused.sentences
        assert f"{out} is in use by process {program.pid_of_rank(0)} on " in sentence
        for pid in [program.pid_of_rank(rank) for rank in (0, 1)]:
            os.kill(pid, signal.SIGKILL)
        program.end()
    assert (out / LOCK).exists()
    again = catenary(*short_run(out), "--force", cwd=tmp_path)
    assert again.code == 0, again.stderr
    assert not (out / LOCK).exists()
