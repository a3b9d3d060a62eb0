"""Directions of links in the unknowns of a model: at nodes, between them, and within elements."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from catenary.solver.model.elements.shape_functions import shape_values
from catenary.solver.model.links.links import Direction

if TYPE_CHECKING:
    from catenary.solver.model.model import Model


def at_nodes(model: Model, nodes: np.ndarray, unknown: str = "w") -> Direction:
    """Stretch that is the displacement of a node each, ``nodes`` (n,): links to the ground."""
    unknowns = model.dofs(nodes, unknown)[:, None]
    return Direction(unknowns, np.ones(unknowns.shape))


def between_nodes(model: Model, pairs: np.ndarray, unknown: str = "w") -> Direction:
    """Displacement of the first node less that of the second, ``pairs`` (n, 2)."""
    unknowns = model.dofs(pairs, unknown)
    return Direction(unknowns, np.broadcast_to(np.array([1.0, -1.0]), unknowns.shape))


def at_places(
    model: Model, wire: str, x: np.ndarray, plane: tuple[str, str] = ("w", "theta_y")
) -> Direction:
    """Deflection of a wire at places ``x`` (n,) [m], which may be between its nodes.

    By the Hermite functions of the element there, in a ``plane`` of deflection and slope.
    """
    nodes = model.mesh.wires[wire]
    at = model.mesh.x(nodes)
    element = np.clip(np.searchsorted(at, x) - 1, 0, at.size - 2)
    length = np.diff(at)[element]
    weights = shape_values((x - at[element]) / length, length).T
    ends = nodes[element[:, None] + [0, 1]]
    unknowns = np.stack([model.dofs(ends, name) for name in plane], axis=2).reshape(-1, 4)
    return Direction(unknowns, np.ascontiguousarray(weights))


def difference(upper: Direction, lower: Direction) -> Direction:
    """Stretch of links from ``lower`` to ``upper`` places."""
    return Direction(
        np.concatenate([upper.unknowns, lower.unknowns], axis=1),
        np.concatenate([upper.weights, -lower.weights], axis=1),
    )
