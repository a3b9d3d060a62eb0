"""Directions of links in the unknowns of a model: at nodes, between them, and within elements."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from catenary.solver.model.beam import shape_values
from catenary.solver.model.links import Direction
from catenary.solver.model.unknowns import UPRIGHT

if TYPE_CHECKING:
    from catenary.solver.model.model import Model


def at_nodes(model: Model, nodes: np.ndarray) -> Direction:
    """Vertical displacement of a node each, ``nodes`` (n,), as stretch: links to the ground."""
    unknowns = model.dofs(nodes, "w")[:, None]
    return Direction(unknowns, np.ones(unknowns.shape))


def between_nodes(model: Model, pairs: np.ndarray, unknown: str = "w") -> Direction:
    """Displacement of the first node less that of the second, ``pairs`` (n, 2)."""
    unknowns = model.dofs(pairs, unknown)
    return Direction(unknowns, np.broadcast_to(np.array([1.0, -1.0]), unknowns.shape))


def at_places(
    model: Model, wire: str, x: np.ndarray, plane: tuple[str, str] = UPRIGHT
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


# Displacements along the components of a dropper's vector.
_ALONG, _SIDEWAYS, _UP = range(3)
_NAMES = ("u", "v", "w")
# Parts of unit vectors below this are none: what round-off leaves of upright droppers [-].
_LEAST = 1e-9


def dropper_directions(model: Model) -> Direction:
    """Stretch of the droppers as they stand at rest: upright ones in height only."""
    pairs = model.mesh.droppers
    if model.form is None:
        return between_nodes(model, pairs)
    unit, _ = _unit_vectors(model)
    return _along(model, unit, (_UP,))


def across_droppers(model: Model) -> tuple[Direction, np.ndarray]:
    """Transverse stiffness of droppers in the plane along the track: N / l, as of a pendulum of the
    dropper's length l with its force N at rest.

    Returns
    -------
    direction : Direction of each
    stiffness : (n_droppers,) [N/m], zero before the shape at rest is known
    """
    unit, pull = _unit_vectors(model)
    return _along(model, _across(unit), (_UP, _ALONG)), pull


def sideways_of_droppers(model: Model) -> tuple[Direction, np.ndarray]:
    """Transverse stiffness across the track, at right angles to that of ``across_droppers``."""
    unit, pull = _unit_vectors(model)
    return _along(model, np.cross(unit, _across(unit)), (_SIDEWAYS,)), pull


def swings_of_droppers(model: Model) -> list[tuple[Direction, np.ndarray]]:
    """Transverse stiffness of droppers in the planes of the model beside the vertical one, plane by
    plane: directions of all droppers, and N / l of each (n_droppers,) [N/m]."""
    found = []
    if model.simulated.lateral:
        found.append(sideways_of_droppers(model))
    if "u" in model.unknowns:
        found.append(across_droppers(model))
    return found


def _across(unit: np.ndarray) -> np.ndarray:
    """Unit vectors across others in the plane along the track, (n, 3)."""
    level = np.stack([unit[:, _UP], np.zeros(len(unit)), -unit[:, _ALONG]], axis=1)
    return np.asarray(level / np.linalg.norm(level, axis=1)[:, None])


def _unit_vectors(model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors from lower to upper ends (n, 3), and N / l of each (n,) [N/m]."""
    pairs, form = model.mesh.droppers, model.form
    if form is None:
        return np.tile([0.0, 0.0, 1.0], (len(pairs), 1)), np.zeros(len(pairs))
    vectors = form.dropper_vectors(pairs)
    length = np.linalg.norm(vectors, axis=1)
    force = np.where(model.broken, 0.0, np.maximum(form.dropper_force, 0.0))
    return vectors / length[:, None], force / length


def _along(model: Model, unit: np.ndarray, needed: tuple[int, ...]) -> Direction:
    """Motion of upper less lower ends along vectors (n, 3), in ``needed`` components first and in
    others that any vector has."""
    pairs = model.mesh.droppers
    large = np.abs(unit).max(axis=0, initial=0.0) > _LEAST
    others = [k for k in (_UP, _ALONG, _SIDEWAYS) if large[k] and k not in needed]
    parts = (*needed, *others)
    unknowns = [model.dofs(pairs, _NAMES[k]) for k in parts]
    weights = [unit[:, [k]] * np.array([1.0, -1.0]) for k in parts]
    return Direction(np.concatenate(unknowns, axis=1), np.concatenate(weights, axis=1))
