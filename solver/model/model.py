"""The discrete model of a line: element blocks, point masses, springs, weights, constraints.

Plain arrays, the same on every rank; nothing here is distributed. Which terms exist is decided
by the effects, each of which adds its own through a ``ModelBuilder``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from catenary.meshgen.line import (
    Clamps,
    DropperPlace,
    Droppers,
    Slopes,
    SteadyArms,
    Supports,
    droppers_at,
)
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import Role
from catenary.solver.model.alike import alike
from catenary.solver.model.links import NO_DROPPERS, Links
from catenary.solver.model.loads import Load
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.unknowns import UPRIGHT, Unknowns
from catenary.solver.problem.problem import Problem, Simulated

# Elements of a block that are looked for together: the ends of each are as long as its unknowns.
_TOGETHER = 16


@dataclass(frozen=True)
class Block:
    """Equal-sized element matrices of one component; like matrices are stored once.

    Attributes
    ----------
    component : name of the component, which decides on damping
    dofs : (n, m) int32, unknowns of each element
    kind : (n,) int32, number of the matrices of each element
    mass, stiffness : (k, m, m) or None
    damping : (k, m, m) or None, in addition to the component's damping, alpha K + beta M
    lateral : whether it is the lateral motion of a wire, which may have its own damping
    of_shape : whether the stiffness is the tangent of forces that the shape at rest decides, such
        as those of wires and droppers; others are springs without a force at rest
    """

    component: str
    dofs: np.ndarray
    kind: np.ndarray
    mass: np.ndarray | None
    stiffness: np.ndarray | None
    damping: np.ndarray | None = None
    of_shape: bool = False
    lateral: bool = False

    @classmethod
    def of_elements(
        cls,
        component: str,
        dofs: np.ndarray,
        mass: np.ndarray | None = None,
        stiffness: np.ndarray | None = None,
        damping: np.ndarray | None = None,
        of_shape: bool = False,
    ) -> Block:
        """A block of elements, each with matrices of its own; equal ones are then stored once.

        ``dofs`` (n, m) are the unknowns of each element; ``mass``, ``stiffness`` and ``damping``
        are (n, m, m) or None, in SI units. Elements whose matrices differ by round-off get those
        of the first of them.
        """
        terms = [mass, stiffness, damping]
        n, m = dofs.shape
        rows = [term.reshape(n, m * m) for term in terms if term is not None]
        first, kind = alike(np.hstack(rows))
        mass, stiffness, damping = (None if term is None else term[first] for term in terms)
        return cls(component, dofs, kind, mass, stiffness, damping, of_shape)

    def is_of(self, dofs: np.ndarray, terms: Mapping[str, np.ndarray]) -> bool:
        """Whether it has elements with unknowns ``dofs`` (n, m) and just these ``terms``, each
        (n, m, m): its ``mass``, ``stiffness`` and ``damping``, by these names."""
        own = {"mass": self.mass, "stiffness": self.stiffness, "damping": self.damping}
        there = {name: term for name, term in own.items() if term is not None}
        return (
            there.keys() == terms.keys()
            and np.array_equal(self.dofs, dofs)
            and all(np.array_equal(there[name][self.kind], terms[name]) for name in there)
        )

    def near(self, first: int, last: int) -> slice | np.ndarray:
        """Elements among which are all with unknowns from ``first`` to before ``last``."""
        lowest, highest, ascend = self._ranges
        if ascend:
            begin, end = np.searchsorted(highest, first), np.searchsorted(lowest, last)
            return slice(_TOGETHER * int(begin), _TOGETHER * int(end))
        own = _TOGETHER * np.flatnonzero((highest >= first) & (lowest < last))
        elements = (own[:, None] + np.arange(_TOGETHER)).ravel()
        return elements[elements < len(self.dofs)]

    @cached_property
    def _ranges(self) -> tuple[np.ndarray, np.ndarray, bool]:
        """Lowest and highest unknown of elements that are looked for together, and whether both
        ascend."""
        begins = np.arange(0, len(self.dofs), _TOGETHER)
        lowest = np.minimum.reduceat(self.dofs, begins).min(axis=1)
        highest = np.maximum.reduceat(self.dofs, begins).max(axis=1)
        ascend = all((np.diff(ends) >= 0).all() for ends in (lowest, highest))
        return lowest.astype(np.int64), highest.astype(np.int64), ascend


class Hanging(NamedTuple):
    """Masses that weigh on unknowns.

    Attributes
    ----------
    dofs : (n, ...) unknowns
    mass : (n, ...) on each [kg], [kg m], or (k, ...) of each kind
    kind : (n,) which of these, None if each has its own
    """

    dofs: np.ndarray
    mass: np.ndarray
    kind: np.ndarray | None = None


@dataclass
class Model:
    """A line as matrices to be.

    Attributes
    ----------
    problem, mesh : problem and mesh of the line
    simulated : laws of the problem, as its effects set them
    numbering : Unknowns, the registry of all unknowns and their numbers
    row_of_node : (n_nodes,) place of each mesh node in the order along the track
    blocks : element blocks; their sums are M and K
    constrained : (n,) int, unknowns held at zero, and numbers that are no node's
    dropper_lengths : (n_droppers,) unstretched [m]
    cut_lengths : (n_droppers,) those that were wanted, by which droppers weigh and stretch [m]:
        errors of millimetres change a mass by some grams and a stiffness by a hundredth, and lines
        with other errors have the same matrices
    dropper_stiffness, dropper_damping : (n_droppers,) [N/m], [N s/m], of the taut dropper, about
        its tension in ``form``
    released_damping : (n_droppers,) the part of ``dropper_damping`` that goes slack with the spring
    broken : (n_droppers,) droppers that carry nothing; what they weigh stays on their clamps
    missing : (n_droppers,) those of them that are not there at all
    dropper_gap : (n_droppers,) stretch that a dropper slack at rest lacks to be taut, else 0 [m]
    loads : beside those of contacts and links, from the start of the march on
    links : droppers, and whatever else was added as links
    droppers : links of the mesh's droppers, in its order; they only pull where they may slacken
    hanging_at_arms : (n_arms,) what of each arm's mass hangs at its wire [kg]
    form : the shape at rest that matrices are made about, None before it is found
    hanging : masses that weigh on the line
    hanging_wires : by the number of a wire's block, masses (k, m) by which each kind of its
        elements weighs on its unknowns
    terms_of : effect name -> number of terms, laws and lifted limits that it contributes
    """

    problem: Problem
    simulated: Simulated
    mesh: LineMesh
    numbering: Unknowns
    row_of_node: np.ndarray
    dropper_lengths: np.ndarray
    cut_lengths: np.ndarray
    blocks: list[Block] = field(default_factory=list)
    links: list[Links] = field(default_factory=list)
    droppers: Links = NO_DROPPERS
    constrained: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    loads: list[Load] = field(default_factory=list)
    terms_of: dict[str, int] = field(default_factory=dict)
    broken: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    form: Equilibrium | None = None
    hanging_at_arms: np.ndarray = field(default_factory=lambda: np.zeros(0))
    missing: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    dropper_gap: np.ndarray = field(default_factory=lambda: np.zeros(0))
    hanging: list[Hanging] = field(default_factory=list)
    hanging_wires: dict[int, np.ndarray] = field(default_factory=dict)

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
        """Number of unknowns of all nodes."""
        return self.numbering.n_unknowns

    @property
    def weight(self) -> np.ndarray:
        """Gravity load (n_dofs,) [N], [N m]; summed at each access."""
        weight, gravity = np.zeros(self.n_dofs), self.simulated.gravity
        for dofs, mass, kind in self.hanging if gravity else ():
            if not dofs.size:
                continue  # hardware of masts, of which a line of one span has none
            own = mass if kind is None else mass[kind]
            every = np.bincount(dofs.ravel(), weights=own.ravel(), minlength=self.n_dofs)
            weight -= np.multiply(every, gravity, out=every)
        return weight

    def constrained_between(self, low: int, high: int) -> np.ndarray:
        """Numbers of ``constrained``, which ascend, from ``low`` to before ``high``."""
        held = self.constrained
        return held[np.searchsorted(held, low) : np.searchsorted(held, high)]

    def dofs(self, nodes: np.ndarray, unknown: str = "w") -> np.ndarray:
        """Numbers of one unknown at mesh nodes, shape as ``nodes``; ValueError if one has none."""
        return self.numbering.of(nodes, unknown)

    def droppers_by_group(self) -> Iterator[tuple[Droppers, np.ndarray]]:
        """Groups of droppers, and which of the mesh's each has, (n_droppers,) bool."""
        for number, group in enumerate(self.problem.line.droppers):
            yield group, self.mesh.dropper_group == number

    def arms_by_group(self) -> Iterator[tuple[SteadyArms, np.ndarray]]:
        """Groups of steady arms, and which of the mesh's each has, (n_arms,) bool."""
        for number, group in enumerate(self.problem.line.steady_arms):
            yield group, self.mesh.arm_group == number

    def supports_by_group(self) -> Iterator[tuple[Supports, np.ndarray]]:
        """Groups of supports and their nodes (n,)."""
        for number, group in enumerate(self.problem.line.supports):
            yield group, self.mesh.supports[self.mesh.support_group == number]

    def clamps_by_group(self) -> Iterator[tuple[Clamps, np.ndarray]]:
        """Groups of clamps, and the nodes (n, 2) that they join."""
        for number, group in enumerate(self.problem.line.clamps):
            yield group, self.mesh.clamps[self.problem.line.clamp_group == number]

    @cached_property
    def dropper_slopes(self) -> Slopes:
        """Tension over stretch of the droppers, sound ones and broken ones."""
        n_pieces = max((group.kind.n_pieces for group in self.problem.line.droppers), default=1)
        found = np.zeros((3, self.mesh.droppers.shape[0], n_pieces))
        for group, mine in self.droppers_by_group():
            own = np.stack(group.kind.slopes_at(self.cut_lengths[mine]))
            # Droppers with fewer pieces repeat their last one.
            found[:, mine] = np.pad(
                own, ((0, 0), (0, 0), (0, found.shape[2] - own.shape[2])), "edge"
            )
        return Slopes(*found)

    @property
    def droppers_bend(self) -> bool:
        """Whether any has several slopes."""
        return any(group.kind.n_pieces > 1 for group in self.problem.line.droppers)

    @property
    def dropper_pieces(self) -> Slopes:
        """The piece of its law on which each dropper is at rest, the first for a slack dropper."""
        slopes = self.dropper_slopes
        force = np.zeros(self.broken.size) if self.form is None else self.form.dropper_force
        return slopes.at(np.where(self.dropper_gap > 0.0, 0, slopes.piece_under(force)))

    @property
    def dropper_stiffness(self) -> np.ndarray:
        return np.where(self.broken, 0.0, self.dropper_pieces.slope)

    def droppers_at(self, places: Sequence[DropperPlace]) -> np.ndarray:
        """Numbers of the droppers that stand nearest to places, (n_places,) int."""
        return droppers_at(self.mesh.x(self.mesh.droppers[:, 1]), places)

    @property
    def dropper_damping(self) -> np.ndarray:
        alphas = [self.damping_of(group.name)[0] for group in self.problem.line.droppers]
        return np.array([*alphas, 0.0])[self.mesh.dropper_group] * self.dropper_stiffness

    @property
    def released_damping(self) -> np.ndarray:
        if not self.problem.slack_dampers_act:
            return self.dropper_damping
        # Numerical damping goes with the spring, whatever the law of the droppers' own dampers.
        added = [self.simulated.added_alpha.get(g.name, 0.0) for g in self.problem.line.droppers]
        return np.array([*added, 0.0])[self.mesh.dropper_group] * self.dropper_stiffness

    def damping_of(self, component: str) -> tuple[float, float]:
        """Damping factors (alpha [s], beta [1/s]) of a component."""
        damping = self.simulated.damping
        return damping.per_component.get(component, (damping.alpha, damping.beta))

    def damping_of_block(self, block: Block) -> tuple[float, float]:
        """Damping factors (alpha [s], beta [1/s]) of a block."""
        lateral = self.simulated.damping.lateral if block.lateral else None
        return self.damping_of(block.component) if lateral is None else lateral

    @property
    def damping_is_proportional(self) -> bool:
        """Whether C = alpha K + beta M holds for the whole line with one alpha and one beta."""
        if any(block.damping is not None for block in self.blocks):
            return False
        return len({self.damping_of_block(block) for block in self.blocks}) <= 1

    def tension_of(self, wire: str) -> np.ndarray:
        """Tension of the elements of a wire at rest, (n_elements,) [N]."""
        tension = self.problem.line.wire(wire).tension_at(self.mesh.middles(wire))
        gained = {} if self.form is None else self.form.gained_tension
        return tension + gained[wire] if wire in gained else tension

    def wire_elements(
        self, wire: str, unknowns: tuple[str, str] = UPRIGHT
    ) -> tuple[np.ndarray, np.ndarray]:
        """Element unknowns (n, 4) of a wire in the plane of two unknowns, and lengths (n,) [m]."""
        first, second = self.mesh.elements(wire).T
        ends = [self.dofs(nodes, name) for nodes in (first, second) for name in unknowns]
        return np.stack(ends, axis=1), self.mesh.x(second) - self.mesh.x(first)

    @property
    def contact_x(self) -> np.ndarray:
        """Positions of the (first) contact wire's nodes [m], ascending."""
        return self.mesh.x(self.contact_nodes)

    @property
    def contact_nodes(self) -> np.ndarray:
        """Nodes of the (first) contact wire, in order of x."""
        return self.nodes_of(Role.CONTACT)[0]

    def nodes_of(self, role: Role) -> list[np.ndarray]:
        """Nodes of each wire of a role, in order of x."""
        return [self.mesh.wires[wire.name] for wire in self.problem.line.wires_of(role)]


def same_matrices(one: Model, other: Model) -> bool:
    """Whether M, C and K of two models on the same mesh are the same, number by number."""
    if one is other:
        return True
    if len(one.blocks) != len(other.blocks) or len(one.links) != len(other.links):
        return False
    pairs = zip(one.blocks, other.blocks, strict=True)
    return (
        all(
            _equal(a.kind, b.kind)
            and _equal(a.stiffness, b.stiffness)
            and _equal(a.mass, b.mass)
            and _equal(a.damping, b.damping)
            for a, b in pairs
        )
        and all(
            _alike_in_matrices(a.law, b.law) and all(map(np.array_equal, a.direction, b.direction))
            for a, b in zip(one.links, other.links, strict=True)
        )
        and np.array_equal(one.constrained, other.constrained)
    )


def _alike_in_matrices(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether laws of links differ at most in the gaps of open ones, which no matrix has."""
    if not (one["open"].any() and np.array_equal(one["open"], other["open"])):
        return np.array_equal(one, other)
    laws = one.copy(), other.copy()
    for law in laws:
        law["rest"][law["open"]] = 0.0
    return np.array_equal(*laws)


def _equal(one: np.ndarray | None, other: np.ndarray | None) -> bool:
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other)
