"""How time, start-up and memory grow with spans and ranks. Run by ``make bench``.

Whole processes, one after the other: each starts anew, so that memory is its own. Figures of two
ranks need two free cores.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from program import MPIRUN

DRIVERS = Path(__file__).parent / "drivers"
# The Makefile says how this machine's MPI takes more ranks than cores, and root.
MPI_FLAGS = os.environ.get("MPI_FLAGS", "").split()
SPANS = (10, 25, 100, 1000, 10_000)
# Steps that take some tenths of a second on each of them.
STEPS = {10: 6000, 25: 4000, 100: 2000, 1000: 150, 10_000: 15}
PREDICTED_RANKS = (64, 512, 4096)
# Numbers of a step's reduction and broadcast with one contact, and of a neighbour's overlap of one
# span, 90 stations of 4 unknowns; 8 bytes each.
REDUCED, REPLIED, OVERLAP = 8, 68, 360


def driver(name: str, *arguments: object, ranks: int = 1) -> dict[str, Any]:
    """What a driver prints."""
    command = [sys.executable, "-m", "mpi4py", str(DRIVERS / name), *map(str, arguments)]
    if ranks > 1:
        assert MPIRUN is not None
        command = [MPIRUN, "-n", str(ranks), *MPI_FLAGS, *command]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=1200)
    assert done.returncode == 0, done.stderr[-2000:]
    found: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return found


def test_growth_with_spans() -> None:
    print("\n\none rank       unknowns   us a step   us a span   at rest [s]   ready [s]"
          "   memory [MB]   kB a span")  # fmt: skip
    first = None
    for spans in SPANS:
        found = driver("step_cost.py", spans, STEPS[spans])
        peak = found["peak_bytes"]
        first = peak if first is None else first
        print(
            f"{spans:6} spans {found['unknowns']:10}{found['us_per_step']:12.1f}"
            f"{found['us_per_step'] / spans:12.3f}{found['rest_s']:14.2f}{found['ready_s']:12.2f}"
            f"{peak / 1e6:14.0f}{(peak - first) / 1e3 / spans:12.0f}"
        )


@pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")
def test_scaling_over_ranks() -> None:
    one, half = driver("step_cost.py", 1000, 300), driver("step_cost.py", 500, 600)
    two = driver("step_cost.py", 1000, 300, ranks=2)
    strong = one["us_per_step"] / two["us_per_step"] / 2
    weak = half["us_per_step"] / two["us_per_step"]
    print("\n\n                       us a step   efficiency")
    print(f" 500 spans on 1 rank  {half['us_per_step']:10.0f}")
    print(f"1000 spans on 1 rank  {one['us_per_step']:10.0f}")
    print(f"1000 spans on 2 ranks {two['us_per_step']:10.0f}   strong {100 * strong:.0f} %, "
          f"weak {100 * weak:.0f} %")  # fmt: skip
    predict(one, driver("ping.py", ranks=2))


def predict(one: dict[str, Any], wire: dict[str, float]) -> None:
    """A prediction for many ranks from one rank's step and a message's latency and bandwidth.

    Work is shared; a step exchanges ghosts and overlaps with two neighbours at once, and sums up
    and broadcasts over a tree of log2 ranks. Nothing of it was measured on so many ranks.
    """

    def message(numbers: int) -> float:
        return 1e6 * (wire["latency_s"] + 8 * numbers * wire["s_per_byte"])

    work, per_unknown = one["us_per_step"], one["us_per_step"] / one["unknowns"]
    print(f"\nmessage: {1e6 * wire['latency_s']:.2f} us and "
          f"{1e-9 / wire['s_per_byte']:.1f} GB/s between two ranks of this machine")  # fmt: skip
    print("prediction for 10 000 spans, us a step:")
    for ranks in PREDICTED_RANKS:
        share = 10 * work / ranks + 2 * OVERLAP * per_unknown
        talk = 2 * message(4) + 2 * message(OVERLAP)
        tree = np.log2(ranks) * (message(REDUCED) + message(REPLIED))
        total = share + talk + tree
        print(f"  {ranks:5} ranks {total:8.0f} (line {share:.0f}, neighbours {talk:.0f}, "
              f"tree {tree:.0f}), efficiency {100 * 10 * work / ranks / total:.0f} %")  # fmt: skip
