"""Motion of wires along the track: the stretch of their elements, their ends and fixings.

A wire is a bar of the mean strain of each element along its course. To first order in the motion
(u, w) about a shape z at rest the mean strain of an element of length h is
e = (u2 - u1) / h + (1 / h) integral of z' w' dx, and of y' v' - c v in the lateral plane, in a
curve of curvature c. Where cant grows by p' a length, the slopes in space are y' + p' z and
z' - p' y. One strain for an element keeps the bar from locking: what bends within it does not
stretch it. Its tension gains EA e.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.meshgen.line import Curve
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import SAME_PLACE, End
from catenary.solver.model import beam
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.unknowns import LEVEL, UPRIGHT

# Slopes at rest that differ by less are one, so that like spans have like matrices [-]. What that
# changes of a stiffness is a share of 1e-11 of EA.
_SLOPE = 1e-10
# An end is at its stop if it is nearer than this [m].
_AT_STOP = 1e-9


def unknowns_along(model: Model, wire: str) -> np.ndarray:
    """Unknowns of the elements of a wire: u of both ends, then deflection and slope of both in the
    vertical plane, (n, 6), and in the lateral one where it is simulated, (n, 10)."""
    parts = [model.dofs(model.mesh.elements(wire), "u")]
    for plane in (UPRIGHT, LEVEL) if model.simulated.lateral else (UPRIGHT,):
        parts.append(model.wire_elements(wire, plane)[0])
    return np.concatenate(parts, axis=1)


def strain_rows(model: Model, wire: str) -> np.ndarray:
    """Mean strain of the elements of a wire by their unknowns, (n, 6) or (n, 10) [1/m], [1/rad].

    Before the shape at rest is known the wire is straight.
    """
    pairs, form = model.mesh.elements(wire), model.form
    length = np.diff(model.mesh.x(pairs), axis=1)[:, 0]
    rows = np.zeros((len(pairs), 10 if model.simulated.lateral else 6))
    rows[:, 0], rows[:, 1] = -1.0 / length, 1.0 / length
    if form is not None:
        for number, (_, course, slope) in enumerate(form.planes()):
            bent = slope_rows(length, shape_of(course, slope, pairs))
            rows[:, 2 + 4 * number : 6 + 4 * number] = np.round(bent / _SLOPE) * _SLOPE
        if form.lateral is not None:
            rows[:, 2:] += np.concatenate(curve_rows(model, wire, form), axis=1)
    return rows


def shape_of(course: np.ndarray, slope: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Deflection [m] and slope [-] at the first and the second end of elements, (n, 4).

    ``course`` [m] and ``slope`` (n_nodes,) are those of the nodes, ``pairs`` (n, 2) the elements'
    nodes.
    """
    return np.stack([course[pairs], slope[pairs]], axis=2).reshape(-1, 4)


def curve_rows(model: Model, wire: str, form: Equilibrium | None) -> tuple[np.ndarray, np.ndarray]:
    """Strain of elements by deflections across the canted plane of a curve and along it, (n, 4)
    each [1/m], [-]: -c times their means with the parts c of the curvature, as towards the centre a
    wire is shorter, and what the twist of the track adds in transitions about the shape ``form``.
    Zero on straight track."""
    pairs = model.mesh.elements(wire)
    shapes = np.zeros((2, len(pairs), 4))
    if form is not None:
        for number, (_, course, slope) in enumerate(form.planes()):
            shapes[number] = shape_of(course, slope, pairs)
    return rows_in_curve(model.problem.line.curve, model.mesh.x(pairs), *shapes)


def rows_in_curve(
    curve: Curve | None, x: np.ndarray, z: np.ndarray, y: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """``curve_rows`` of elements with ends at ``x`` (n, 2) [m] and the shapes ``z`` above the track
    and ``y`` to the left, (n, 4) each, see ``shape_of``."""
    if curve is None:
        return np.zeros((len(x), 4)), np.zeros((len(x), 4))
    middle, length = x.mean(axis=1), np.diff(x, axis=1)
    means = beam.uniform_load(length[:, 0]) / length
    slopes = np.array([-1.0, 0.0, 1.0, 0.0]) / length
    # The squares of (z' - p' y) and (y' + p' z), halved, have these parts beside those without p'.
    twist = np.diff(curve.roll_at(x), axis=1) / length
    up, aside = ((means * shape).sum(axis=1, keepdims=True) for shape in (z, y))
    up_slope, aside_slope = ((slopes * shape).sum(axis=1, keepdims=True) for shape in (z, y))
    upright = twist * ((aside_slope + twist * up) * means - aside * slopes)
    level = twist * ((twist * aside - up_slope) * means + up * slopes)
    upright -= curve.upright_curvature_at(middle)[:, None] * means
    level -= curve.curvature_at(middle)[:, None] * means
    return upright, level


def slope_rows(length: np.ndarray, shape: np.ndarray, taut: np.ndarray | None = None) -> np.ndarray:
    """(1 / h) integral of z' N' dx of elements, (n, 4), of their shapes z (n, 4): how the mean
    strain grows with the unknowns of a plane on straight track. ``taut`` are the matrices (n, 4, 4)
    of a unit of tension, if there are any."""
    pull = beam.stiffness(length, 0.0, 1.0) if taut is None else taut
    return np.asarray(np.einsum("nij,nj->ni", pull, shape) / length[:, None])


def bar_mass(length: np.ndarray, mass_per_length: float) -> np.ndarray:
    """Consistent mass matrices of bars, shape (n, 2, 2) [kg]."""
    shape = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    return np.asarray(mass_per_length * length[:, None, None] * shape)


class WireEnd(NamedTuple):
    """The end of a wire that no clamp carries: its node, the wire's name, whether there is a
    tensioner, and the direction away from the wire, 1 or -1 along the track."""

    node: int
    wire: str
    tensioned: bool
    outwards: int

    def element(self, mesh: LineMesh) -> int:
        """Number of the wire's element that ends there."""
        return int(np.flatnonzero((mesh.elements(self.wire) == self.node).any(axis=1))[0])


def ends_of(model: Model) -> list[WireEnd]:
    """Ends of all wires, without ends that clamps carry, wire by wire in order of x."""
    mesh, along = model.mesh, model.problem.along
    masts = model.problem.line.support_positions
    line_ends = float(masts[0]), float(masts[-1])
    found = []
    for wire in model.problem.line.wires:
        for piece, nodes in zip(wire.pieces, mesh.pieces(wire.name), strict=True):
            ends = zip(nodes[[0, -1]], (-1, 1), piece.ends, piece.tensioned, strict=True)
            for node, outwards, kind, tensioned in ends:
                if kind is not End.CLAMPED:
                    x = float(mesh.points[node, 0])
                    if tensioned is None:
                        tensioned = along.tensioned(x, line_ends, SAME_PLACE)
                    found.append(WireEnd(int(node), wire.name, tensioned, outwards))
    return found


def tensioned_ends(model: Model) -> list[WireEnd]:
    """The ends that have a tensioner."""
    return [end for end in ends_of(model) if end.tensioned]


def held_along(model: Model) -> np.ndarray:
    """Nodes that do not move along the track: ends without a tensioner or at its stop, and
    mid-points."""
    there = model.simulated.tensioner is not None
    held = [
        end.node for end in ends_of(model) if not (end.tensioned and there) or at_stop(model, end)
    ]
    return np.unique(np.concatenate([np.array(held, dtype=np.int64), mid_points(model)]))


def at_stop(model: Model, end: WireEnd) -> bool:
    """Whether a stop holds a tensioned end at rest."""
    tensioner = model.simulated.tensioner
    if tensioner is None or tensioner.travel is None or model.form is None:
        return False
    return bool(abs(model.form.moved_along(end.node)) > tensioner.travel - _AT_STOP)


def mid_points(model: Model) -> np.ndarray:
    """Nodes of mid-point anchors, of all wires whose ends no clamps carry."""
    mesh, places = model.mesh, np.array(model.problem.along.mid_points)
    nodes = [np.zeros(0, dtype=np.int64)]
    for wire in model.problem.line.wires:
        if wire.pieces[0].ends[0] is End.CLAMPED:
            continue
        own = mesh.wires[wire.name]
        close = np.abs(mesh.x(own)[:, None] - places) < 1e-3
        nodes.append(own[close.any(axis=1)])
    return np.concatenate(nodes)


def tension_at_rest(model: Model, end: WireEnd) -> float:
    """Tension of a wire in its last element before an end, at rest [N]."""
    return float(model.tension_of(end.wire)[end.element(model.mesh)])
