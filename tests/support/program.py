"""The program as a process of its own, alone or under mpirun, with a limit.

Every process inherits a mark, by which those that outlive their launcher are found.
"""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from forked_program import forks

from catenary.postproc.read.results import Results
from catenary.solver.time_loop.views.channels import CHANNELS

MPIRUN = shutil.which("mpirun")
# For anything that is to end by itself [s], on a machine that others load. Below the limit of a
# pytest test.
LIMIT = 240.0
# The same with several ranks. One that waits keeps its core busy: if others want cores too, each
# message waits for a turn, and the longest test of 18 s took 120. Below the limit of a pytest test,
# so that what hangs is killed and told.
LIMIT_OF_RANKS = 280.0
# What an MPI process needs besides its command: Open MPI starts neither as root nor gives its core
# to others while it waits, unless told to. Other MPI libraries know none of these.
RANKS_ENVIRONMENT = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMP_NUM_THREADS": "1",
}

# Ten spans of the reference line of EN 50318, run through for two seconds: 2016 steps of 1 ms.
SHORT_SCENE = (
    "line.n_spans=10",
    "train.start_m=120",
    "train.end_m=260",
    "train.raise_time_s=0.2",
    "evaluation.from_m=180",
    "evaluation.to_m=240",
    "output.energy_every_s=0.02",
)
# Round-off of a solve, 1e-16, over 1e4 steps of a damped line; see tests/support/rank_histories.py.
SAME = 1e-9
# The program as a script of Python.
ENTRY = "from catenary.cases.cli.main import main; main()"
_UNPAINTED = f"import sys; sys.path[0] = {str(Path(__file__).parent)!r}; import unpainted; "
_UNPAINTED += f"sys.path[0] = ''; {ENTRY}"
_MARK = "CATENARY_TEST_MARK"
_PROC = Path("/proc")


def short_run(out: Path, *assignments: str, report: bool = False) -> list[str]:
    """Words of ``catenary run`` for the short scene with further assignments."""
    words = ["run", "en50318_2002", "-o", str(out), *([] if report else ["--no-report"])]
    return [*words, "--set", *SHORT_SCENE, *assignments]


@dataclass
class Done:
    """A program that has ended: exit code, what it said, and the processes it left behind."""

    code: int
    stdout: str
    stderr: str
    left: list[int]

    @property
    def sentences(self) -> list[str]:
        """What the program told its user on standard error; the launcher's words are left out."""
        return [line for line in self.stderr.splitlines() if line.startswith("catenary: ")]


@dataclass
class Program:
    """A program that is running, and how long it may take [s]."""

    process: subprocess.Popen[str]
    mark: str
    limit: float = LIMIT

    def wait_for(self, what: Callable[[], bool], *, may_have_ended: bool = False) -> None:
        """Wait until something is so; fail if the program ends before or its limit passes."""
        end = time.monotonic() + self.limit
        while not what():
            if self.process.poll() is not None:
                assert may_have_ended and what(), f"ended early: {self.process.communicate()}"
            assert time.monotonic() < end, f"not so after {self.limit} s"
            time.sleep(0.03)  # often enough, and the program needs the core

    def send(self, number: signal.Signals) -> None:
        """Send a signal to the process that was started, which is mpirun if there is one."""
        self.process.send_signal(number)

    def pid_of_rank(self, rank: int) -> int:
        """Process of a rank, by the variable that Open MPI gives it."""
        wanted = f"OMPI_COMM_WORLD_RANK={rank}".encode()
        (found,) = [pid for pid, words in _processes(self.mark) if wanted in words]
        return found

    def end(self, limit: float | None = None) -> Done:
        """Wait for the end, within ``limit`` [s] or its own, and for the last of its processes."""
        stdout, stderr = self.process.communicate(timeout=limit or self.limit)
        return _ended(self.process.returncode, stdout, stderr, self.mark)


def _ended(code: int, stdout: str, stderr: str, mark: str) -> Done:
    """What a program was that has ended, when the last of its processes had time to end."""
    for _ in range(1200):  # the launcher may end a moment before those it has killed
        left = [pid for pid, _ in _processes(mark)]
        if not left:
            break
        time.sleep(0.05)
    return Done(code, stdout, stderr, left)


@contextmanager
def started(command: list[str], cwd: Path, ranks: int = 1) -> Iterator[Program]:
    """A command that runs while the block does; whatever is left of it is killed at the end."""
    if ranks > 1:
        assert MPIRUN is not None
        command = [MPIRUN, "-n", str(ranks), "--oversubscribe", "--bind-to", "none", *command]
    mark = uuid.uuid4().hex
    environment = {**os.environ, **RANKS_ENVIRONMENT, _MARK: mark}
    pipe = subprocess.PIPE
    with subprocess.Popen(
        command, cwd=cwd, env=environment, stdout=pipe, stderr=pipe, text=True
    ) as process:
        try:
            yield Program(process, mark, LIMIT if ranks == 1 else LIMIT_OF_RANKS)
        finally:
            if process.poll() is None:
                process.kill()
            for pid, _ in _processes(mark):
                os.kill(pid, signal.SIGKILL)


def python(*words: str) -> list[str]:
    """This interpreter, which takes warnings for errors."""
    return [sys.executable, "-W", "error", *words]


def catenary(
    *words: str, cwd: Path, ranks: int = 1, pictures: bool = False, limit: float | None = None
) -> Done:
    """Run the command line to its end; on one rank forked from ``forking_server.py``.

    Pictures are painted only if they are looked at. ``limit`` [s] is for what takes long.
    """
    if ranks == 1:
        mark = uuid.uuid4().hex
        environment = {**os.environ, **RANKS_ENVIRONMENT, _MARK: mark}
        return _ended(*forks().run(list(words), cwd, environment, limit or LIMIT, pictures), mark)
    with catenary_started(*words, cwd=cwd, ranks=ranks, pictures=pictures) as program:
        return program.end(limit)


@contextmanager
def catenary_started(
    *words: str, cwd: Path, ranks: int = 1, pictures: bool = False
) -> Iterator[Program]:
    """The command line, running; pictures are painted only if they are looked at."""
    entry = ENTRY if pictures else _UNPAINTED
    with started(python("-c", entry, *words), cwd, ranks) as program:
        yield program


def write_program(file: Path) -> None:
    """Write a program that is the command line, for shells; it paints no pictures."""
    file.write_text(f'#!/bin/sh\nexec {shlex.join(python("-c", _UNPAINTED))} "$@"\n')
    file.chmod(0o755)


def n_rows(result: Path) -> int:
    """Rows that a result file holds by now, 0 if it cannot be read yet."""
    try:
        with h5py.File(result, "r", locking=False) as file:
            return int(file["time"].shape[0])
    except (OSError, KeyError, RuntimeError):
        return 0


def assert_sound(result: Path) -> int:
    """Check that a result file is closed, whole and finite; return its number of rows."""
    with h5py.File(result, "r") as file:  # with its lock: no writer has it open
        for clock, group in (("time", "channels"), ("line_channels/time", "line_channels")):
            lengths = {name: table.shape[0] for name, table in file[group].items()}
            assert set(lengths.values()) == {file[clock].shape[0]}, lengths
        energies = {name: values.shape[0] for name, values in file["energy"].items()}
        assert len(set(energies.values())) == 1, energies
    with Results(result) as results:
        for name in filter(results.has, CHANNELS):
            assert all(_finite(results, name, values) for _, values in results.blocks(name)), name
        time = results.time
        steps = np.arange(time.size) * results.dt
        assert np.abs(time - steps).max() < 1e-9 * results.dt * time.size
        return int(time.size)


def _finite(results: Results, name: str, values: np.ndarray) -> bool:
    """Whether rows of a channel are numbers, wherever they are recorded."""
    if not CHANNELS[name].of_line:
        return bool(np.isfinite(values).all())
    own = values[:, results.recorded_columns(name)]
    # Beyond a window that moves with the train nothing is recorded.
    there = ~np.isnan(own) if results.line_record.window is not None else np.ones(own.shape, bool)
    return bool(np.isfinite(own[there]).all())


def _processes(mark: str) -> list[tuple[int, list[bytes]]]:
    """Living processes that carry a mark and their environment; none where there is no /proc."""
    wanted = f"{_MARK}={mark}".encode()
    found = []
    for place in _PROC.glob("[0-9]*/environ"):
        try:
            words = place.read_bytes().split(b"\0")
        except OSError:  # it has ended, or is another user's
            continue
        if wanted in words:
            found.append((int(place.parent.name), words))
    return found


def assert_same_histories(out: Path, reference: Path) -> None:
    """Fail unless two finished runs in these folders hold the same histories and snapshots, of what
    is recorded of the line."""
    assert assert_sound(out / "run.h5") == assert_sound(reference / "run.h5")
    with Results(out) as found, Results(reference) as expected:
        assert found.outcome == "done"
        for name in ("contact_position", "contact_force", "arm_uplift", "dropper_force"):
            largest = apart = 0.0
            for part, values in expected.blocks(name):
                own = found.rows(name, part)
                assert np.array_equal(np.isnan(own), np.isnan(values)), name
                largest = max(largest, float(np.nanmax(np.abs(values), initial=0.0)))
                apart = max(apart, float(np.nanmax(np.abs(own - values), initial=0.0)))
            difference = apart / largest
            print(f"{name}: relative difference {difference:.1e}, allowed {SAME:.0e}")
            assert difference < SAME
        for name, values in expected.energies().items():
            assert np.abs(found.energies()[name] - values).max() <= SAME * np.abs(values).max()
    # As many snapshots, each once.
    times = [(folder / "fields.xdmf").read_text().count("<Time ") for folder in (out, reference)]
    assert times[0] == times[1] > 0
