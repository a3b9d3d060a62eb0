"""What a user waits for: the parts of a run, and loops that are compiled in them."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from typing import Any

import numba
import pytest

from catenary.cases.run.performance import Phases


class Heard:
    """What a run's progress is told."""

    def __init__(self) -> None:
        self.lines: list[tuple[int, float]] = []
        self.last = (0, 0.0)

    def phase(self, name: str) -> Any:
        return contextlib.nullcontext()

    def waits_for_compiler(self, count: int, spent: float) -> None:
        self.lines.append((count, spent))

    def compiled(self, count: int, spent: float) -> None:
        self.last = count, spent


def test_loops_that_are_compiled_in_a_phase_are_counted_and_timed() -> None:
    @numba.njit
    def inner(x: float) -> float:
        return 2.0 * x

    @numba.njit
    def outer(x: float) -> float:
        return inner(x) + 1.0

    heard = Heard()
    phases = Phases(heard)  # type: ignore[arg-type]
    with phases("march"):
        assert outer(1.0) == 3.0
    told = len(heard.lines)
    assert told == 2 and [count for count, _ in heard.lines] == [0, 0], "one is part of the other"
    with phases("report"):
        assert outer(2.0) == 5.0
    assert len(heard.lines) == told, "a loop is compiled once"
    phases.tell_compiled()
    count, spent = heard.last
    assert count == 2 and 0.0 < spent <= phases.wall["march"]
    # Outside of phases nobody listens.
    assert outer(1) == 3.0
    assert len(heard.lines) == told


@pytest.mark.process
def test_the_wait_counts_from_the_start_of_the_process() -> None:
    """Not from the import that reads the clock: half a second before that is counted too. The
    system tells the start in hundredths of a second."""
    code = (
        "import time; begin = time.perf_counter(); time.sleep(0.5);"
        "from catenary.cases.terminal.console import waited;"
        "print(waited() - (time.perf_counter() - begin))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert -0.02 < float(done.stdout) < 5.0
