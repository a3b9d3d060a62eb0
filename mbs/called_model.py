"""A pantograph whose steps a loop of kernels asks of Python, as no kernel takes them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from catenary.mbs.interface import HeadState, Pantograph
from catenary.solver.kernels import native


def called_by_kernels(
    model: Pantograph, after: Callable[[], None] = lambda: None
) -> tuple[native.Head, HeadState, np.ndarray]:
    """Any pantograph in a loop of kernels, which calls ``after`` after each step: its head, the
    latest prediction, and ``Pantograph.places`` at the end of the latest step, in one array."""
    head, places = HeadState(len(model.strip_offsets)), np.array(model.places())

    def predict(time: float) -> None:
        head.numbers[:] = model.predict(time).numbers

    def advance(contact_force: np.ndarray) -> None:
        model.advance(contact_force)
        places[:] = model.places()
        after()

    still = native.NewmarkFactors(0.0, 0.0, 0.0, 0.0, 0.0)
    strips = np.zeros((2, len(model.strip_offsets), 0))
    arrays = native.HeadArrays(strips, np.zeros(0), head.numbers, still, -1)
    return native.CalledHead(arrays, predict, advance), head, places
