"""How time, start-up and memory grow with spans and ranks. Run by ``make bench``.

Whole processes, one after the other: each starts anew, so that memory is its own. Figures of two
ranks need two free cores.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from program import MPIRUN, catenary

needs_mpirun = pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")
_first: dict[str, Any] = {}
_a_span: list[float] = []
DRIVERS = Path(__file__).parent / "drivers"
# The Makefile says how this machine's MPI takes more ranks than cores, and root.
MPI_FLAGS = os.environ.get("MPI_FLAGS", "").split()
SPANS = (10, 25, 100, 1000, 10_000)
# What a step costs whatever the line's length is nothing beside the rest from here on.
PROPORTIONAL_FROM = 100
# Steps that take some tenths of a second on each of them.
STEPS = {10: 6000, 25: 4000, 100: 2000, 1000: 150, 10_000: 15}
# Turns of scaling over ranks, some ten milliseconds each: as short as the lulls of a busy machine.
TURNS, STEPS_OF_A_TURN = 160, 30_000
# Spans of which one rank's share of the state fits the fast caches, the shared one, and none.
SHARES = (100, 300, 1000)
# Two neighbours, a sum and a broadcast; a rank whose droppers may slacken tells of them besides.
MOST_MESSAGES = 2 + 2 + 1


def driver(name: str, *arguments: object, ranks: int = 1) -> dict[str, Any]:
    """What a driver prints."""
    command = [sys.executable, "-m", "mpi4py", str(DRIVERS / name), *map(str, arguments)]
    if ranks > 1:
        assert MPIRUN is not None
        command = [MPIRUN, "-n", str(ranks), *MPI_FLAGS, *command]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    environment["STARTED_AT"] = str(time.time())
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=1200)
    assert done.returncode == 0, done.stderr[-2000:]
    found: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return found


def keep(benchmark: Any, found: dict[str, Any]) -> None:
    """Store what a driver found in the JSON; the clock of this process says nothing."""
    benchmark.extra_info.update(found)
    benchmark.pedantic(lambda: None)


@pytest.mark.parametrize("spans", SPANS)
def test_growth_with_spans(benchmark: Any, spans: int) -> None:
    found = driver("step_cost.py", spans, STEPS[spans])
    if spans == SPANS[0]:
        print(
            "\n\none rank       unknowns   us a step (fastest)   us a span   of the floor"
            "   of walking through the state   at rest [s]   ready [s]   memory [MB]   kB a span"
        )
    peak = found["peak_bytes"]
    begun = _first.setdefault("peak_bytes", peak)
    print(
        f"{spans:6} spans {found['unknowns']:10}{found['us_per_step']:12.1f}"
        f"{found['us_fastest']:10.1f}{found['us_fastest'] / spans:12.3f}"
        f"{found['us_floor'] / spans:15.3f}{found['us_streamed'] / spans:31.3f}"
        f"{found['rest_s']:14.2f}{found['ready_s']:12.2f}"
        f"{peak / 1e6:14.0f}{(peak - begun) / 1e3 / spans:12.0f}"
    )
    if spans >= PROPORTIONAL_FROM:
        _a_span.append(found["us_fastest"] / spans)
    if spans == SPANS[-1]:
        low, high = min(_a_span), max(_a_span)
        middle = 0.5 * (low + high)
        print(
            f"{PROPORTIONAL_FROM} to {spans} spans: {middle:.3f} us a span, "
            f"within {100 * (high / middle - 1):.1f} %"
        )
    keep(benchmark, found)


@needs_mpirun
def test_a_line_of_ten_thousand_spans_on_two_ranks(benchmark: Any) -> None:
    found = driver("step_cost.py", SPANS[-1], STEPS[SPANS[-1]], ranks=2)
    print(f"\n\n{SPANS[-1]} spans on 2 ranks: {found['us_per_step']:.0f} us a step, ready after "
          f"{found['ready_s']:.0f} s, {found['peak_bytes'] / 1e9:.1f} GB")  # fmt: skip
    assert found["peak_bytes"] < 20 * 2**30
    keep(benchmark, found)


@needs_mpirun
@pytest.mark.parametrize("spans", SHARES)
def test_scaling_over_ranks(benchmark: Any, spans: int) -> None:
    """Two ranks against one, in turns: as many spans in all (strong) or on each rank (weak).

    Two ranks wait for each other at every step, so that whatever else the machine does on either
    core keeps both. The fastest of the turns tells most of the program, half of the turns what it
    was like; so do two marches side by side that do not talk to each other: what two ranks lose
    against them they lose by being two, and the rest is the machine's.
    """
    turns = driver("scaling.py", spans, TURNS, STEPS_OF_A_TURN // spans, ranks=2)
    costs = {name: np.array(values) for name, values in turns.items()}
    print(f"\n\nus a step, {TURNS} turns of {STEPS_OF_A_TURN // spans} steps"
          "     fastest turn   half of the turns")  # fmt: skip
    for name, what in (
        ("one", f"{spans} spans on 1 rank"),
        ("two", f"{spans} spans on 2 ranks"),
        ("twice", f"{2 * spans} spans on 2 ranks"),
        ("halves", f"{spans // 2} spans each, side by side"),
        ("each", f"{spans} spans each, side by side"),
    ):
        print(f"  {what:36}{costs[name].min():15.1f}{np.median(costs[name]):18.1f}")
    found: dict[str, float] = {}
    for what, faster, slower, ranks in (
        ("strong scaling", "one", "two", 2),
        ("weak scaling", "one", "twice", 1),
        ("strong, of two side by side", "halves", "two", 1),
        ("weak, of two side by side", "each", "twice", 1),
    ):
        best = costs[faster].min() / costs[slower].min() / ranks
        # Of each turn by itself: the machine may be another one some turns later.
        half = np.median(costs[faster] / costs[slower]) / ranks
        print(f"  {what:36}{100 * best:13.0f} %{100 * half:16.0f} %")
        found |= {what: best, f"{what}, half of the turns": half}
    keep(benchmark, found)


@needs_mpirun
def test_messages_of_a_step(benchmark: Any) -> None:
    """The rank that sends most, on more and more ranks that share the two cores."""
    print("\n\nranks   messages a step   bytes a step")
    for ranks in (2, 3, 5, 8):
        found = driver("step_cost.py", 100, 500, ranks=ranks)
        print(f"{ranks:5}{found['messages']:18.2f}{found['message_bytes']:15.0f}")
        assert found["messages"] < MOST_MESSAGES
    keep(benchmark, {})


@needs_mpirun
def test_prediction_for_many_ranks(benchmark: Any, tmp_path: Path) -> None:
    """From messages between two ranks, and beside the exchange on eight that share the cores."""
    for ranks in (2, 8):
        words = "scaling", "ambrosio2012", "--set", "line.n_spans=10000"
        done = catenary(*words, cwd=tmp_path, ranks=ranks)
        assert done.code == 0, done.stderr
        print(f"\n\n{done.stdout}")
    keep(benchmark, {})
