"""Contact wires: place of the pan heads on them, interpolation, running surface, owned parts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.meshgen.wires import Role
from catenary.solver.kernels import native
from catenary.solver.kernels.native import NODE, SAMPLE, SLIP, TOUCH
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.unknowns import UPRIGHT

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
        # Beyond the samples of a wire its surface is level at 0: one that stays at another height
        # has samples to the wire's ends.
        ends = model.mesh.x(model.mesh.wires[wire.name])[[0, -1]]
        stays = ends[sum(shape.at(wire.name, ends)[0] for shape in shapes) != 0.0]
        x = np.unique(np.concatenate([stays, *(shape.places(PER_WAVE) for shape in shapes)]))
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


class Candidates(NamedTuple):
    """Pairs of strip and contact wire, strip by strip.

    Attributes
    ----------
    place : (n,) of the strips along the track [m], kept by reference
    wire : (n,) number of the contact wire
    half_length : (n,) of the strip [m], infinite if it is not known
    """

    place: np.ndarray
    wire: np.ndarray
    half_length: np.ndarray


class ContactWires:
    """The contact wires as a train sees them. Not collective.

    Attributes
    ----------
    x : (n_nodes,) positions of their nodes [m], ascending in each wire, wire by wire
    ranges : (n_wires, 2) first node of each wire, and the one after its last
    mesh_nodes : (n_nodes,) their numbers in the mesh
    nodes : (n_nodes,) records of ``NODE``, of no columns until a ``ForcesOnLine`` has some
    shapes : ``native.Wires``, these nodes and the wires' running surfaces
    """

    def __init__(self, model: Model, form: Equilibrium, ownership: Ownership) -> None:
        names = [wire.name for wire in model.problem.line.wires_of(Role.CONTACT)]
        chains = [model.mesh.wires[name] for name in names]
        ends = np.cumsum([0, *(chain.size for chain in chains)])
        self.ranges = np.stack([ends[:-1], ends[1:]], axis=1)
        self._pieces = [wire.pieces for wire in model.problem.line.wires_of(Role.CONTACT)]
        self._at_rest = form.lateral is not None
        self.mesh_nodes = nodes = np.concatenate(chains)
        self.x = model.mesh.x(nodes)
        self._numbering = model.numbering
        dofs = self.dofs
        mine = ownership.owned(dofs)
        self.nodes = np.zeros(self.x.size, dtype=NODE)
        course = model.mesh.points[:, 1] if form.lateral is None else form.lateral.y
        self.nodes["x"], self.nodes["y"] = self.x, course[nodes]
        self.nodes["joined"] = 1.0
        for name, first, end in zip(names, ends[:-1], ends[1:], strict=True):
            # No element leads from the end of a piece to the next one.
            self.nodes["joined"][end - 1] = 0.0
            self.nodes["joined"][first + model.mesh.breaks.get(name, np.zeros(0, int)) - 1] = 0.0
        self.nodes["local"] = np.where(mine, dofs - ownership.first, 0)
        self.nodes["owned"] = mine
        self.nodes["rest"] = np.stack([form.height[nodes], form.slope[nodes]], axis=1)
        surface, self._samples = surface_samples(model)
        self.shapes = native.Wires(self.nodes, surface)

    @property
    def dofs(self) -> np.ndarray:
        """Unknowns (w, theta_y) of their nodes (n_nodes, 2); made anew when asked for."""
        own = [self._numbering.of(self.mesh_nodes, name) for name in UPRIGHT]
        return np.stack(own, axis=1)

    @property
    def n_wires(self) -> int:
        """Number of contact wires."""
        return len(self.ranges)

    def course(self, wire: int) -> tuple[np.ndarray, np.ndarray]:
        """Places along the track (n,) and lateral positions (n,) of a wire at rest [m], straight in
        between: of supports without lateral motion, with it of all nodes."""
        if self._at_rest:
            first, end = self.ranges[wire]
            return self.x[first:end], self.nodes["y"][first:end].copy()
        pieces = self._pieces[wire]
        return (
            np.concatenate([piece.x for piece in pieces]),
            np.concatenate([piece.y for piece in pieces]),
        )

    def on_wires(self, wire: np.ndarray, half_length: float | np.ndarray = np.inf) -> np.ndarray:
        """Records of ``TOUCH`` (n,) on wires (n,), not located yet."""
        touches = np.zeros(wire.size, dtype=TOUCH)
        touches["first"], touches["end"] = self.ranges[wire].T
        touches["element"], touches["half_length"] = touches["first"], half_length
        touches["samples"] = self._samples[wire]
        touches["sample"] = touches["samples"][:, 0]
        return touches

    def touches(self, x: np.ndarray, wire: int | np.ndarray = 0) -> np.ndarray:
        """Places on a wire, or on wires (n,), at positions ``x`` (n,) [m], records of ``TOUCH``
        (n,)."""
        touches = self.on_wires(np.broadcast_to(wire, x.shape))
        native.locate(np.ascontiguousarray(x, dtype=float), self.shapes, touches)
        return touches

    def rest_height(self, x: np.ndarray) -> np.ndarray:
        """Height of the lowest wire at rest at positions ``x`` (n,) [m], (n,); infinite where there
        is none."""
        return np.fmin.reduce(self._rest_heights(x), initial=np.inf)

    def rest_height_of(self, wire: int, x: np.ndarray) -> np.ndarray:
        """Height of a wire at rest at positions ``x`` (n,) [m], (n,); NaN where it is not."""
        touches = self.touches(x, wire)
        axis = (touches["whole_value"] * touches["rest"]).sum(axis=1)
        return np.where(touches["present"] > 0.0, axis + touches["surface"][:, 0], np.nan)

    def rest_slope(self, x: np.ndarray) -> np.ndarray:
        """Slope dw/dx of the lowest wire at rest at positions ``x`` (n,) [m], (n,) [-]."""
        lowest = np.argmin(np.nan_to_num(self._rest_heights(x), nan=np.inf), axis=0)
        touches = self.touches(x, lowest)
        slope = (touches["whole_slope"] * touches["rest"]).sum(axis=1) + touches["surface"][:, 1]
        return np.where(touches["present"] > 0.0, slope, 0.0)

    def _rest_heights(self, x: np.ndarray) -> list[np.ndarray]:
        return [self.rest_height_of(wire, x) for wire in range(self.n_wires)]

    def nodes_between(self, low: float, high: float, wire: int = 0) -> tuple[int, int]:
        """Range of a wire's nodes whose elements cover [low, high] [m], ends included."""
        first, end = self.ranges[wire]
        own = self.x[first:end]
        # A position that is start + V t may miss an end by round-off and fall in the next element.
        begin = int(np.searchsorted(own, low - SLIP, side="right")) - 1
        last = int(np.searchsorted(own, high + SLIP)) + 1
        return int(first) + max(begin, 0), int(first) + min(last, own.size)
