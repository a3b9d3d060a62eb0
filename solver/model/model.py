"""The discrete model of a line: element blocks, point masses, springs, weights, constraints.

Plain arrays, the same on every rank; nothing here is distributed. Which terms exist is decided
by the effects, each of which adds its own through a ``ModelBuilder``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from catenary.meshgen.mesh import CONTACT_WIRE, LineMesh
from catenary.solver.model.unknowns import Unknowns
from catenary.solver.problem.problem import Problem
from catenary.solver.problem.simulated import Simulated


class StepLoad(Protocol):
    """A load that changes with time: ``values(time)`` [N] or [N m] on the unknowns ``dofs``."""

    dofs: np.ndarray

    def values(self, time: float) -> np.ndarray:
        """Load at ``time`` [s], shape as ``dofs``; called once a step on ranks that own any."""


@dataclass(frozen=True)
class Block:
    """Equal-sized element matrices of one component.

    dofs : (n, m) int; mass, stiffness : (n, m, m) or None
    """

    component: str
    dofs: np.ndarray
    mass: np.ndarray | None
    stiffness: np.ndarray | None


@dataclass
class Model:
    """A line as matrices to be.

    Attributes
    ----------
    simulated : laws of the problem, as its effects set them
    numbering : Unknowns, the registry of all unknowns and their numbers
    row_of_node : (n_nodes,) place of each mesh node in the order along the track
    blocks : element blocks; their sums are M and K
    constrained : (n,) int, unknowns held at zero, and numbers that are no node's
    weight : (n_dofs,) gravity load [N], [N m]
    dropper_lengths : (n_droppers,) [m]
    dropper_stiffness, dropper_damping : (n_droppers,) [N/m], [N s/m], of the taut dropper
    released_damping : (n_droppers,) the part of ``dropper_damping`` that goes slack with the spring
    broken : (n_droppers,) droppers that carry nothing; what they weigh stays on their clamps
    step_loads : loads that change with time
    terms_of : effect name -> number of terms, laws and lifted limits that it contributes
    """

    problem: Problem
    simulated: Simulated
    mesh: LineMesh
    active: tuple[str, ...]
    numbering: Unknowns
    row_of_node: np.ndarray
    dropper_lengths: np.ndarray
    blocks: list[Block] = field(default_factory=list)
    constrained: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    weight: np.ndarray = field(default_factory=lambda: np.zeros(0))
    step_loads: list[StepLoad] = field(default_factory=list)
    terms_of: dict[str, int] = field(default_factory=dict)
    broken: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=bool))

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of all unknowns that nodes may have."""
        return self.numbering.names

    @property
    def n_dofs(self) -> int:
        """Size of vectors: unknowns, and numbers that are no node's."""
        return self.numbering.size

    @property
    def n_unknowns(self) -> int:
        """How many unknowns all nodes have."""
        return self.numbering.n_unknowns

    def dofs(self, nodes: np.ndarray, unknown: str = "w") -> np.ndarray:
        """Numbers of one unknown at mesh nodes, shape as ``nodes``; ValueError if one has none."""
        return self.numbering.of(nodes, unknown)

    @property
    def dropper_stiffness(self) -> np.ndarray:
        kind = self.problem.line.dropper
        if kind.stiffness is not None:
            stiffness = np.full(self.mesh.droppers.shape[0], kind.stiffness)
        else:
            assert kind.axial_stiffness is not None
            stiffness = kind.axial_stiffness / self.dropper_lengths
        return np.where(self.broken, 0.0, stiffness)

    @property
    def dropper_damping(self) -> np.ndarray:
        return self.damping_of("droppers")[0] * self.dropper_stiffness

    @property
    def released_damping(self) -> np.ndarray:
        damping = self.dropper_damping
        return np.zeros_like(damping) if self.problem.slack_dampers_act else damping

    def damping_of(self, component: str) -> tuple[float, float]:
        """Damping factors (alpha [s], beta [1/s]) of a component."""
        damping = self.simulated.damping
        return damping.per_component.get(component, (damping.alpha, damping.beta))

    @property
    def damping_is_proportional(self) -> bool:
        """Whether C = alpha K + beta M holds for the whole line with one alpha and one beta."""
        return len({self.damping_of(block.component) for block in self.blocks}) <= 1

    def wire_elements(self, wire: str) -> tuple[np.ndarray, np.ndarray]:
        """Element unknowns (n, 4) in the vertical plane and lengths (n,) [m] of a wire."""
        return wire_elements(self, wire, ("w", "theta_y"))

    @property
    def contact_x(self) -> np.ndarray:
        """Positions of the contact wire's nodes [m], ascending."""
        return self.mesh.x(self.mesh.wires[CONTACT_WIRE])


def wire_elements(
    model: Model, wire: str, unknowns: tuple[str, str]
) -> tuple[np.ndarray, np.ndarray]:
    """Element unknowns (n, 4) of a wire in the plane of two unknowns, and lengths (n,) [m]."""
    nodes = model.mesh.wires[wire]
    w = model.dofs(nodes, unknowns[0])
    theta = model.dofs(nodes, unknowns[1])
    dofs = np.stack([w[:-1], theta[:-1], w[1:], theta[1:]], axis=1)
    return dofs, np.diff(model.mesh.x(nodes))
