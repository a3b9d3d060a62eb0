"""Effects of how a line ends: layers that absorb waves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from catenary.solver.effects import vertical_effects  # noqa: F401  (built before)
from catenary.solver.effects.effect import Effect, register
from catenary.solver.model.absorbing_layers import layer_blocks
from catenary.solver.problem.ends import AbsorbingLayer
from catenary.solver.problem.problem import Problem

if TYPE_CHECKING:
    from catenary.solver.model.builder import ModelBuilder


def _layers(builder: ModelBuilder) -> None:
    masts, n = builder.problem.line.support_positions, builder.problem.line.n_spans
    for end, (last, step) in zip(builder.problem.ends, ((0, 1), (n, -1)), strict=True):
        if isinstance(end, AbsorbingLayer):
            begin, outer = masts[last + step * end.n_spans], masts[last]
            for block in layer_blocks(builder.model, float(begin), float(outer), end.damping):
                builder.add_block(block)


def _has(problem: Problem, kind: type) -> bool:
    return any(isinstance(end, kind) for end in problem.ends)


register(
    Effect(
        "absorbing_layers",
        "spans at the ends that absorb waves",
        "damping on mass that grows towards the end; line.ends",
        "graded absorbing layer, b (x/l)^2 M",
        default=True,
        applies=lambda p: _has(p, AbsorbingLayer),
        build=_layers,
    )
)
