"""The observers of a march: they get blocks of steps, which end where one needs a state."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from catenary.base.errors import RunBroken
from catenary.base.petsc import event
from catenary.solver.time_loop.views.observers import NEVER, Observer, Stage, StepView


class ObserverList:
    """The observers of a run. Methods are called on all ranks at the same steps.

    Parameters
    ----------
    observers : in the order in which they are shown what there is
    after : called after each state is shown
    """

    def __init__(self, observers: Sequence[Observer], after: Callable[[], None] | None) -> None:
        self._observers = observers
        self._after = after
        # The latest step that each was shown.
        self._latest = [0] * len(observers)
        self._event = event("Show")

    @property
    def is_there(self) -> bool:
        """Whether there are observers."""
        return bool(self._observers)

    def start(self, stage: Stage) -> None:
        """Start all observers. If one cannot, those before end with its sentence, and RunBroken is
        raised."""
        for number, observer in enumerate(self._observers):
            try:
                observer.start(stage)
            except RunBroken as error:
                ObserverList(self._observers[:number], None).finish(str(error))
                raise

    def next_state(self, step: int) -> int:
        """The next step after ``step`` whose state has to be shown; rows of others will do."""
        if self._after is not None:
            return step + 1
        return min((one.next_state(step) for one in self._observers), default=NEVER)

    def next_motion(self, step: int) -> int:
        """The next step after ``step`` whose motion has to be kept."""
        return min((one.next_motion(step) for one in self._observers), default=NEVER)

    def show(self, view: Callable[[], StepView]) -> None:
        """Show a state to the observers; RunBroken if one cannot go on."""
        if self._observers:
            with self._event:
                shown = view()
                for number, observer in enumerate(self._observers):
                    self._latest[number] = shown.step
                    observer.observe(shown)
        if self._after is not None:
            self._after()

    def show_block(
        self,
        first: int,
        times: np.ndarray,
        rows: np.ndarray,
        views: Iterable[StepView],
    ) -> None:
        """Show a block of steps; RunBroken if an observer cannot go on.

        Parameters
        ----------
        first : int
            Number of the step before the block, which is shown.
        times, rows : ndarray
            Times (k,) [s] and rows (k, n) of its steps.
        views : iterable of StepView
            Views of the steps whose motion is kept, then of the last step.
        """
        last = first + len(times)
        if last == first:
            return
        if self._observers:
            with self._event:
                for view in views:
                    step = view.step
                    for number, observer in enumerate(self._observers):
                        if step < last and observer.next_motion(step - 1) != step:
                            continue
                        since, self._latest[number] = self._latest[number] - first, step
                        view.move_to(step, times[since : step - first], rows[since : step - first])
                        observer.observe(view)
        if self._after is not None:
            self._after()

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
