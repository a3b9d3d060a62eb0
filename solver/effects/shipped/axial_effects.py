"""Effects along the track: stretch of wires, tensioners, temperature."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from catenary.meshgen.wires import SAME_PLACE, End
from catenary.solver.effects.effect import Effect, register
from catenary.solver.effects.shipped import vertical_effects  # noqa: F401  (built before)
from catenary.solver.model import axial_motion
from catenary.solver.model.alike import alike
from catenary.solver.model.link_directions import across_droppers
from catenary.solver.model.links import PULLS, PUSHES, Direction, law, slips
from catenary.solver.model.model import Block
from catenary.solver.problem.problem import Problem

if TYPE_CHECKING:
    from catenary.solver.model.builder import ModelBuilder

AXIAL = "axial_motion"
# Components: tensioners in the damping, and their stops, of weights at their lowest and highest.
TENSIONERS = "tensioners"
_LOWEST, _HIGHEST = "tensioner_stops_down", "tensioner_stops_up"
# Of wheels that slip as the wire pulls them, and as the weights do.
_GIVES, _TAKES = "tensioner_slips_in", "tensioner_slips_out"
# Speed of a wheel that stands by friction, at the edge of its band [m/s].
CREEP = 1e-4


def moves_along(problem: Problem) -> bool:
    """Whether the wires of a problem move along the track."""
    return AXIAL in problem.effects


def _axial(builder: ModelBuilder) -> None:
    for wire in builder.problem.line.wires:
        _add_bars(builder, wire.name)
    _add_pendulums(builder)
    builder.add_clamps("u")
    builder.hold(axial_motion.held_along(builder.model), "u")


def _add_bars(builder: ModelBuilder, name: str) -> None:
    """Stiffness and mass of a wire along the track."""
    model, data = builder.model, builder.problem.line.wire(name)
    if data.axial_stiffness is None:
        raise ValueError(f"{name} has no axial stiffness")
    unknowns = axial_motion.unknowns_along(model, name)
    rows = axial_motion.strain_rows(model, name)
    left, _ = data.left_of(model.mesh.x(model.mesh.elements(name)))
    first, kind = alike(np.column_stack([rows, left]))
    rows, left = rows[first], left[first]
    length = 1.0 / rows[:, 1]
    stiffness = (data.axial_stiffness * left * length)[:, None, None] * (
        rows[:, :, None] * rows[:, None, :]
    )
    mass = np.zeros_like(stiffness)
    mass[:, :2, :2] = axial_motion.bar_mass(left * length, data.mass_per_length)
    builder.add_block(Block(name, unknowns, kind, mass, stiffness, of_shape=True))


def _add_pendulums(builder: ModelBuilder) -> None:
    """Droppers swing along the track against their force, arms against their radial force."""
    model, mesh, line = builder.model, builder.mesh, builder.problem.line
    (unknowns, weights), stiffness = across_droppers(model)
    matrices = stiffness[:, None, None] * weights[:, :, None] * weights[:, None, :]
    for number, droppers in enumerate(line.droppers):
        mine = mesh.dropper_group == number
        builder.add_block(
            Block.of_elements(
                droppers.name, unknowns[mine], stiffness=matrices[mine], of_shape=True
            )
        )
    for number, arms in enumerate(line.steady_arms):
        if model.simulated.lateral:
            continue  # bars, which swing along the track as well
        nodes = mesh.steady_arms[mesh.arm_group == number]
        radial = np.abs(line.wire(arms.wire).radial_force(np.array(arms.x)))
        if radial.any() and arms.kind.length > 0.0:
            builder.add_springs(arms.name, nodes, "u", radial / arms.kind.length)


def _tensioners(builder: ModelBuilder) -> None:
    """Inertia of the weights, friction of the wheels and end stops."""
    model, problem = builder.model, builder.problem
    tensioner = model.simulated.tensioner
    assert tensioner is not None
    ends = [
        end for end in axial_motion.tensioned_ends(model) if not axial_motion.at_stop(model, end)
    ]
    if not ends:
        return
    nodes = np.array([end.node for end in ends])
    inertia = [
        tensioner.inertia(end.wire, problem.line.wire(end.wire), problem.gravity) for end in ends
    ]
    builder.add_masses(TENSIONERS, nodes, np.array(inertia), unknown="u")
    if not tensioner.turns:
        _add_friction(builder, ends)
    if tensioner.travel is None:
        return
    # Stretch is how far an end is outwards: from there on weights sink no further.
    sign = np.array([float(end.outwards) for end in ends])
    moved = np.zeros(len(ends))
    if model.form is not None and model.form.along.size:
        moved = sign * model.form.along[nodes]
    direction = Direction(model.dofs(nodes, "u")[:, None], sign[:, None])
    for stop, acts, way in ((_LOWEST, PULLS, -moved), (_HIGHEST, PUSHES, moved)):
        gap = np.maximum(tensioner.travel + way, 0.0)
        laws = law(builder.mesh.x(nodes), tensioner.stop_stiffness, acts=acts, gap=gap)
        builder.add_links(stop, direction, laws)


def _add_friction(builder: ModelBuilder, ends: list[axial_motion.WireEnd]) -> None:
    """Dry friction of wheels: a damper that slips where the tension leaves the band of a wheel that
    stands. While one stands it creeps, by ``CREEP`` where half the band is used."""
    model, problem = builder.model, builder.problem
    tensioner = model.simulated.tensioner
    assert tensioner is not None
    nodes = np.array([end.node for end in ends])
    unknowns = model.dofs(nodes, "u")[:, None]
    low, high, tension = np.array(
        [
            (
                *tensioner.band(end.wire, problem.line.wire(end.wire), problem.gravity),
                axial_motion.tension_at_rest(model, end),
            )
            for end in ends
        ]
    ).T
    damping = 0.5 * (high - low) / CREEP
    builder.add_block(Block.of_elements(TENSIONERS, unknowns, damping=damping[:, None, None]))
    outwards = np.array([[float(end.outwards)] for end in ends])
    x = builder.mesh.x(nodes)
    # A wire that pulls more than the band allows moves inwards, one that pulls less outwards.
    for name, sign, left in ((_GIVES, 1.0, high - tension), (_TAKES, -1.0, tension - low)):
        laws = slips(x, np.maximum(left, 0.0), damping)
        builder.add_links(name, Direction(unknowns, sign * outwards), laws, of_shape=True)


def _has_tensioner(problem: Problem) -> bool:
    along, masts = problem.along, problem.line.support_positions[[0, -1]]
    line_ends = float(masts[0]), float(masts[1])
    has_one = any(
        along.tensioned(piece.x[end], line_ends, SAME_PLACE)
        if piece.tensioned[end] is None
        else piece.tensioned[end]
        for wire in problem.line.wires
        for piece in wire.pieces
        for end in (0, -1)
        if piece.ends[end] is not End.CLAMPED
    )
    return AXIAL in problem.effects and has_one


register(
    Effect(
        AXIAL,
        "motion of the wires along the track",
        "places along the track, stretch of wires, droppers and arms that swing along the track",
        "mean strain of a bar about its shape at rest (Washizu 1982)",
        default=False,
        unknowns_of_wire=lambda wire: ("u",),
        applies=lambda p: all(wire.axial_stiffness is not None for wire in p.line.wires),
        data="axial_stiffness_N, or section_mm2 and youngs_modulus_GPa, of every wire",
        build=_axial,
        of_form=True,
    ),
    Effect(
        "tensioners",
        "tensioners at the ends of wires",
        "inertia of weights and stops at their ends of travel; line.tensioner",
        "weights on a wheel with friction",
        applies=_has_tensioner,
        data="line.ends or line.overlap with along = tensioner, and effects.axial_motion",
        build=_tensioners,
        components=(TENSIONERS, _LOWEST, _HIGHEST),
        law=lambda laws, p: replace(laws, tensioner=p.along.tensioner),
    ),
    Effect(
        "temperature",
        "another temperature than that of the installation",
        "growth of the wires, droppers that lean and arms that swing at rest; line.temperature",
        "potential energy of wires and droppers of given lengths",
        applies=lambda p: AXIAL in p.effects and p.along.warmer != 0.0,
        data="line.temperature.difference_K other than 0, and effects.axial_motion",
        law=lambda laws, p: replace(laws, warmer=p.along.warmer),
        of_form=True,
        after_cutting=True,
    ),
)
