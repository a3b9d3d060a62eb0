"""Both sides of a line's equilibrium: its loads at rest, and its forces in any shape nearby.

Loads are weights, cant, curve, mean wind, links with a force of their own. Forces follow from one
energy for all planes: wires have the strain of their course in every plane that is simulated,
droppers the length between their ends wherever these are, steady arms that of a bar to a hinge that
stays. All else is linear. With the rest z known to be balanced under its loads, a displacement d
from it is at rest where

    p(d) = load,        p(d) = dE'/dd(z + d) - dE/dd(z)

E is the potential energy of the line that was balanced, E' that of the line as it is now, and the
load what it has to carry beside the former one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from catenary.meshgen.line import SteadyArm
from catenary.meshgen.wires import Wire
from catenary.solver.model import beam
from catenary.solver.model.axial_motion import (
    curve_rows,
    rows_in_curve,
    shape_of,
    slope_rows,
)
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.unknowns import LEVEL, UPRIGHT
from catenary.solver.wind import mean_load

# Components of a dropper's vector and of an arm's.
_DROPPER, _ARM = ("u", "v", "w"), ("v", "w", "u")


def dead_loads(model: Model) -> np.ndarray:
    """Loads that no shape changes, (n_dofs,) [N], [N m]: weights, their part sideways on a canted
    track, the mean wind, and forces of links that do not follow the shape at rest."""
    weight = model.weight
    load = weight.copy()
    for links in model.links:
        pulls = np.where(links.law["open"], 0.0, links.law["rest"])
        if not links.of_shape and pulls.any():
            unknowns, weights = links.direction
            np.add.at(load, unknowns, -pulls[:, None] * weights)
    if not model.simulated.lateral:
        return load
    line, wind = model.problem.line, model.simulated.wind
    if line.curve is not None:
        every = np.arange(model.mesh.n_nodes)
        share = line.curve.sideways_pull_at(model.mesh.x(every))
        for sideways, own in zip(LEVEL, UPRIGHT, strict=True):
            load[model.dofs(every, sideways)] -= share * weight[model.dofs(every, own)]
    if wind is None:
        return load
    for wire in line.wires:
        dofs, length = model.wire_elements(wire.name, LEVEL)
        middle = model.mesh.middles(wire.name)
        pull = mean_load(wind, model.problem.tunnels, wire, middle)
        np.add.at(load, dofs, pull[:, None] * beam.uniform_load(length))
        if line.curve is not None:
            pull *= line.curve.upright_part_at(middle)
            upright, _ = model.wire_elements(wire.name)
            np.add.at(load, upright, pull[:, None] * beam.uniform_load(length))
    return load


def curve_load(model: Model, form: Equilibrium | None) -> np.ndarray:
    """Pull of the tension of the installation towards the centre of a curve, (n_dofs,) [N], [N m],
    of lines with lateral motion. A course y across a track of curvature c has the curvature
    y'' + c in plan, of which a canted plane has a part across itself; where the track twists, a
    course that is straight relative to it is not straight in space, about the shape ``form``,
    None where none is known yet."""
    load = np.zeros(model.n_dofs)
    if model.problem.line.curve is None or not model.simulated.lateral:
        return load
    for wire in model.problem.line.wires:
        upright, length = model.wire_elements(wire.name)
        level, _ = model.wire_elements(wire.name, LEVEL)
        middle = model.mesh.middles(wire.name)
        pull = wire.tension_at(middle) * length
        for dofs, rows in zip((upright, level), curve_rows(model, wire.name, form), strict=True):
            np.add.at(load, dofs, -pull[:, None] * rows)
    return load


def exact_moments(model: Model) -> np.ndarray:
    """Moments that exact elements add to ``dead_loads`` and ``curve_load`` of a line in still air,
    (n_dofs,) [N m]: under a uniform load their ends carry smaller moments. Droppers have no part in
    it."""
    load, line = np.zeros(model.n_dofs), model.problem.line
    curve = line.curve if model.simulated.lateral else None
    for wire in line.wires:
        dofs, length = model.wire_elements(wire.name)
        middle = model.mesh.middles(wire.name)
        tension = wire.tension_at(middle)
        lacks = beam.moment_share(length, wire.bending_stiffness, tension) - 1.0
        moments = lacks[:, None] * beam.uniform_load(length) * np.array([0.0, 1.0, 0.0, 1.0])
        weight = model.simulated.gravity * wire.mass_per_length
        np.add.at(load, dofs, -weight * moments)
        if curve is not None:
            pull = curve.upright_curvature_at(middle) * tension
            np.add.at(load, dofs, pull[:, None] * moments)
            pull = curve.sideways_pull_at(middle) * weight + curve.curvature_at(middle) * tension
            sideways, _ = model.wire_elements(wire.name, LEVEL)
            np.add.at(load, sideways, pull[:, None] * moments)
    return load


class Potential:
    """Forces of a line on its unknowns in shapes near a known rest.

    Parameters
    ----------
    was : the model that was balanced in the shape ``known``
    model : the line as it is now, about the same shape
    cut : (n_droppers,) unstretched lengths of its droppers [m]
    """

    def __init__(self, was: Model, model: Model, known: Equilibrium, cut: np.ndarray) -> None:
        self.model, self.known, self._cut = model, known, cut
        self._wires = [_Wire(was, model, wire, known) for wire in model.problem.line.wires]
        self._springs = [b for b in model.blocks if b.stiffness is not None and not b.of_shape]
        self._parts = [k for k, name in enumerate(_DROPPER) if name in model.unknowns]
        if not model.simulated.lateral:
            self._parts = [k for k in self._parts if _DROPPER[k] != "v"]
        self._droppers_were = self._pulls(known, known.dropper_force)
        self._arms = [
            _Arms(model, known, mine, arms.kind)
            for arms, mine in model.arms_by_group()
            if arms.kind.length > 0.0 and known.lateral is not None
        ]

    def reserve(self, form: Equilibrium) -> np.ndarray:
        """Forces of droppers if they could push, (n_droppers,) [N]."""
        vectors = form.dropper_vectors(self.model.mesh.droppers)
        stretch = np.linalg.norm(vectors, axis=1) - self._cut
        return np.where(self.model.broken, 0.0, self.model.dropper_slopes.force_at(stretch))

    def form(self, moved: np.ndarray) -> Equilibrium:
        """The shape displaced by ``moved`` (n_dofs,) [m], [rad], with forces of droppers as if they
        could push."""
        model, known = self.model, self.known
        every = np.arange(model.mesh.n_nodes)
        form = replace(
            known,
            height=known.height + moved[model.dofs(every)],
            slope=known.slope + moved[model.dofs(every, "theta_y")],
            dropper_length=self._cut,
        )
        if "u" in model.unknowns:
            gained = {wire.name: wire.gained(moved) for wire in self._wires}
            along = known.moved_along(every) + moved[model.dofs(every, "u")]
            form = replace(form, along=along, gained_tension=gained)
        if known.lateral is not None:
            force = known.lateral.arm_force.copy()
            pushed = np.zeros(len(force), dtype=bool)
            for arm in self._arms:
                force[arm.mine] = arm.force(moved)
                pushed[arm.mine] = arm.tension(moved)[0] < 0.0
            lateral = replace(
                known.lateral,
                y=known.lateral.y + moved[model.dofs(every, "v")],
                slope=known.lateral.slope + moved[model.dofs(every, "theta_z")],
                arm_force=force,
                arm_pushed=pushed,
            )
            form = replace(form, lateral=lateral)
        return replace(form, dropper_force=self.reserve(form))

    def pull(self, moved: np.ndarray, form: Equilibrium, carried: np.ndarray) -> np.ndarray:
        """p(d), (n_dofs,) [N], [N m].

        Parameters
        ----------
        moved : ndarray, shape (n_dofs,)
            Displacement from the known rest [m], [rad].
        form : Equilibrium
            Shape after the displacement.
        carried : ndarray, shape (n_droppers,)
            Tension of the droppers [N].
        """
        total = np.zeros(self.model.n_dofs)
        for block in self._springs:
            assert block.stiffness is not None
            own = np.einsum("nij,nj->ni", block.stiffness[block.kind], moved[block.dofs])
            np.add.at(total, block.dofs, own)
        for wire in self._wires:
            wire.add_pull(total, moved)
        upper, lower = self.model.mesh.droppers.T
        change = self._pulls(form, carried) - self._droppers_were
        for k in self._parts:
            np.add.at(total, self.model.dofs(upper, _DROPPER[k]), change[:, k])
            np.add.at(total, self.model.dofs(lower, _DROPPER[k]), -change[:, k])
        for arm in self._arms:
            np.add.at(total, arm.unknowns, arm.was - arm.force(moved)[:, : arm.unknowns.shape[1]])
        return total

    def with_forces_that_hold(
        self, form: Equilibrium, moved: np.ndarray, carried: np.ndarray, load: np.ndarray
    ) -> Equilibrium:
        """The rest ``form`` with the forces by which arms without length hold their wires sideways:
        what balances there the loads of the line less those of the known one, ``load`` (n_dofs,)
        [N]; other parameters as of ``pull``."""
        pinned = np.zeros(self.model.mesh.steady_arms.size, dtype=bool)
        for arms, own in self.model.arms_by_group():
            pinned |= own & (arms.kind.length == 0.0)
        mine = np.flatnonzero(pinned)
        if form.lateral is None or mine.size == 0:
            return form
        at = self.model.dofs(self.model.mesh.steady_arms[mine], "v")
        force = form.lateral.arm_force.copy()
        force[mine, 0] += (self.pull(moved, form, carried) - load)[at]
        return replace(form, lateral=replace(form.lateral, arm_force=force))

    def _pulls(self, form: Equilibrium, tension: np.ndarray) -> np.ndarray:
        """Forces of droppers on their upper ends, downwards and so on, (n_droppers, 3) [N]."""
        vectors = form.dropper_vectors(self.model.mesh.droppers)
        return np.asarray((tension / np.linalg.norm(vectors, axis=1))[:, None] * vectors)


class _Wire:
    """The elements of a wire: their tension, and how they pull at their nodes."""

    def __init__(self, was: Model, model: Model, wire: Wire, known: Equilibrium) -> None:
        pairs = model.mesh.elements(wire.name)
        ends = model.mesh.x(pairs)
        middle, self._length = ends.mean(axis=1), np.diff(ends, axis=1)[:, 0]
        before = was.problem.line.wire(wire.name)
        section, bending = wire.left_of(ends)
        self.name, self._tension = wire.name, wire.tension_at(middle)
        self._other_tension = self._tension - before.tension_at(middle)
        # By a unit of tension, and by bending and tension; then what bends otherwise than before.
        self._taut = beam.stiffness(self._length, 0.0, 1.0)
        bent = beam.stiffness(self._length, wire.bending_stiffness, 0.0)
        self._linear = bending[:, None, None] * bent + self._tension[:, None, None] * self._taut
        other_bending = (bending - before.left_of(ends)[1])[:, None, None] * bent
        self._other_bending = other_bending if other_bending.any() else None
        self._planes = []
        for plane, course, slope in known.planes():
            dofs, _ = model.wire_elements(wire.name, plane)
            self._planes.append((dofs, shape_of(course, slope, pairs)))
        self._curve, self._ends = model.problem.line.curve, ends
        self._curved = self._in_curve(np.zeros(model.n_dofs))
        self._along = model.dofs(pairs, "u") if "u" in model.unknowns else None
        self._had = known.gained_tension.get(wire.name, np.zeros(len(pairs)))
        if self._along is not None:
            assert wire.axial_stiffness is not None
            self._axial = wire.axial_stiffness * section
            warmer = model.simulated.warmer - was.simulated.warmer
            self._grown = wire.expansion * warmer

    def gained(self, moved: np.ndarray) -> np.ndarray:
        """Tension of each element beside that of the installation, (n,) [N]."""
        if self._along is None:
            return self._had
        first, second = moved[self._along].T
        strain = (second - first) / self._length - self._grown
        curved = self._in_curve(0.5 * moved)
        for number, (dofs, shape) in enumerate(self._planes):
            bent = moved[dofs]
            rows = slope_rows(self._length, shape + 0.5 * bent, self._taut) + curved[number]
            strain += (rows * bent).sum(axis=1)
        return np.asarray(self._had + self._axial * strain)

    def add_pull(self, total: np.ndarray, moved: np.ndarray) -> None:
        """Add what the wire pulls beside the known rest to ``total``."""
        gained = self.gained(moved)
        more = gained - self._had
        if self._along is not None:
            np.add.at(total, self._along, np.stack([-more, more], axis=1))
        other = (self._other_tension + more) * self._length
        curved = self._in_curve(moved)
        for number, (dofs, shape) in enumerate(self._planes):
            bent = moved[dofs]
            pull = np.einsum("nij,nj->ni", self._linear, bent)
            if self._other_bending is not None:
                pull += np.einsum("nij,nj->ni", self._other_bending, shape)
            if other.any():
                pull += other[:, None] * (
                    slope_rows(self._length, shape, self._taut) + self._curved[number]
                )
            if gained.any():
                pull += gained[:, None] * np.einsum("nij,nj->ni", self._taut, bent)
            # Where the track twists each plane sees what has moved in the other one.
            taut = (self._tension + gained) * self._length
            pull += taut[:, None] * (curved[number] - self._curved[number])
            np.add.at(total, dofs, pull)

    def _in_curve(self, moved: np.ndarray) -> tuple[np.ndarray, ...]:
        """What a curve adds to ``slope_rows`` in each plane, (n, 4); zero in one plane."""
        if len(self._planes) == 1:
            return (np.zeros((len(self._ends), 4)),)
        shapes = (shape + moved[dofs] for dofs, shape in self._planes)
        return rows_in_curve(self._curve, self._ends, *shapes)


class _Arms:
    """Steady arms of one kind as bars between clamps on a wire and hinges that stay.

    Attributes
    ----------
    mine : (n_arms,) bool, which they are
    unknowns : (n, 2) or (n, 3) of their clamps
    was : forces on the wire at the known rest, as many [N]
    """

    def __init__(self, model: Model, known: Equilibrium, mine: np.ndarray, kind: SteadyArm) -> None:
        assert known.lateral is not None
        self.mine = mine
        nodes = model.mesh.steady_arms[self.mine]
        names = [name for name in _ARM if name in model.unknowns]
        self.unknowns = np.stack([model.dofs(nodes, name) for name in names], axis=1)
        tension = known.lateral.arm_tension[self.mine]
        # The arm's own length is that which it has under this tension.
        self._stiffness = kind.bar_stiffness
        self._cut = kind.length - tension / self._stiffness
        self._hinge = kind.length * known.lateral.arm_direction[self.mine]
        self.was = self.force(np.zeros(model.n_dofs))[:, : len(names)]

    def tension(self, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tension of each arm, (n,) [N], and the unit vectors from clamps to hinges, (n, 3)."""
        to_hinge = self._hinge.copy()
        to_hinge[:, : self.unknowns.shape[1]] -= moved[self.unknowns]
        length = np.linalg.norm(to_hinge, axis=1)
        return self._stiffness * (length - self._cut), to_hinge / length[:, None]

    def force(self, moved: np.ndarray) -> np.ndarray:
        """On the wire: lateral, upward, and along the track, (n, 3) [N]."""
        tension, unit = self.tension(moved)
        return np.asarray(tension[:, None] * unit)
