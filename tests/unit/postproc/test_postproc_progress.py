"""What a run shows of itself: lines in a log, a bar on a terminal, nothing where it is quiet."""

from __future__ import annotations

import io
import logging
import re
import types
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from catenary.base.parallel import set_up_logging
from catenary.postproc.record.progress import Progress
from catenary.solver.time_loop.views.channels import TrainLayout
from catenary.solver.time_loop.views.observers import Stage

RANK_0 = types.SimpleNamespace(rank=0)
DT = 1e-3


class Terminal(io.StringIO):
    """A stream that says that it is a terminal."""

    def isatty(self) -> bool:
        return True


class Clock:
    """Wall time that the march itself moves on; it counts who looks."""

    def __init__(self) -> None:
        self.now, self.looks = 0.0, 0

    def __call__(self) -> float:
        self.looks += 1
        return self.now


@pytest.fixture
def log() -> Iterator[list[str]]:
    """The lines of progress, whatever an earlier test set up."""
    lines: list[str] = []
    handler = logging.Handler()
    handler.emit = lambda record: lines.append(record.getMessage())  # type: ignore[method-assign]
    logger = logging.getLogger("catenary.progress")
    before = logger.level
    logger.setLevel(logging.INFO)
    logger.addHandler(handler)
    yield lines
    logger.removeHandler(handler)
    logger.setLevel(before)


def stage(n_steps: int, start_time: float = 0.0) -> Stage:
    none = np.zeros(0)
    return Stage(TrainLayout((1,)), DT, start_time, n_steps, none, none, none, none, none, none)


def march(progress: Progress, clock: Clock, n_steps: int, wall_per_step: float) -> None:
    progress.start(stage(n_steps))
    view: Any = types.SimpleNamespace(step=0, time=0.0)
    for step in range(n_steps + 1):
        view.step, view.time = step, step * DT
        progress.observe(view)
        clock.now += wall_per_step
    progress.finish("done")


def test_a_log_gets_a_line_every_ten_seconds(log: list[str]) -> None:
    clock = Clock()
    march(Progress(RANK_0, io.StringIO(), clock), clock, 40_000, 1e-3)
    assert len(log) == 4
    first = log[0]
    assert "of 40.00 s simulated, 1.0 x real time, about " in first
    done, left = (float(first.split()[i]) for i in (1, -3))
    assert done == pytest.approx(10, abs=1.1) and left == pytest.approx(40 - done, abs=1)
    assert log[-1] == "march: done after 40 s"


def test_the_clock_is_looked_at_once_a_second(log: list[str]) -> None:
    clock = Clock()
    march(Progress(RANK_0, io.StringIO(), clock), clock, 40_000, 1e-3)
    assert clock.looks < 80  # 40 s, and some twenty looks until it is known how long a step takes


def test_steps_that_become_slow_are_still_told(log: list[str]) -> None:
    clock = Clock()
    progress = Progress(RANK_0, io.StringIO(), clock)
    progress.start(stage(10_000))
    view: Any = types.SimpleNamespace(step=0, time=0.0)
    for step in range(4000):
        view.step, view.time = step, step * DT
        progress.observe(view)
        clock.now += 1e-3 if step < 3000 else 0.1
    assert len(log) > 5


def test_short_marches_and_phases_leave_no_line(log: list[str]) -> None:
    clock = Clock()
    progress = Progress(RANK_0, io.StringIO(), clock)
    with progress.phase("mesh"):
        clock.now += 1.0
    march(progress, clock, 5000, 1e-3)
    assert not log


def test_a_long_phase_leaves_a_line(log: list[str]) -> None:
    clock = Clock()
    with Progress(RANK_0, io.StringIO(), clock).phase("equilibrium"):
        clock.now += 3.21
    assert log == ["equilibrium: 3.2 s"]


def test_a_terminal_shows_phases_and_a_bar(log: list[str]) -> None:
    clock, screen = Clock(), Terminal()
    progress = Progress(RANK_0, screen, clock)
    with progress.phase("mesh"):
        assert screen.getvalue().endswith("\rmesh ...\x1b[K")
        clock.now += 5.0
    assert screen.getvalue().endswith("\r\x1b[K")
    march(progress, clock, 2000, 1e-3)
    assert "/2.00 s simulated" in screen.getvalue()
    assert screen.getvalue().endswith("\r")  # the bar goes
    assert not log


def test_a_slow_first_step_foretells_nothing(log: list[str]) -> None:
    """It prepares what later steps use; a thousandth of the march in a second is no hour."""
    clock, screen = Clock(), Terminal()
    progress = Progress(RANK_0, screen, clock)
    progress.start(stage(4000))
    bar = progress._bar
    bar._time = lambda: clock.now
    bar.start_t = bar.last_print_t = clock.now
    view: Any = types.SimpleNamespace(step=0, time=0.0)
    for step in range(1, 1000):
        clock.now += 1.0 if step == 1 else 1e-3
        view.step, view.time = step, step * DT
        progress.observe(view)
    progress.finish("stopped")
    told = set(re.findall(r"x real time, left ([0-9:]+)", screen.getvalue()))
    assert told and max(told) <= "00:04"


@pytest.mark.parametrize(("rank", "quiet"), [(0, True), (1, False)])
def test_quiet_runs_and_other_ranks_show_nothing(rank: int, quiet: bool) -> None:
    comm = types.SimpleNamespace(rank=rank)
    root = logging.getLogger("catenary")
    before = root.handlers[:], root.level, root.propagate
    try:
        set_up_logging(comm, quiet=quiet)
        clock, screen = Clock(), Terminal()
        progress = Progress(comm, screen, clock)
        with progress.phase("mesh"):
            clock.now += 5.0
        looks = clock.looks
        march(progress, clock, 40_000, 1e-3)
        assert not screen.getvalue()
        assert clock.looks == looks
    finally:
        root.handlers, root.level, root.propagate = before
