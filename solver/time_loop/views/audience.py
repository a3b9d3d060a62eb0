"""All who watch a march: shown step by step, or blocks of steps where they need no more."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from catenary.solver.base.errors import RunBroken
from catenary.solver.base.petsc_events import event
from catenary.solver.time_loop.views.observers import (
    BlockObserver,
    MotionObserver,
    Observer,
    Stage,
    StepView,
)

_NEVER = 2**62


class Audience:
    """The observers of a run. Methods are called on all ranks at the same steps.

    Parameters
    ----------
    observers : in the order in which they are shown what there is
    after : called after each state is shown
    """

    def __init__(self, observers: Sequence[Observer], after: Callable[[], None] | None) -> None:
        self._observers = observers
        self._blockwise = [one for one in observers if isinstance(one, BlockObserver)]
        self._of_motion = [one for one in self._blockwise if isinstance(one, MotionObserver)]
        self._after = after
        self._event = event("Show")

    @property
    def is_there(self) -> bool:
        """Whether there are observers."""
        return bool(self._observers)

    def start(self, stage: Stage) -> None:
        """Let all begin. If one cannot, those before end with its sentence, and RunBroken is
        raised."""
        for number, observer in enumerate(self._observers):
            try:
                observer.start(stage)
            except RunBroken as error:
                Audience(self._observers[:number], None).finish(str(error))
                raise

    def next_state(self, step: int) -> int:
        """The next step after ``step`` whose state has to be shown; rows of others will do."""
        if self._after is not None or len(self._blockwise) < len(self._observers):
            return step + 1
        return min((one.next_state(step) for one in self._blockwise), default=_NEVER)

    def next_motion(self, step: int) -> int:
        """The next step after ``step`` whose motion has to be kept; see ``MotionObserver``."""
        return min((one.next_motion(step) for one in self._of_motion), default=_NEVER)

    def show(self, view: Callable[[], StepView]) -> None:
        """Show a state to the observers; RunBroken if one cannot go on."""
        if self._observers:
            self._event.begin()
            try:
                shown = view()
                for observer in self._observers:
                    observer.observe(shown)
            finally:
                self._event.end()
        if self._after is not None:
            self._after()

    def show_rows(self, first_step: int, times: np.ndarray, rows: np.ndarray) -> None:
        """Show the rows of steps whose states no observer needs; see ``BlockObserver``."""
        if not times.size:
            return
        self._event.begin()
        try:
            for observer in self._blockwise:
                observer.observe_rows(first_step, times, rows)
        finally:
            self._event.end()

    def show_motion(self, view: StepView) -> None:
        """Show what was kept of a step whose row is shown."""
        self._event.begin()
        try:
            for observer in self._of_motion:
                observer.observe_motion(view)
        finally:
            self._event.end()

    def finish(self, outcome: str) -> str:
        """Call the ``finish`` of all observers; return how the march ended after that.

        An observer that breaks now changes a good end to its sentence for those that follow.
        """
        for observer in self._observers:
            try:
                observer.finish(outcome)
            except RunBroken as error:
                if outcome in ("done", "interrupted"):
                    outcome = str(error)
        return outcome
