"""Runs that are interrupted, killed, out of disk or broken leave a file that can be continued."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
from damaging import unseal
from mpi4py import MPI
from program import (
    ENTRY,
    MPIRUN,
    assert_same_histories,
    assert_sound,
    catenary,
    catenary_started,
    n_rows,
    python,
    short_run,
)
from program import started as program_started

from catenary.postproc.read.results import Results

# Twice as many steps as the scene needs: a run that is signalled has then far to go.
FINE = "numerics.dt_s=5e-4"
FLUSH = 100
SHORT_FLUSHES = f"output.flush_every_steps={FLUSH}"

needs_mpirun = pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")


def is_open_mpi_5() -> bool:
    vendor, version = MPI.get_vendor()
    return vendor == "Open MPI" and version >= (5, 0, 0)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("uninterrupted")
    done = catenary(*short_run(folder / "out", FINE, SHORT_FLUSHES), cwd=folder)
    assert done.code == 0, done.stderr
    return folder / "out"


@pytest.mark.parametrize(
    ("number", "continued"),
    [pytest.param(signal.SIGINT, True, marks=pytest.mark.study), (signal.SIGTERM, False)],
)
def test_a_signal_closes_the_file_and_restart_finishes_the_run(
    number: signal.Signals, continued: bool, tmp_path: Path, uninterrupted: Path
) -> None:
    """Which signal it was leaves no trace in the file: one of the runs is continued."""
    out = tmp_path / "out"
    words = short_run(out, FINE, SHORT_FLUSHES, report=True)
    with catenary_started(*words, cwd=tmp_path) as program:
        program.wait_for(lambda: n_rows(out / "run.h5") > 200)
        program.send(number)
        done = program.end()
    assert done.code == 1
    assert done.left == []
    assert "Results:" not in done.stdout  # warnings before it started may be there
    (sentence,) = done.sentences
    assert sentence == f"catenary: the run was interrupted; `catenary restart {out}` continues it"
    rows = assert_sound(out / "run.h5")
    with Results(out) as results:
        assert results.outcome == "interrupted"
        assert results.attributes["n_steps"] == rows - 1 < results.attributes["n_steps_planned"]
        # Closed in good order: the state to continue from is that of the last step.
        assert results.checkpoint["step"] == rows - 1
    assert "interrupted" in (out / "report.html").read_text()
    if not continued:
        return
    again = catenary("restart", str(out), cwd=tmp_path)
    assert again.code == 0, again.stderr
    assert_same_histories(out, uninterrupted)
    refused = catenary("restart", str(out), cwd=tmp_path)
    assert refused.code == 2
    assert "is done; there is nothing to continue" in refused.stderr


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=[needs_mpirun, pytest.mark.study])])
def test_a_state_of_an_earlier_version_is_refused(ranks: int, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = [*short_run(out, FINE, SHORT_FLUSHES), "--", "-march_ts_max_steps", "150"]
    assert catenary(*words, cwd=tmp_path).code == 1
    with h5py.File(out / "run.h5", "a") as file:
        unseal(file)  # which that version did not do
        for slot in file["checkpoint"].values():
            del slot["row_of_node"]
    before = (out / "run.h5").read_bytes()
    refused = catenary("restart", str(out), cwd=tmp_path, ranks=ranks)
    assert refused.code == 2
    (sentence,) = refused.sentences
    assert "earlier version" in sentence and "start the run anew" in sentence
    assert (out / "run.h5").read_bytes() == before


@needs_mpirun
@pytest.mark.study
@pytest.mark.parametrize(
    ("ranks", "ranks_of_restart", "steps"),
    [(1, 2, 3900), (2, 1, 150)],
)
def test_any_number_of_ranks_continues_a_run(
    ranks: int, ranks_of_restart: int, steps: int, tmp_path: Path, uninterrupted: Path
) -> None:
    out = tmp_path / "out"
    words = [*short_run(out, FINE, SHORT_FLUSHES), "--", "-march_ts_max_steps", str(steps)]
    done = catenary(*words, cwd=tmp_path, ranks=ranks)
    assert done.code == 1, done.stderr
    assert done.sentences == [
        f"catenary: the run was interrupted; `catenary restart {out}` continues it"
    ]
    assert assert_sound(out / "run.h5") == steps + 1
    again = catenary("restart", str(out), cwd=tmp_path, ranks=ranks_of_restart)
    assert again.code == 0, again.stderr
    assert_same_histories(out, uninterrupted)


@pytest.mark.study
@needs_mpirun
@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.study)]
)
def test_a_signal_to_mpirun_closes_the_file(number: signal.Signals, tmp_path: Path) -> None:
    # Open MPI hands either signal on as SIGTERM, some versions a second late, and kills what still
    # runs a second after that: the run must be long, and the report may not get done.
    out = tmp_path / "out"
    words = short_run(out, "numerics.dt_s=2e-5", SHORT_FLUSHES)
    with catenary_started(*words, cwd=tmp_path, ranks=2) as program:
        program.wait_for(lambda: n_rows(out / "run.h5") > 200)
        program.send(number)
        done = program.end()
    assert done.code != 0
    assert done.left == []
    assert "Traceback" not in done.stderr
    sentence = f"catenary: the run was interrupted; `catenary restart {out}` continues it"
    # From version 5 on Open MPI passes no output on after the signal: the file alone tells.
    assert done.sentences == ([] if is_open_mpi_5() else [sentence])
    rows = assert_sound(out / "run.h5")
    with Results(out) as results:
        assert results.outcome == "interrupted"
        assert results.checkpoint["step"] == rows - 1
    again = catenary("report", str(out), cwd=tmp_path)
    assert again.code == 0, again.stderr
    assert "interrupted" in (out / "report.html").read_text()


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=[needs_mpirun, pytest.mark.study])])
def test_a_killed_run_is_readable_and_can_be_continued(
    ranks: int, tmp_path: Path, uninterrupted: Path
) -> None:
    out = tmp_path / "out"
    words = short_run(out, FINE, SHORT_FLUSHES)
    with catenary_started(*words, cwd=tmp_path, ranks=ranks) as program:
        # Tables grow before what they hold is declared complete: the last flush may not count.
        program.wait_for(lambda: n_rows(out / "run.h5") > 300 + FLUSH)
        # What ends a rank that takes too much memory; the launcher must then end the others.
        killed = program.pid_of_rank(ranks - 1) if ranks > 1 else program.process.pid
        os.kill(killed, signal.SIGKILL)
        done = program.end()
    assert done.code != 0
    assert done.left == []
    with Results(out) as results:
        assert results.outcome == "running"
        assert 300 < results.time.size < results.attributes["n_steps_planned"]
        # The first step and then every so many rows, which are a chunk of the file.
        assert results.time.size % FLUSH == 0
        for name in ("contact_force", "arm_uplift", "dropper_force"):
            assert np.isfinite(results.channel(name)).all()
        assert results.n_steps - FLUSH <= results.checkpoint["step"] <= results.n_steps
    # Without snapshots a report works out no waves.
    snapshots = (out / "fields.h5").rename(tmp_path / "fields.h5")
    reported = catenary("report", str(out), cwd=tmp_path)
    assert reported.code == 0, reported.stderr
    snapshots.rename(out / "fields.h5")
    again = catenary("restart", str(out), cwd=tmp_path)
    assert again.code == 0, again.stderr
    assert_same_histories(out, uninterrupted)


@pytest.mark.study
def test_a_file_that_may_not_grow_ends_the_run_with_a_sentence(tmp_path: Path) -> None:
    out = tmp_path / "out"
    script = tmp_path / "limited.py"
    script.write_text(
        "import resource\n"
        "from mpi4py import MPI  # which is not to meet the limit\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (2_000_000, resource.RLIM_INFINITY))\n"
        "from catenary.cases.cli.main import main\n"
        "main()\n"
    )
    words = short_run(out, FINE, SHORT_FLUSHES, report=True)
    with program_started(python(str(script), *words), tmp_path) as program:
        done = program.end()
    assert done.code == 1, done.stderr
    assert done.left == []
    (sentence,) = done.sentences
    assert_out_of_room(sentence, out, "File too large): raise the limit on the size of a file")
    again = catenary("restart", str(out), cwd=tmp_path)
    assert again.code == 0, again.stderr


def can_mount() -> bool:
    """Whether a small disk of one's own can be had."""
    if shutil.which("unshare") is None:
        return False
    command = ["unshare", "-rm", "mount", "-t", "tmpfs", "tmpfs", "/tmp"]
    return subprocess.run(command, capture_output=True, timeout=240).returncode == 0


@pytest.mark.skipif(not can_mount(), reason="no small disk can be mounted")
@pytest.mark.parametrize(
    ("room", "ranks"),
    [
        ("300k", 1),
        pytest.param("2500k", 2, marks=[needs_mpirun, pytest.mark.study]),
        pytest.param("4600k", 1, marks=pytest.mark.study),
    ],
)
def test_a_full_disk_ends_the_run_with_a_sentence(room: str, ranks: int, tmp_path: Path) -> None:
    """A disk that is full from the start, soon, and when hardly the report finds room."""
    disk, kept = tmp_path / "disk", tmp_path / "kept"
    disk.mkdir()
    out = disk / "out"
    # Without --force the lack of room is seen before anything is computed.
    words = [*short_run(out, SHORT_FLUSHES, "numerics.dt_s=1e-4", report=True), "--force"]
    # The disk is there for these processes only.
    script = tmp_path / "on_a_small_disk.sh"
    script.write_text(
        f"mount -t tmpfs -o size={room} tmpfs {disk} || exit 77\n"
        '"$@"\n'
        f"code=$?; cp -r {out} {kept}; exit $code\n"
    )
    program = python("-c", ENTRY, *words)
    if ranks > 1:
        program = [str(MPIRUN), "-n", str(ranks), "--oversubscribe", *program]
    with program_started(["unshare", "-rm", "sh", str(script), *program], tmp_path) as run:
        done = run.end()
    assert done.code == 1, done.stderr
    assert done.left == []
    assert "Traceback" not in done.stderr
    (sentence,) = done.sentences
    if room == "300k":  # not even the first step
        assert "fields.h5 failed at t = 0.000 s (No space left on device)" in sentence
        assert "; nothing was written, and results of an earlier run are as they" in sentence
        assert not kept.exists()
        return
    with Results(kept) as results:
        assert results.time.size >= FLUSH
    assert_sound(kept / "run.h5")


def assert_out_of_room(sentence: str, out: Path, reason: str) -> None:
    assert sentence.startswith(f"catenary: writing {out / 'run.h5'} failed at t = ")
    assert f"({reason}" in sentence
    rows = assert_sound(out / "run.h5")
    with Results(out) as results:
        assert f"catenary: {results.outcome}" == sentence
        assert f"t = {results.time[-1]:.3f} s" in sentence
        assert results.checkpoint["step"] == rows - 1 >= FLUSH - 1
    assert reason in (out / "report.html").read_text()


# Contact that no correction can catch up with: an iteration multiplies an error by about
# k dt^2 / 4 m_head = 2.2 and 22 here. Where contact may be lost the iterates stay bounded and
# never settle; where not they grow beyond all numbers.
STIFF = ("numerics.scheme=fixed_point", "numerics.dt_s=4e-3")
BROKEN = {
    "never settles": (
        [*STIFF, "contact.stiffness_N_per_m=4e6"],
        "fixed-point correction does not converge",
    ),
    "grows": (
        [
            *STIFF,
            "contact.stiffness_N_per_m=4e7",
            "numerics.max_iterations=1000",
            "effects.contact_loss=false",
        ],
        "fixed-point correction diverges",
    ),
    "in the middle": (
        [*STIFF, "contact.stiffness_N_per_m=2e5", "numerics.max_iterations=30"],
        "fixed-point correction does not converge",
    ),
}


@pytest.mark.parametrize("how", BROKEN)
def test_a_step_that_breaks_ends_the_run_with_time_and_remedy(how: str, tmp_path: Path) -> None:
    assignments, words = BROKEN[how]
    out = tmp_path / "out"
    done = catenary(*short_run(out, *assignments, report=True), cwd=tmp_path)
    assert done.code == 1, done.stderr
    assert "Results:" not in done.stdout
    (sentence,) = done.sentences
    assert words in sentence
    assert 'take numerics.scheme = "one_solve" or a smaller numerics.dt_s' in sentence
    rows = assert_sound(out / "run.h5")
    with Results(out) as results:
        assert f"catenary: {results.outcome}" == sentence
        # The step that broke is the one after the last that is there.
        assert f"the step to t = {results.time[-1] + results.dt:.4f} s" in sentence
        assert results.checkpoint["step"] < rows
    assert "fixed-point correction" in (out / "report.html").read_text()
