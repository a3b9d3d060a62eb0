"""Progress of a run on the terminal: its phases, and how far the march has come.

On a terminal that is a line or a bar which the next one replaces. Elsewhere, as in the log of a
batch job, it is a plain line for a phase that took long, and one every so often while the line
marches. Both go to standard error on rank 0, and only where the log takes messages of its level.
"""

from __future__ import annotations

import logging
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from catenary.postproc.evaluate.wording import duration
from catenary.postproc.files.run_schema import DONE
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView

logger = logging.getLogger("catenary.progress")

# Wall time between two plain lines of a march, and from which a phase gets a line of its own [s].
LINE_EVERY, LONG_PHASE = 10.0, 2.0
# Wall time between two readings of the clock during a march, with a bar and without [s].
_LOOK_AT_BAR, _LOOK_AT_LINES = 0.1, 1.0
# Steps until the next reading grow at most by this factor.
_GROWTH = 2
_NEVER = sys.maxsize


class Progress(Observer):
    """Phases of a run, and an observer of its march. Not collective.

    Parameters
    ----------
    comm : mpi4py communicator; rank 0 shows
    stream : where to, standard error if not given
    clock : wall time [s]
    """

    def __init__(
        self,
        comm: Any,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._stream = sys.stderr if stream is None else stream
        self._clock = clock
        self._shows = comm.rank == 0 and logger.isEnabledFor(logging.INFO)
        self._on_terminal = self._shows and self._stream.isatty()
        self._bar: Any = None
        self._next_look = _NEVER

    @contextmanager
    def phase(self, name: str) -> Iterator[None]:
        """Show the name of what is done inside, afterwards its wall time if that was long."""
        begin = self._clock()
        if self._on_terminal:
            self._replace_line(f"{name} ...")
        try:
            yield
        finally:
            if self._on_terminal:
                self._replace_line("")
        spent = self._clock() - begin
        if self._shows and not self._on_terminal and spent >= LONG_PHASE and name != "march":
            logger.info("%s: %.1f s", name, spent)

    def start(self, stage: Stage) -> None:
        """Begin to watch a march."""
        if not self._shows:
            return
        self._dt, self._start = stage.dt, stage.start_time
        self._total = stage.n_steps * stage.dt - stage.start_time
        self._begin = self._clock_read_at = self._line_at = self._clock()
        self._step = round(stage.start_time / stage.dt)
        self._done, self._lines, self._is_first_look = 0.0, 0, True
        self._next_look = self._step + 1
        if self._on_terminal:
            from tqdm import tqdm  # not loaded where nobody looks on

            self._replace_line("")
            self._bar = tqdm(
                total=round(self._total, 3),
                unit="s",
                desc="march",
                file=self._stream,
                leave=False,
                mininterval=0.1,
                ncols=min(shutil.get_terminal_size().columns, 100),  # 80 if it does not say
                bar_format="{desc} {percentage:3.0f}% |{bar}| {n:.2f}/{total:.2f} s simulated"
                "{postfix}, left {remaining}",
            )

    def next_state(self, step: int) -> int:
        """The step of the next reading of the clock."""
        return max(step + 1, self._next_look)

    def observe(self, view: StepView) -> None:
        """Read the clock now and then; most steps are passed over."""
        if view.step < self._next_look:
            return
        now, steps = self._clock(), view.step - self._step
        every = _LOOK_AT_BAR if self._on_terminal else _LOOK_AT_LINES
        per_look = steps * every / max(now - self._clock_read_at, 1e-9)
        self._next_look = view.step + max(1, min(int(per_look), _GROWTH * steps))
        self._step, self._clock_read_at = view.step, now
        done = view.time - self._start
        factor = done / max(now - self._begin, 1e-9)
        if self._bar is not None and self._is_first_look:
            # The first step also makes what later ones use: its time would foretell hours.
            self._bar.unpause()
            self._begin, self._is_first_look = now, False
        elif self._bar is not None:
            self._bar.set_postfix_str(f"{factor:.1f} x real time", refresh=False)
            self._bar.update(done - self._done)
        elif now - self._line_at >= LINE_EVERY and factor > 0:
            self._line_at = now
            self._lines += 1
            left = (self._total - done) / factor
            logger.info(
                "march: %.2f of %.2f s simulated, %s x real time, about %s left",
                done,
                self._total,
                f"{factor:.1f}" if factor >= 0.95 else f"{factor:.2g}",
                duration(left),
            )
        self._done = done

    def finish(self, outcome: str) -> None:
        """Close the bar, or end the lines of a march that had any."""
        self._next_look = _NEVER
        if self._bar is not None:
            if outcome == DONE:
                self._bar.update(max(self._total - self._done, 0.0))
            self._bar.close()
            self._bar = None
        elif self._shows and self._lines:
            how = "done" if outcome == DONE else "stopped"
            logger.info("march: %s after %s", how, duration(self._clock() - self._begin))

    def _replace_line(self, text: str) -> None:
        self._stream.write(f"\r{text}\x1b[K")
        self._stream.flush()
