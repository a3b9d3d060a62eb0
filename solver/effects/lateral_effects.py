"""Lateral motion: wires, droppers as pendulums, clamps, and steady arms as pinned bars."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from catenary.solver.effects import vertical_effects  # noqa: F401  (built before)
from catenary.solver.effects.effect import Effect, register
from catenary.solver.model.links.leaning import sideways_of_droppers
from catenary.solver.model.links.links import Direction, between_nodes, law
from catenary.solver.model.model import Block

if TYPE_CHECKING:
    from catenary.solver.model.builder import ModelBuilder

PLANE = ("v", "theta_z")
# Of a bar along itself, far stiffer than what it holds [N/m].
_BAR_STIFFNESS = 1e7


def _lateral(builder: ModelBuilder) -> None:
    mesh, line = builder.mesh, builder.problem.line
    for wire in reversed(line.wires):
        builder.add_wire(wire.name, PLANE)
    _pendulums(builder)
    for number, clamps in enumerate(line.clamps):
        pairs = mesh.clamps[line.clamp_group == number]
        laws = law(mesh.x(pairs[:, 1]), clamps.stiffness)
        builder.add_links(clamps.name, between_nodes(builder.model, pairs, "v"), laws)
    barred = np.array([arms.kind.length > 0.0 for arms in line.steady_arms], dtype=bool)
    on_bars = barred[mesh.arm_group] if barred.size else np.zeros(0, dtype=bool)
    for number, arms in enumerate(line.steady_arms):
        if barred[number]:
            _bars(builder, arms.name, mesh.arm_group == number, arms.kind.length)
    held = np.concatenate([mesh.supports, mesh.steady_arms[~on_bars], builder.held_ends])
    builder.hold(np.setdiff1d(held, mesh.steady_arms[on_bars]), "v")


def _pendulums(builder: ModelBuilder) -> None:
    """What droppers' forces do across them, N/l of a pendulum."""
    direction, stiffness = sideways_of_droppers(builder.model)
    for number, group in enumerate(builder.problem.line.droppers):
        mine = builder.mesh.dropper_group == number
        _add_stiffness(builder, group.name, direction, mine, stiffness)


def _bars(builder: ModelBuilder, name: str, mine: np.ndarray, length: float) -> None:
    """Bars from the wire to hinges: stiff along themselves, P/l across."""
    model, mesh = builder.model, builder.mesh
    nodes = mesh.steady_arms[mine]
    direction = np.column_stack([np.ones(nodes.size), np.zeros(nodes.size)])
    tension = np.zeros(nodes.size)
    if model.form is not None and model.form.lateral is not None:
        shape = model.form.lateral
        direction, tension = shape.arm_direction[mine], shape.arm_tension[mine]
    unknowns = np.stack([model.dofs(nodes, "v"), model.dofs(nodes)], axis=1)
    laws = law(mesh.x(nodes), _BAR_STIFFNESS, rest=tension)
    builder.add_links(name, Direction(unknowns, -direction), laws)
    across = Direction(unknowns, direction[:, ::-1] * np.array([-1.0, 1.0]))
    _add_stiffness(builder, name, across, np.ones(nodes.size, dtype=bool), tension / length)


def _add_stiffness(
    builder: ModelBuilder,
    component: str,
    direction: Direction,
    which: np.ndarray,
    stiffness: np.ndarray,
) -> None:
    """Springs along some of the directions, which are never cut [N/m]."""
    unknowns, weights = direction.unknowns[which], direction.weights[which]
    matrices = stiffness[which, None, None] * weights[:, :, None] * weights[:, None, :]
    builder.add_block(Block(component, unknowns, np.arange(len(unknowns)), None, matrices))


register(
    Effect(
        "lateral_motion",
        "lateral motion of the wires, with steady arms as pinned bars",
        "lateral bending, tension and mass of all wires; droppers as pendulums, arms as bars",
        "tensioned beam in the lateral plane; bars with geometric stiffness",
        default=False,
        unknowns_of_wire=lambda wire: PLANE,
        build=_lateral,
        of_form=True,
        law=lambda laws, p: replace(laws, lateral=True),
    )
)
