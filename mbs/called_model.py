"""A pantograph whose steps a loop of kernels asks of Python, as no kernel takes them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from catenary.mbs.interface import HeadState, Pantograph
from catenary.solver.kernels import native


class CalledModel:
    """Any pantograph in a loop of kernels.

    Attributes
    ----------
    head : its latest prediction
    places : ``Pantograph.places`` at the end of the latest step, kept in one array

    Parameters
    ----------
    model : the pantograph
    after : called after each step
    """

    def __init__(self, model: Pantograph, after: Callable[[], None] = lambda: None) -> None:
        self.head = HeadState(len(model.strip_offsets))
        self.places = np.array(model.places())
        self._model, self._after = model, after

    def stepped(self) -> native.Head:
        """A head that calls this, and keeps it: no collector sees a cycle of both."""
        s = len(self._model.strip_offsets)
        still = native.NewmarkFactors(0.0, 0.0, 0.0, 0.0, 0.0)
        arrays = native.HeadArrays(np.zeros((2, s, 0)), np.zeros(0), self.head.numbers, still, -1)
        return native.CalledHead(arrays, self._predict, self._advance)

    def _predict(self, time: float) -> None:
        self.head.numbers[:] = self._model.predict(time).numbers

    def _advance(self, contact_force: np.ndarray) -> None:
        self._model.advance(contact_force)
        self.places[:] = self._model.places()
        self._after()
