"""What a user waits for."""

from __future__ import annotations

import subprocess
import sys

import pytest


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
    assert -0.02 < float(done.stdout) < 60.0
