"""Keeps what statistics need of a march."""

from __future__ import annotations

import numpy as np

from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.observers import NEVER, Observer, Stage, StepView

_OF_LINE = ("arm_uplift", "dropper_force")


class Keeper(Observer):
    """Keeps histories of the train, and extremes of arms and droppers, in memory. One rank only."""

    def start(self, stage: Stage) -> None:
        """Forget everything."""
        self._times: list[np.ndarray] = []
        self._rows: dict[str, list[np.ndarray]] = {}
        self._extremes: dict[str, np.ndarray] = {}

    def next_state(self, step: int) -> int:
        """Rows will do."""
        return NEVER

    def observe(self, view: StepView) -> None:
        """Keep the steps of a view."""
        self._times.append(view.times.copy())
        for name in view.columns:
            values = view.each(name)
            if name in _OF_LINE:
                low, high = values.min(axis=0), values.max(axis=0)
                kept = self._extremes.setdefault(name, np.stack([low, high]))
                np.minimum(kept[0], low, out=kept[0])
                np.maximum(kept[1], high, out=kept[1])
            elif (
                values.shape[1]
                and name in channels.CHANNELS
                and not channels.CHANNELS[name].of_line
            ):
                self._rows.setdefault(f"channels/{name}", []).append(values.copy())

    def tables(self) -> dict[str, np.ndarray]:
        """Histories by their paths in a result file, ``time`` among them."""
        joined = {path: np.concatenate(parts) for path, parts in self._rows.items()}
        return {"time": np.concatenate(self._times), **joined}

    def extremes(self) -> dict[str, np.ndarray]:
        """Smallest and largest value of each column of a channel of the line, (2, columns)."""
        return self._extremes
