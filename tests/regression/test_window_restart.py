"""Runs with a window that are interrupted or killed, and go on with other numbers of ranks.

One rank takes all steps of a window, so that no number of ranks changes a bit of them.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from program import MPIRUN, assert_same_histories, catenary, catenary_started, n_rows

from catenary.postproc.read.results import Results

pytestmark = pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")

WINDOWS = {
    "exact": ("window.mode=exact", "line.n_spans=40"),
    "tolerance": ("window.mode=bounded", "window.tolerance=1e-7", "line.n_spans=40"),
    # Of a line so long that its matrices are made by pieces, of which the train needs inner ones.
    "spans": (
        "window.mode=bounded", "window.spans_ahead=4", "window.spans_behind=3", "line.n_spans=240",
    ),
}  # fmt: skip
# Spans that the train has behind it at its start, and their length [m].
BEFORE, SPAN = {"exact": 6, "tolerance": 6, "spans": 130}, 54.0
# Steps after which a run is stopped: before, between and after the incidents. None: it is killed.
INTERRUPTED = [
    ("exact", 1, 2, 550),
    pytest.param("tolerance", 2, 3, None, marks=pytest.mark.study),
    pytest.param("spans", 3, 1, 850, marks=pytest.mark.study),
    pytest.param("spans", 1, 1, None, marks=pytest.mark.study),
]


@cache
def words(window: str) -> tuple[str, ...]:
    """Two pantographs 50 m apart over 83 m of way: 1000 steps, in which a window is shifted a
    hundred times. A dropper breaks before the train, and a wire loses tension."""
    before = BEFORE[window]
    start = SPAN * before
    scene = (
        "train.pantographs=[{name='lumped'},{name='lumped',behind_m=50}]",
        f"train.start_m={start}", f"train.end_m={start + 83.4}", "train.raise_time_s=0.1",
        f"evaluation.from_m={start + 10.0}", f"evaluation.to_m={start + 25.0}",
        "numerics.dt_s=1e-3", "output.flush_every_steps=50",
        "incidents=["
        f"{{type='dropper_break',at_s=0.4,span={before + 1},dropper=6}},"
        "{type='tension_loss',at_s=0.7,wire='messenger_wire',share=0.9}]",
    )  # fmt: skip
    return ("run", "ambrosio2012", "--no-report", "--set", *scene, *WINDOWS[window])


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Runs from end to end, which no one interrupts, each made when it is first needed."""
    folder = tmp_path_factory.mktemp("whole")

    @cache
    def run(window: str) -> Path:
        done = catenary(*words(window), "-o", str(folder / window), cwd=folder)
        assert done.code == 0, done.stderr
        return folder / window

    return run


def assert_to_the_last_bit(out: Path, reference: Path) -> None:
    assert_same_histories(out, reference)
    with Results(out) as found, Results(reference) as expected:
        for name in ("contact_force", "head_height", "arm_uplift", "dropper_force"):
            for part, values in expected.blocks(name):
                own = found.rows(name, part)
                assert np.array_equal(own, values, equal_nan=True), name
        for name, values in expected.energies().items():
            assert np.array_equal(found.energies()[name], values), name


@pytest.mark.parametrize(("window", "ranks", "ranks_of_restart", "steps"), INTERRUPTED)
def test_a_window_goes_on_with_other_ranks_to_the_last_bit(
    window: str,
    ranks: int,
    ranks_of_restart: int,
    steps: int | None,
    tmp_path: Path,
    whole: Callable[[str], Path],
) -> None:
    out = tmp_path / "out"
    if steps is None:
        kill(window, ranks, out)
    else:
        limited = [*words(window), "-o", str(out), "--", "-march_ts_max_steps", str(steps)]
        done = catenary(*limited, cwd=tmp_path, ranks=ranks)
        assert done.code == 1, done.stderr
        with Results(out) as results:
            assert results.checkpoint["step"] == steps
    done = catenary("restart", str(out), cwd=tmp_path, ranks=ranks_of_restart)
    assert done.code == 0, done.stderr
    assert_to_the_last_bit(out, whole(window))


def kill(window: str, ranks: int, out: Path) -> None:
    """Begin a run and kill the rank that steps it, amid its march."""
    with catenary_started(*words(window), "-o", str(out), cwd=out.parent, ranks=ranks) as program:
        program.wait_for(lambda: n_rows(out / "run.h5") > 200)
        os.kill(program.process.pid if ranks == 1 else program.pid_of_rank(0), signal.SIGKILL)
        program.end()
    with Results(out) as results:
        assert results.outcome == "running" and results.n_steps < 1000
