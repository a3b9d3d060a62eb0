"""Settings, gains and memory of a regulated lift, as kernels take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.kernels import native

_N_MEMORY = native.REGULATION_MEMORY.itemsize // 8


class ControlArrays(NamedTuple):
    """A controller; `solver/kernels/heads/regulation.hpp` says what the names stand for.

    Attributes
    ----------
    settings : (1,) ``native.REGULATION``
    gains : (g,) ``native.CONTROL_GAINS``
    numbers : (k,) all that is remembered: ``memory``, and behind it forces that wait
    """

    settings: np.ndarray
    gains: np.ndarray
    numbers: np.ndarray

    @property
    def memory(self) -> np.ndarray:
        """What has names of what is remembered, (1,) ``native.REGULATION_MEMORY``."""
        return self.numbers[:_N_MEMORY].view(native.REGULATION_MEMORY)

    @property
    def waiting(self) -> np.ndarray:
        """Forces that wait [N]."""
        return self.numbers[_N_MEMORY:]


def control_arrays(
    settings: dict[str, float],
    gains: tuple[tuple[float, float, float, float], ...],
    n_delayed: int,
    from_time: float,
) -> ControlArrays:
    """A controller before its first step, with a delay in samples and the first of these [s]."""
    made = np.zeros(1, dtype=native.REGULATION)
    for name, value in settings.items():
        made[name] = value
    numbers = np.zeros(_N_MEMORY + n_delayed)
    control = ControlArrays(made, np.array(list(gains), dtype=native.CONTROL_GAINS), numbers)
    control.memory["next"], control.memory["samples"] = from_time, -1.0
    return control
