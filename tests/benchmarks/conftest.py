"""What benchmarks share with each other and with the processes that they start."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

sys.path.insert(0, str(Path(__file__).with_name("drivers")))


@pytest.fixture(scope="module")
def processor_time() -> Iterator[None]:
    """Times marches by the processor time of their thread: other programs disturb that little."""
    from catenary.solver.time_loop import march

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(
            march,
            "clock",
            SimpleNamespace(perf_counter=time.thread_time, process_time=time.process_time),
        )
        yield
