"""Graded layers that absorb waves: damping on mass that grows towards an end."""

from __future__ import annotations

import numpy as np

from catenary.solver.model.model import Block, Model


def layer_damping(x: np.ndarray, begin: float, end: float, damping: float) -> np.ndarray:
    """Damping per mass of a layer at places along the track, shape as ``x`` [1/s].

    It grows from zero at ``begin`` to ``damping`` [1/s] at ``end`` as the square of the way into
    the layer, and is zero on the other side of ``begin``. The layer may lie to either side: ``end``
    may be less than ``begin`` [m]. Beyond ``end`` it stays as it is there. Not collective.
    """
    into = np.clip((x - begin) / (end - begin), 0.0, 1.0)
    return np.asarray(damping * into**2)


def layer_blocks(model: Model, begin: float, end: float, damping: float) -> list[Block]:
    """Blocks of damping that make a stretch of a model a layer, for all masses that it has so far.

    Parameters are those of ``layer_damping``; an element takes the value at its middle. Not
    collective.
    """
    x = model.numbering.as_vector(model.mesh.points[:, :1])
    found = []
    for block in model.blocks:
        if block.mass is None:
            continue
        rate = layer_damping(x[block.dofs].mean(axis=1), begin, end, damping)
        inside = np.flatnonzero(rate > 0.0)
        if inside.size:
            matrices = rate[inside, None, None] * block.mass[block.kind[inside]]
            dofs, kind = block.dofs[inside], np.arange(inside.size)
            found.append(Block(block.component, dofs, kind, None, None, matrices))
    return found
