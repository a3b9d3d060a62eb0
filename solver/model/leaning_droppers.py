"""Droppers that lean along the track: their directions, and what their force does across them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from catenary.solver.model.links import Direction, between_nodes

if TYPE_CHECKING:
    from catenary.solver.model.model import Model


def dropper_directions(model: Model) -> Direction:
    """Stretch of the droppers as they stand at rest: upright ones in height only."""
    pairs = model.mesh.droppers
    upright = between_nodes(model, pairs)
    if model.form is None or not model.form.leaning(pairs).any():
        return upright
    along, height = _cosines(model)
    unknowns = np.concatenate([upright.unknowns, model.dofs(pairs, "u")], axis=1)
    return Direction(unknowns, _pairwise(height, along))


def across_droppers(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """What a dropper's force N at rest does across it, N / l of a pendulum of its length l.

    Returns
    -------
    unknowns : (n_droppers, 4) height and place along the track of the upper, then of the lower end
    matrices : (n_droppers, 4, 4) [N/m], zero before the shape at rest is known
    """
    pairs = model.mesh.droppers
    unknowns = np.concatenate([model.dofs(pairs), model.dofs(pairs, "u")], axis=1)
    if model.form is None:
        return unknowns, np.zeros((len(pairs), 4, 4))
    along, height = _cosines(model)
    across = _pairwise(-along, height)
    force = np.where(model.broken, 0.0, model.form.dropper_force)
    pull = force / np.hypot(model.form.leaning(pairs), _drop(model))
    return unknowns, pull[:, None, None] * across[:, :, None] * across[:, None, :]


def _drop(model: Model) -> np.ndarray:
    """Height of each dropper's upper end above the lower one at rest [m]."""
    assert model.form is not None
    upper, lower = model.mesh.droppers.T
    return np.asarray(model.form.height[upper] - model.form.height[lower])


def _cosines(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Components of the unit vectors from lower to upper ends: along the track, and upwards."""
    assert model.form is not None
    leaning, drop = model.form.leaning(model.mesh.droppers), _drop(model)
    length = np.hypot(leaning, drop)
    return leaning / length, drop / length


def _pairwise(height: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Weights (n, 4) of heights, then of places along the track, upper less lower end."""
    return np.stack([height, -height, along, -along], axis=1)
