"""What a user waits for: processor time of ``catenary run``, by part, from the prompt to the next.

Run by ``make bench``. The least time of each part in several runs, loops compiled before.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

DRIVER = Path(__file__).with_name("drivers") / "whole_run.py"
ROUNDS = 6
MARCH, REPORT = "march and records", "report"


def spent() -> float:
    """Processor time of all processes that were waited for, user and system [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def one_run(case: str, out: Path) -> dict[str, float]:
    # As the program itself, whatever the shell says of Python's own settings, such as of bytecode.
    words = [sys.executable, "-E", str(DRIVER), case, "-o", str(out), "--force", "--quiet"]
    before = spent()
    done = subprocess.run(words, capture_output=True, text=True, check=True, env=dict(os.environ))
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["code"] == 0, done.stderr
    parts = dict(found["parts"])
    return {**parts, "end of the process": spent() - before - sum(parts.values())}


@pytest.mark.parametrize("case", ["ambrosio2012", "en50318_2002"])
def test_parts_of_a_whole_run(case: str, benchmark: Any, tmp_path: Path) -> None:
    one_run(case, tmp_path)
    runs: list[dict[str, float]] = []
    benchmark.pedantic(lambda: runs.append(one_run(case, tmp_path)), rounds=ROUNDS)
    parts = {name: min(run[name] for run in runs) for name in runs[0]}
    total = sum(parts.values())
    print(f"\n\ncatenary run {case}, one rank, processor time [s]")
    for name, cost in parts.items():
        print(f"  {name:46}{cost:7.2f}{cost / parts[MARCH]:7.2f} of the march")
    print(f"  {'whole run':46}{total:7.2f}{total / parts[MARCH]:7.2f}")
    assert {MARCH, REPORT} <= set(parts) and min(parts.values()) > 0.0
    benchmark.extra_info.update({**parts, "of_the_march": total / parts[MARCH]})
