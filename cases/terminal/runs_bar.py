"""A bar of runs that are made at the same time, below the lines on those that have ended."""

from __future__ import annotations

import logging
import shutil
import sys
from collections.abc import Callable
from typing import Any, TextIO

# A run shows its own progress if this logger takes messages; several at once share a bar.
_logger = logging.getLogger("catenary.progress")


class RunsBar:
    """Shows how many runs have ended and how long the others will take, if somebody looks on.

    A context manager. Not collective.

    Parameters
    ----------
    n_runs : how many there are; 0 shows nothing
    say : writes a line
    stream : where to, standard error if not given
    what : what is counted
    """

    def __init__(
        self,
        n_runs: int,
        say: Callable[[str], None],
        stream: TextIO | None = None,
        what: str = "runs",
    ) -> None:
        stream = sys.stderr if stream is None else stream
        self._say = say
        self._bar: Any = None
        if n_runs and stream.isatty() and _logger.isEnabledFor(logging.INFO):
            from tqdm import tqdm  # not loaded where nobody looks on

            self._bar = tqdm(
                total=n_runs,
                file=stream,
                leave=False,
                ncols=min(shutil.get_terminal_size().columns, 100),
                bar_format=what + " {percentage:3.0f}% |{bar}| {n} of {total}, left {remaining}",
            )

    def say(self, line: str) -> None:
        """Write a line above the bar."""
        if self._bar is not None:
            self._bar.clear()
        self._say(line)
        if self._bar is not None:
            self._bar.refresh()

    def ended(self, n_runs: int = 1) -> None:
        """Count further runs, one if no number is given."""
        if self._bar is not None:
            self._bar.update(n_runs)

    def __enter__(self) -> RunsBar:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if self._bar is not None:
            self._bar.close()
