"""The compiled loop that puts together what a step shows of pantographs and strips.

Not collective; see `base.compiled` for how loops are compiled.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.base.kernels.compiled import in_line


class Ends(NamedTuple):
    """Which contacts a strip has, and which strips a pantograph: numbers of the first ones, and of
    all; ``of_strip`` (n_strips + 1,), ``of_pantograph`` (n_pantographs + 1,)."""

    of_strip: np.ndarray
    of_pantograph: np.ndarray


@in_line
def write_outputs(force, reported, heads, depth, ends, outputs):
    """Contact force, head height and wire height of each pantograph, then the force of each strip,
    and, of several contact wires, that on each wire from each pantograph.

    These are the 3 n_pantographs + n_strips numbers of ``outputs``, and the n_pantographs n_wires
    behind them; ``heads`` are those of the contacts, ``ends`` are ``Ends``. A pantograph's force is
    the sum over its contacts, heights are means over its strips; of several wires over a strip the
    lowest counts.
    """
    n = ends.of_pantograph.size - 1
    shares = 3 * n + ends.of_strip.size - 1
    for share in range(shares, outputs.size):
        outputs[share] = 0.0
    several = outputs.size > shares
    for p in range(n):
        total, mean, mean_of_wire = 0.0, 0.0, 0.0
        first, last = ends.of_pantograph[p], ends.of_pantograph[p + 1]
        begin, end = ends.of_strip[first], ends.of_strip[last]
        for strip in range(first, last):
            own, height_of_strip, lowest = 0.0, 0.0, np.inf
            for i in range(ends.of_strip[strip], ends.of_strip[strip + 1]):
                height = heads.place[i]
                for j in range(begin, end):
                    height -= heads.by_force[i, j] * force[j]
                own += reported[i]
                if several:
                    n_wires = ends.of_strip[strip + 1] - ends.of_strip[strip]
                    outputs[shares + p * n_wires + i - ends.of_strip[strip]] += reported[i]
                height_of_strip += height
                lowest = min(lowest, height - depth[i])
            total += own
            mean += height_of_strip / (ends.of_strip[strip + 1] - ends.of_strip[strip])
            mean_of_wire += lowest
            outputs[3 * n + strip] = own
        strips = last - first
        outputs[p], outputs[n + p], outputs[2 * n + p] = total, mean / strips, mean_of_wire / strips
