"""A line at rest in absolute heights, solved apart from form finding and from the march."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from catenary.meshgen.wires import End
from catenary.solver.model import beam
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium


def absolute_rest(
    model: Model, form: Equilibrium, *, tensions: dict[str, float], broken: set[int]
) -> np.ndarray:
    """Heights [m] and slopes (n_dofs,) at which a line rests with other tensions [N] and without
    some droppers.

    Wires from anchor to anchor, supports relaxed at the encumbrance, arms relaxed where the wire
    was at the first rest, droppers of their unstretched lengths that cannot push: which of them
    are slack is found by trying.
    """
    mesh, line = model.mesh, model.problem.line
    matrix = sparse.lil_matrix((model.n_dofs, model.n_dofs))
    load = model.weight.copy()
    for wire in mesh.wires:
        dofs, length = model.wire_elements(wire)
        data = line.wire(wire)
        middle = mesh.x(mesh.elements(wire)).mean(axis=1)
        # Between its clamps a wire takes its tension from the one that carries it.
        taken = np.zeros(middle.size)
        for other in line.wires if data.taken else ():
            for piece in other.pieces:
                if End.CLAMPED in piece.ends:
                    inside = (middle > piece.x[0]) & (middle < piece.x[-1])
                    taken[inside] += tensions[other.name]
        stiffness = beam.stiffness(length, data.bending_stiffness, tensions[wire] - taken)
        for own, values in zip(dofs, stiffness, strict=True):
            matrix[np.ix_(own, own)] += values
    (supports,), (arms,) = line.supports, line.steady_arms
    top = line.wire(supports.wire).top
    springs: list[tuple[Any, float, Any]] = [(mesh.supports, supports.stiffness, top)]
    if arms.kind.stiffness:
        springs.append((mesh.steady_arms, arms.kind.stiffness, form.height[mesh.steady_arms]))
    for nodes, value, relaxed in springs:
        at = model.dofs(nodes)
        matrix[at, at] = matrix[at, at].toarray() + value
        load[at] += value * relaxed
    for pair, number in zip(model.dofs(mesh.clamps), line.clamp_group, strict=True):
        own = np.ix_(pair, pair)
        matrix[own] += line.clamps[number].stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
    held = model.constrained
    free = np.setdiff1d(np.arange(model.n_dofs), held)
    result = np.zeros(model.n_dofs)
    result[model.dofs(mesh.anchors)] = form.height[mesh.anchors]
    stiffness, slack = first_stiffness(model), np.zeros(mesh.droppers.shape[0], dtype=bool)
    ends = model.dofs(mesh.droppers)
    slack[list(broken)] = True
    for _ in range(50):
        whole, right = matrix.copy(), load.copy()
        for number in np.flatnonzero(~slack):
            own, k = ends[number], stiffness[number]
            whole[np.ix_(own, own)] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
            right[own] += k * form.dropper_length[number] * np.array([1.0, -1.0])
        square = whole.tocsr()
        right -= square[:, held] @ result[held]
        result[free] = sparse_linalg.spsolve(square[free][:, free].tocsc(), right[free])
        stretch = result[ends[:, 0]] - result[ends[:, 1]] - form.dropper_length
        now = stretch < 0.0
        now[list(broken)] = True
        if (now == slack).all():
            return result
        slack = now
    raise AssertionError("which droppers are slack is not found")


def first_stiffness(model: Model) -> np.ndarray:
    """Stiffness of all droppers, unbroken [N/m]."""
    assert not model.broken.any()
    return model.dropper_stiffness


def first_rest(model: Model, form: Equilibrium) -> np.ndarray:
    """Heights and slopes of the wires as form finding has left them (n_dofs,)."""
    result = np.zeros(model.n_dofs)
    nodes = np.arange(model.mesh.n_nodes)
    result[model.dofs(nodes)] = form.height
    result[model.dofs(nodes, "theta_y")] = form.slope
    return result
