"""A progress bar of the march on rank 0's standard error; silent when that is no terminal."""

from __future__ import annotations

import sys
import time
from typing import Any

from tqdm import tqdm

from catenary.solver.observation import Stage, StepView


class Progress:
    """Observer that shows simulated time, real-time factor and time left. Not collective."""

    def __init__(self, comm: Any) -> None:
        self._shows = comm.rank == 0 and sys.stderr.isatty()
        self._bar: Any = None

    def start(self, stage: Stage) -> None:
        """Open the bar."""
        if self._shows:
            end = stage.start_time + (stage.n_steps - self._first(stage)) * stage.dt
            self._dt = stage.dt
            self._start = stage.start_time
            self._clock = time.perf_counter()
            self._bar = tqdm(
                total=round(end - stage.start_time, 3),
                unit="s",
                desc="march",
                mininterval=0.1,
                bar_format="{desc} {percentage:3.0f}% |{bar}| {n:.2f}/{total:.2f} s simulated, "
                "{postfix} left {remaining}",
            )

    def observe(self, view: StepView) -> None:
        """Move the bar on; it redraws itself at most ten times a second."""
        if self._bar is not None and view.time > self._start:
            factor = (view.time - self._start) / max(time.perf_counter() - self._clock, 1e-9)
            self._bar.set_postfix_str(f"{factor:.1f} x real time,", refresh=False)
            self._bar.update(self._dt)

    def finish(self, outcome: str) -> None:
        """Close the bar."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None

    @staticmethod
    def _first(stage: Stage) -> int:
        return round(stage.start_time / stage.dt)
