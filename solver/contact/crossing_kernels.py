"""Where contact wires that move sideways are across the track: a compiled loop of contacts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.base.kernels.compiled import in_line
from catenary.solver.integrators.state_kernels import displacement_at, velocity_at


class Sideways(NamedTuple):
    """Unknowns (v, theta_z) of the contact wires' nodes on a rank: their numbers ``local``
    (n_nodes, 2), 0 where another rank owns them; whether this one does, ``owned``; what they are at
    ``rest``, lateral places [m] and slopes [-]. Without rows where no lateral motion is
    simulated."""

    local: np.ndarray
    owned: np.ndarray
    rest: np.ndarray


@in_line
def find_across(motion, touches, sideways, train_speed, across):
    """A rank's share of where wires are across the track at each touch, y + v, of the total rate of
    that, dv/dt + V (dy/dx + dv/dx), and of the displacement v itself, into ``across`` (3, n).

    Zero where the wire is not on the strip.
    """
    for i in range(touches.size):
        touch = touches[i]
        place, rate, moved = 0.0, 0.0, 0.0
        for k in range(4 if touch.present != 0.0 else 0):
            node, unknown = touch.element + k // 2, k % 2
            if sideways.owned[node, unknown] == 0.0:
                continue
            at, value, slope = (
                sideways.local[node, unknown],
                touch.whole_value[k],
                touch.whole_slope[k],
            )
            own, rest = displacement_at(at, motion), sideways.rest[node, unknown]
            moved += value * own
            place += value * (rest + own)
            rate += value * velocity_at(at, motion) + train_speed * slope * (rest + own)
        across[0, i], across[1, i], across[2, i] = place, rate, moved


def no_sideways() -> Sideways:
    """Of a line without lateral motion."""
    nothing = np.zeros((0, 2))
    return Sideways(nothing.astype(np.int64), nothing, nothing)
