"""The model under construction, to which effects add their terms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catenary.meshgen.mesh import DROPPERS
from catenary.meshgen.wires import SAME_PLACE
from catenary.solver.model import beam
from catenary.solver.model.alike import alike
from catenary.solver.model.link_directions import between_nodes, dropper_directions
from catenary.solver.model.links import BOTH, NO_BENDS, PULLS, Bends, Direction, Links, law
from catenary.solver.model.loads import Load
from catenary.solver.model.model import Block, Hanging, Model
from catenary.solver.model.unknowns import LEVEL, UPRIGHT
from catenary.solver.problem.problem import Problem

# Displacements of a node beside its height, in which its masses move as well.
_BESIDE = ("u", "v")


class ModelBuilder:
    """Collects terms of effects; ``finish`` gives the model.

    Parameters
    ----------
    before : a model of the same problem, mesh and shape, whose wires are taken over
    """

    def __init__(self, model: Model, before: Model | None = None) -> None:
        self.model, self._before = model, before
        self.problem: Problem = model.problem
        self.mesh = model.mesh
        self._constrained: list[np.ndarray] = []
        self._n_terms = 0

    def add_wire(self, wire: str, unknowns: tuple[str, str] = UPRIGHT) -> None:
        """Bending and tension of a wire in the plane of two unknowns; its mass and weight."""
        if self._before is not None:
            number = len(self.model.blocks)
            self.add_block(self._before.blocks[number])
            if number in self._before.hanging_wires:
                self._hang(number, self._before.hanging_wires[number])
            return
        dofs, length = self.model.wire_elements(wire, unknowns)
        data = self.problem.line.wire(wire)
        section, bending = data.left_of(self.mesh.x(self.mesh.elements(wire)))
        each = np.column_stack([length, self.model.tension_of(wire), section, bending])
        first, kind = alike(each)
        length, tension, section, bending = each[first].T
        mass = beam.mass(length, data.mass_per_length * section)
        stiffness = beam.stiffness(length, data.bending_stiffness * bending, tension)
        load = (data.mass_per_length * section)[:, None] * beam.uniform_load(length)
        lateral = tuple(unknowns) == LEVEL
        self.add_block(Block(wire, dofs, kind, mass, stiffness, of_shape=True, lateral=lateral))
        if unknowns[0] == "w":
            self._hang(len(self.model.blocks) - 1, load)

    def _hang(self, number: int, load: np.ndarray) -> None:
        """Add the weight of the wire of block ``number``, with masses (k, m) of each kind."""
        block = self.model.blocks[number]
        self.model.hanging_wires[number] = load
        self.model.hanging.append(Hanging(block.dofs, load, block.kind))

    def add_springs(
        self, component: str, nodes: np.ndarray, unknown: str, stiffness: float | np.ndarray
    ) -> None:
        """Springs from ``nodes`` (n,) to the ground, without force at rest.

        ``unknown`` is the name of the displacement that they resist; ``stiffness`` (n,), or one for
        all, in [N/m], or [N m/rad] for a rotation.
        """
        values = np.broadcast_to(np.asarray(stiffness, dtype=float), nodes.shape)
        dofs = self.model.dofs(nodes, unknown)[:, None]
        self.add_elements(component, dofs, stiffness=values[:, None, None])

    def add_masses(
        self,
        component: str,
        nodes: np.ndarray,
        mass: float | np.ndarray,
        hanging_mass: float | np.ndarray | None = None,
        unknown: str = "w",
    ) -> None:
        """Point masses at ``nodes`` (n,); ``mass`` (n,), or one for all [kg].

        ``unknown`` is the displacement that they resist: masses on heights, "w", have weight and
        resist motion along the track and sideways as well, where nodes have it. ``hanging_mass``
        is the mass that the node carries at rest, if it differs from ``mass``.
        """
        values = np.broadcast_to(np.asarray(mass, dtype=float), nodes.shape)
        dofs = self.model.dofs(nodes, unknown)
        self.add_elements(component, dofs[:, None], mass=values[:, None, None])
        for name in _BESIDE if unknown == "w" else ():
            there = self.model.numbering.has(nodes, name)
            if there.any():
                self.add_masses(component, nodes[there], values[there], unknown=name)
        if unknown == "w":
            hanging = values if hanging_mass is None else hanging_mass
            own = np.broadcast_to(np.asarray(hanging), nodes.shape)
            self.model.hanging.append(Hanging(dofs, own))

    def add_masses_at(self, component: str, places: Direction, mass: np.ndarray) -> None:
        """Point masses ``mass`` (n,) [kg] with weight, anywhere on wires, in the vertical plane.

        ``places`` are the directions of the deflections there.
        """
        unknowns, weights = places
        self.add_elements(component, unknowns, mass=places.matrices(mass))
        self.model.hanging.append(Hanging(unknowns, mass[:, None] * weights))

    def add_clamps(self, unknown: str) -> None:
        """Add the clamps between wires against relative motion in one unknown of their nodes."""
        for clamps, pairs in self.model.clamps_by_group():
            laws = law(self.mesh.x(pairs[:, 1]), clamps.stiffness)
            self.add_links(clamps.name, between_nodes(self.model, pairs, unknown), laws)

    def add_links(
        self,
        component: str,
        direction: Direction,
        law: np.ndarray,
        of_shape: bool = False,
        bends: Bends = NO_BENDS,
    ) -> Links:
        """Add links to the model and to K, and return them. No weight is added.

        The time loop follows those that act one way and those that bend; links open at rest are no
        part of K.

        Parameters
        ----------
        component : str
            Name of their component, which decides on damping.
        direction : Direction
            Unknowns and weights of each link.
        law : ndarray, shape (n,)
            Records of `links.LAW`.
        of_shape : bool, optional
            Whether form finding finds their forces at rest, see `Block`.
        bends : Bends, optional
            Further bends of their laws.

        Raises
        ------
        ValueError
            If further links of one sign have the name of the droppers, whose channel records
            droppers alone.
        """
        model, links = self.model, Links(component, direction, law, of_shape, bends)
        if component == DROPPERS and (law["acts"] != BOTH).any():
            raise ValueError(f"links of one sign need a name of their own, not {component}")
        model.links.append(links)
        stiffness = links.stiffness_matrices
        self.add_elements(component, direction.unknowns, stiffness=stiffness, of_shape=of_shape)
        return links

    def add_droppers(self) -> None:
        """The droppers of the mesh; those of each group are a component of their own."""
        model, mesh = self.model, self.mesh
        laws = law(mesh.x(mesh.droppers[:, 1]), model.dropper_stiffness, acts=PULLS)
        model.droppers = Links(DROPPERS, dropper_directions(model), laws, of_shape=True)
        model.links.append(model.droppers)
        matrices = model.droppers.stiffness_matrices
        # Of links that are slack at rest K holds the stiffness that they keep.
        slack = model.dropper_gap > 0.0
        matrices[slack] *= model.simulated.kept_ratio
        for group, mine in model.droppers_by_group():
            unknowns = model.droppers.direction.unknowns[mine]
            self.add_elements(group.name, unknowns, stiffness=matrices[mine], of_shape=True)
            if self.problem.slack_dampers_act and slack[mine].any():
                self._add_dampers(group.name, mine & slack)

    def _add_dampers(self, component: str, which: np.ndarray) -> None:
        """Dampers of droppers that are slack at rest and whose dampers act nevertheless."""
        model = self.model
        direction = model.droppers.direction.some(which)
        kept = (model.dropper_damping - model.released_damping)[which]
        lacking = (1.0 - model.simulated.kept_ratio) * kept
        self.add_elements(component, direction.unknowns, damping=direction.matrices(lacking))

    def add_pendulums(self, direction: Direction, stiffness: np.ndarray) -> None:
        """Stiffness (n_droppers,) [N/m] of droppers across themselves, as of pendulums."""
        for group, mine in self.model.droppers_by_group():
            own = direction.some(mine)
            matrices = own.matrices(stiffness[mine])
            self.add_elements(group.name, own.unknowns, stiffness=matrices, of_shape=True)

    def add_load(self, load: Load) -> None:
        """A load in time, of one of the kinds in ``model/loads.py``."""
        self.model.loads.append(load)
        self._n_terms += len(load.unknowns)

    def add_elements(
        self, component: str, dofs: np.ndarray, of_shape: bool = False, **terms: np.ndarray
    ) -> None:
        """Add elements, each with matrices of its own, as ``Block.of_elements`` takes them; those
        of the model before are taken over where they are the same."""
        number = len(self.model.blocks)
        if self._before is not None and number < len(self._before.blocks):
            same = self._before.blocks[number]
            kind = (same.component, same.of_shape, same.lateral)
            if kind == (component, of_shape, False) and same.is_of(dofs, terms):
                self.add_block(same)
                return
        self.add_block(Block.of_elements(component, dofs, of_shape=of_shape, **terms))

    def add_block(self, block: Block) -> None:
        """Element matrices of any kind; masses carry no weight."""
        dofs, kind = (part.astype(np.int32, copy=False) for part in (block.dofs, block.kind))
        self.model.blocks.append(replace(block, dofs=dofs, kind=kind))
        self._n_terms += block.dofs.shape[0]

    @property
    def held_ends(self) -> np.ndarray:
        """Nodes where pieces of wire are held, but for ends of a line that goes on beyond."""
        anchors, masts = self.mesh.anchors, self.problem.line.support_positions
        x, held = self.mesh.x(anchors), np.ones(anchors.size, dtype=bool)
        for place, goes_on in zip(masts[[0, -1]], self.model.simulated.goes_on, strict=True):
            held &= (np.abs(x - place) > SAME_PLACE) | (not goes_on)
        return np.asarray(anchors[held])

    def hold(self, nodes: np.ndarray, unknown: str) -> None:
        """Hold an unknown of some nodes at its equilibrium value."""
        self.hold_unknowns(self.model.dofs(nodes, unknown))

    def hold_unknowns(self, unknowns: np.ndarray) -> None:
        """Hold unknowns by their numbers."""
        self._constrained.append(unknowns)

    @property
    def held(self) -> np.ndarray:
        """Numbers of the unknowns that are held so far."""
        return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *self._constrained]))

    def take_count(self) -> int:
        """Terms added since the last call."""
        count, self._n_terms = self._n_terms, 0
        return count

    def finish(self) -> Model:
        """The model, its constraints put together."""
        model = self.model
        held = [model.numbering.missing, *self._constrained]
        model.constrained = np.unique(np.concatenate(held))
        return model
