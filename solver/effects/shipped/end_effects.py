"""Effects of how a line ends: layers that absorb waves, and lines that go on periodically."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from catenary.base.errors import InputError
from catenary.solver.effects.effect import Effect, register
from catenary.solver.effects.shipped import defect_effects, lateral_effects  # noqa: F401  (built before)
from catenary.solver.model.model import Block, Model
from catenary.solver.problem.ends import AbsorbingLayer, Periodic
from catenary.solver.problem.integrator_parameters import integration_of
from catenary.solver.problem.problem import Problem, Simulated, steps_of

if TYPE_CHECKING:
    from catenary.solver.model.builder import ModelBuilder


def layer_damping(x: np.ndarray, begin: float, end: float, damping: float) -> np.ndarray:
    """Damping per mass of a layer at places along the track, shape as ``x`` [1/s].

    It grows from zero at ``begin`` to ``damping`` [1/s] at ``end`` as the square of the way into
    the layer, and is zero on the other side of ``begin``. The layer may lie to either side: ``end``
    may be less than ``begin`` [m]. Beyond ``end`` it stays as it is there. Not collective.
    """
    into = np.clip((x - begin) / (end - begin), 0.0, 1.0)
    return np.asarray(damping * into**2)


def layer_blocks(model: Model, begin: float, end: float, damping: float) -> list[Block]:
    """Damping blocks of an absorbing layer, for all masses that the model has so far.

    ``begin`` and ``end`` [m] and ``damping`` [1/s] are those of ``layer_damping``; an element takes
    the value at its middle. Not collective.
    """
    x = model.numbering.as_vector(model.mesh.points[:, :1])
    found = []
    for block in model.blocks:
        if block.mass is None:
            continue
        rate = layer_damping(x[block.dofs].mean(axis=1), begin, end, damping)
        inside = np.flatnonzero(rate > 0.0)
        if inside.size:
            matrices = rate[inside, None, None] * block.mass[block.kind[inside]]
            dofs = block.dofs[inside]
            found.append(Block.of_elements(block.component, dofs, damping=matrices))
    return found


# The component that lines beyond an end are in the damping: the line's.
_BEYOND = "line_beyond"


def _layers(builder: ModelBuilder) -> None:
    masts, n = builder.problem.line.support_positions, builder.problem.line.n_spans
    for end, (last, step) in zip(builder.problem.ends, ((0, 1), (n, -1)), strict=True):
        if isinstance(end, AbsorbingLayer):
            begin, outer = masts[last + step * end.n_spans], masts[last]
            for block in layer_blocks(builder.model, float(begin), float(outer), end.damping):
                builder.add_block(block)


def _going_on(laws: Simulated, problem: Problem) -> Simulated:
    start, end = (isinstance(end, Periodic) for end in problem.ends)
    return replace(laws, goes_on=(start, end))


def _lines_beyond(builder: ModelBuilder) -> None:
    # Compiled loops and transforms, which lines that do not go on need not import.
    from catenary.solver.ends import SIDES, StepSums, line_beyond, periodic_end
    from catenary.solver.model.loads import MemoryLoad

    model, problem = builder.model, builder.problem
    numerics, damping = problem.numerics, model.damping_of(_BEYOND)
    integration = integration_of(
        numerics.integrator, numerics.spectral_radius, numerics.beta, numerics.gamma
    )
    sums, ends = StepSums(numerics.dt, integration), []
    for side, goes_on in enumerate(model.simulated.goes_on):
        if goes_on:
            beyond = line_beyond(model, side, builder.held)
            builder.hold_unknowns(beyond.held)
            try:
                ends.append(periodic_end(beyond, side, damping, sums))
            except InputError as error:
                raise InputError(
                    f"line.ends.{SIDES[side]}.kind is periodic, but this line cannot go on: "
                    f"{error}, as where nothing holds a wire"
                ) from error
    for end in ends:  # once both are found, as these are no part of what goes on
        builder.add_block(
            Block.of_elements(_BEYOND, end.unknowns[None], end.mass[None], end.stiffness[None])
        )
        builder.add_load(MemoryLoad(end.unknowns, numerics.dt, steps_of(problem), end.memory))


def _has(problem: Problem, kind: type) -> bool:
    return any(isinstance(end, kind) for end in problem.ends)


register(
    Effect(
        "absorbing_layers",
        "spans at the ends that absorb waves",
        "damping on mass that grows towards the end; line.ends",
        "graded absorbing layer, b (x/l)^2 M",
        applies=lambda p: _has(p, AbsorbingLayer),
        build=_layers,
        data="line.ends with an end of kind absorbing_layer",
    ),
    Effect(
        "periodic_ends",
        "lines that go on beyond their ends",
        "stiffness, mass and memory of the periodic line beyond; line.ends",
        "Bloch waves of a span; convolution quadrature (Lubich 1988)",
        applies=lambda p: _has(p, Periodic),
        build=_lines_beyond,
        law=_going_on,
        data="line.ends with an end of kind periodic",
    ),
)
