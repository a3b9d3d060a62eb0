"""Lets tests import what they share, the modules of ``tests/support``, by their plain names."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings

# Files to begin with, as cores become free: those that compile most. The first compiles the loop of
# steps, which takes longest and which nearly all later files need; the next ones compile parts of
# lines of other widths in the meantime. No two cores compile the same at a time.
FIRST = (
    "regression/test_cases.py",
    "unit/solver/test_repeated_blocks.py",
    "unit/solver/test_station_passes.py",
    "unit/solver/test_lines_in_two_passes.py",
    "unit/solver/test_varying_stations.py",
    "unit/solver/test_wires_that_come_and_go.py",
    "regression/test_hard_cases.py",
    "regression/test_fuzz.py",
)

# Hypothesis draws the same examples for everybody: what fails in one place fails in all. Others are
# drawn by `make fuzz`.
settings.register_profile("same", derandomize=True)
settings.register_profile("others", derandomize=False)
settings.load_profile("same")

sys.path.insert(0, str(Path(__file__).with_name("support")))

# The linear algebra of tests is small: threads would wait for each other.
for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(threads, "1")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put ``FIRST`` first; the others keep their order."""
    first = [Path(__file__).parent / name for name in FIRST]
    items.sort(key=lambda item: first.index(item.path) if item.path in first else len(first))
