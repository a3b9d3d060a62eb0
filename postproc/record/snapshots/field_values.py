"""The values of fields, from what ranks have of the line's motion."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from catenary.postproc.record.snapshots.contents import (
    ALONG,
    ASIDE,
    SLOPE,
    TURN,
    UP,
    Block,
    FieldKind,
    RecordedLine,
    Slots,
)
from catenary.solver.kernels import native
from catenary.solver.model.axial_motion import rows_in_curve, slope_rows


@dataclass(frozen=True)
class Gathered:
    """Motions and forces of all nodes and droppers in successive snapshots.

    Attributes
    ----------
    motions : unknown and whether its rate is meant -> (rows, n_nodes)
    dropper_force : (rows, n_droppers) [N]
    tension : (n_nodes,) of each row [N]
    pantographs : (rows, k) where their bases, masses and bodies are
    """

    motions: Mapping[tuple[str, bool], np.ndarray]
    dropper_force: np.ndarray
    tension: list[np.ndarray]
    pantographs: np.ndarray


class FieldValues:
    """Makes the values of fields. Not collective.

    Parameters
    ----------
    line : of the snapshots
    points : (n_nodes, 3) of its nodes at rest [m]
    """

    def __init__(self, line: RecordedLine, points: np.ndarray) -> None:
        self._height = points[:, 2]
        self._slope = line.slope
        self._wires = {wire.name: wire for wire in line.line.wires}
        self._lateral, self._curve = line.lateral, line.line.curve

    def of(self, kind: FieldKind, slots: Slots, first: int, known: Gathered) -> np.ndarray:
        """Values of the field ``kind`` in the block of ``slots`` at the snapshots that are
        ``known``, from number ``first`` on, one after another.

        Returns
        -------
        ndarray, as its type in the file, (n,) or (n, components)
        """
        rows = slice(first, first + len(known.dropper_force))
        shown = [
            kind.values_of(points[rows]).astype(np.int64) for points in (slots.first, slots.count)
        ]
        taken = np.empty(int(shown[1].sum()))
        result = np.empty((taken.size, kind.components), dtype=kind.number)
        for component, (values, columns) in enumerate(self._components(kind, slots.block, known)):
            if values is None:
                result[:, component] = 0.0
            else:
                of_rows = np.ascontiguousarray(values, dtype=float)
                native.take_points(of_rows, columns.astype(np.int64), *shown, taken)
                result[:, component] = taken
        return result if kind.components > 1 else result[:, 0]

    def _components(
        self, kind: FieldKind, block: Block, known: Gathered
    ) -> list[tuple[np.ndarray | None, np.ndarray]]:
        """Values of each component (rows, k), None where it is zero, and which of these the
        points of a block take: zero where that is below zero."""
        if kind.of_droppers:
            force = known.dropper_force
            values = force if kind.name == "dropper_force" else np.sign(force)
            return [(values, np.arange(block.first, block.first + len(block.points) // 2))]
        if kind.name == "tension":
            return [(self._tension(block, known), np.arange(block.nodes.size))]
        if kind.name == "bending_moment":
            return [(self._bending_moment(block, known), np.arange(block.nodes.size))]
        return [(known.motions.get(motion), block.nodes) for motion in kind.motions]

    def _tension(self, block: Block, known: Gathered) -> np.ndarray:
        """Tension ahead of the points of a wire, (rows, n) [N]."""
        nodes = block.nodes
        tension = np.stack(known.tension)[:, nodes]
        if (ALONG, False) not in known.motions:
            return tension
        wire = self._wires[block.name]
        if not wire.axial_stiffness:
            return tension
        along = known.motions[ALONG, False][:, nodes]
        length = np.diff(block.points[:, 0])
        joined = np.ones(length.size, dtype=bool)
        joined[block.breaks - 1] = False
        strain = np.diff(along, axis=1) / np.where(joined, length, np.inf)
        whole = np.where(joined, length, 1.0)
        for names, at_rest, more in self._planes(block.points[:, 0], nodes, whole):
            rows = slope_rows(whole, _ends(*(part[None, nodes] for part in at_rest))[0]) + more
            moved = _ends(*(known.motions[name, False][:, nodes] for name in names))
            strain += np.where(joined, (rows * moved).sum(axis=2), 0.0)
        section, _ = wire.left_of(_ends_of(block))
        gained = wire.axial_stiffness * section * strain
        tension[:, :-1] += gained
        # The last point of a piece has no element ahead of it.
        last = np.append(block.breaks, nodes.size) - 1
        tension[:, last] += gained[:, last - 1]
        return tension

    def _planes(
        self, x: np.ndarray, nodes: np.ndarray, length: np.ndarray
    ) -> Iterator[tuple[tuple[str, str], tuple[np.ndarray, np.ndarray], np.ndarray]]:
        """Unknowns, place and slope at rest of each plane of a wire with nodes at ``x`` (n,), and
        what a curve adds to the strain of its elements (n - 1, 4)."""
        at_rest = self._height, self._slope
        if self._lateral is None:
            yield (UP, SLOPE), at_rest, np.zeros((nodes.size - 1, 4))
            return
        ends = np.stack([x[:-1], x[:-1] + length], axis=1)
        aside = self._lateral.y, self._lateral.slope
        shapes = (_ends(*(part[None, nodes] for part in plane))[0] for plane in (at_rest, aside))
        upright, level = rows_in_curve(self._curve, ends, *shapes)
        yield (UP, SLOPE), at_rest, upright
        yield (ASIDE, TURN), aside, level

    def _bending_moment(self, block: Block, known: Gathered) -> np.ndarray:
        nodes = block.nodes
        height = self._height[nodes] + known.motions[UP, False][:, nodes]
        slope = self._slope[nodes] + known.motions[SLOPE, False][:, nodes]
        wire = self._wires[block.name]
        _, bending = wire.left_of(_ends_of(block))
        stiffness = wire.bending_stiffness * bending
        return bending_moment(block.points[:, 0], height, slope, block.breaks, stiffness)


def _ends_of(block: Block) -> np.ndarray:
    """Places of both ends of the elements of a wire, (n - 1, 2) [m], and so between its pieces."""
    x = block.points[:, 0]
    return np.column_stack([x[:-1], x[1:]])


def _ends(height: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Height and slope of both ends of elements, (rows, n, 4), of those at nodes (rows, n + 1)."""
    parts = height[:, :-1], slope[:, :-1], height[:, 1:], slope[:, 1:]
    return np.stack(parts, axis=2)


def bending_moment(
    x: np.ndarray, w: np.ndarray, slope: np.ndarray, breaks: np.ndarray, stiffness: np.ndarray
) -> np.ndarray:
    """EI d2w/dx2 at the nodes of a wire of cubic elements, the mean of both sides of a node [N m].

    Parameters
    ----------
    x : ndarray, shape (n,)
        Places of the nodes [m].
    w, slope : ndarray, shape (rows, n)
        Deflections [m] and slopes [-].
    breaks : ndarray
        Nodes at which further pieces begin.
    stiffness : ndarray, shape (n - 1,)
        Bending stiffness between neighbouring nodes [N m2].
    """
    length = np.diff(x)
    joined = np.ones(length.size)
    joined[breaks - 1] = 0.0
    length[breaks - 1] = 1.0
    stiffness = joined * stiffness
    rise = 6.0 * np.diff(w, axis=1) / length
    left, right = slope[:, :-1], slope[:, 1:]
    result = np.zeros(np.shape(w))
    result[:, :-1] += stiffness * (rise - 4.0 * left - 2.0 * right) / length
    result[:, 1:] += stiffness * (2.0 * left + 4.0 * right - rise) / length
    beside = np.append(joined, 0.0) + np.append(0.0, joined)
    return np.asarray(result / np.maximum(beside, 1.0))
