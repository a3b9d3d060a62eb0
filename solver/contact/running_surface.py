"""The running surface of contact wires above their axes, as samples along the track."""

from __future__ import annotations

import numpy as np

from catenary.meshgen.wires import Role
from catenary.solver.kernels.native import SAMPLE
from catenary.solver.model.model import Model

# Samples to the shortest wave. A cubic with the heights and slopes of a sine at its ends is off by
# (k h)^4 / 384 = 2e-4 of its amplitude at most.
PER_WAVE = 12


def surface_samples(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Samples of all contact wires, wire by wire, records of ``SAMPLE``, and of each wire the first
    and the one after its last, (n_wires, 2). Not collective."""
    shapes = model.simulated.surface
    wires = model.problem.line.wires_of(Role.CONTACT)
    parts = [np.zeros(0, dtype=SAMPLE)]
    for wire in wires if shapes else ():
        x = np.unique(np.concatenate([shape.places(PER_WAVE) for shape in shapes]))
        samples = np.zeros(x.size, dtype=SAMPLE)
        samples["x"] = x
        for shape in shapes:
            height, slope = shape.at(wire.name, x)
            samples["height"] += height
            samples["slope"] += slope
        parts.append(samples)
    ends = np.cumsum([0, *(part.size for part in parts[1:])])
    if not shapes:
        return parts[0], np.zeros((len(wires), 2), dtype=np.int64)
    return np.concatenate(parts), np.stack([ends[:-1], ends[1:]], axis=1)
