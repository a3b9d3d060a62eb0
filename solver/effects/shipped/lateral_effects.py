"""Lateral motion: wires, droppers as pendulums, clamps, and steady arms as pinned bars."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from catenary.solver.effects.effect import Effect, register
from catenary.solver.effects.shipped import vertical_effects  # noqa: F401  (built before)
from catenary.solver.model.link_directions import sideways_of_droppers
from catenary.solver.model.links import Direction, law
from catenary.solver.model.model import Block
from catenary.solver.model.unknowns import LEVEL

if TYPE_CHECKING:
    from catenary.meshgen.line import SteadyArms
    from catenary.solver.model.builder import ModelBuilder

# Parts of unit vectors along the track below this are none: round-off [-].
_UPRIGHT = 1e-9


def _lateral(builder: ModelBuilder) -> None:
    mesh, line = builder.mesh, builder.problem.line
    for wire in reversed(line.wires):
        builder.add_wire(wire.name, LEVEL)
    _pendulums(builder)
    builder.add_clamps("v")
    barred = np.array([arms.kind.length > 0.0 for arms in line.steady_arms], dtype=bool)
    on_bars = barred[mesh.arm_group] if barred.size else np.zeros(0, dtype=bool)
    for number, arms in enumerate(line.steady_arms):
        if barred[number]:
            _bars(builder, arms, mesh.arm_group == number)
    held = np.concatenate([mesh.supports, mesh.steady_arms[~on_bars], builder.held_ends])
    builder.hold(np.setdiff1d(held, mesh.steady_arms[on_bars]), "v")


def _pendulums(builder: ModelBuilder) -> None:
    """Lateral stiffness of droppers under their force N: N / l, as of a pendulum."""
    direction, stiffness = sideways_of_droppers(builder.model)
    for number, group in enumerate(builder.problem.line.droppers):
        mine = builder.mesh.dropper_group == number
        unknowns, weights = direction.unknowns[mine], direction.weights[mine]
        springs = stiffness[mine, None, None] * weights[:, :, None] * weights[:, None, :]
        builder.add_block(Block.of_elements(group.name, unknowns, stiffness=springs, of_shape=True))


def _bars(builder: ModelBuilder, arms: SteadyArms, mine: np.ndarray) -> None:
    """Bars from the wire to hinges: stiff along themselves, P/l across."""
    name, length = arms.name, arms.kind.length
    model, nodes = builder.model, builder.mesh.steady_arms[mine]
    unit, tension = np.tile([1.0, 0.0, 0.0], (nodes.size, 1)), np.zeros(nodes.size)
    if model.form is not None and model.form.lateral is not None:
        shape = model.form.lateral
        unit, tension = shape.arm_direction[mine], shape.arm_tension[mine]
    # Along the track an arm that has not swung out does nothing but swing.
    swings = "u" in model.unknowns
    slewed = swings and bool((np.abs(unit[:, 2]) > _UPRIGHT).any())
    names = ("v", "w", "u") if slewed else ("v", "w")
    unit = unit[:, : len(names)]
    unknowns = np.stack([model.dofs(nodes, one) for one in names], axis=1)
    laws = law(builder.mesh.x(nodes), arms.kind.bar_stiffness, rest=tension)
    builder.add_links(name, Direction(unknowns, -unit), laws, of_shape=True)
    across = np.eye(len(names)) - unit[:, :, None] * unit[:, None, :]
    pull = (tension / length)[:, None, None]
    builder.add_block(Block.of_elements(name, unknowns, stiffness=pull * across, of_shape=True))
    if swings and not slewed:
        along = model.dofs(nodes, "u")[:, None]
        builder.add_block(Block.of_elements(name, along, stiffness=pull, of_shape=True))


register(
    Effect(
        "lateral_motion",
        "lateral motion of the wires, with steady arms as pinned bars",
        "lateral bending, tension and mass of all wires; droppers as pendulums, arms as bars",
        "tensioned beam in the lateral plane; bars with geometric stiffness",
        default=False,
        unknowns_of_wire=lambda wire: LEVEL,
        build=_lateral,
        of_form=True,
        law=lambda laws, p: replace(laws, lateral=True),
    )
)
