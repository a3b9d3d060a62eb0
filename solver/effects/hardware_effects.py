"""Effects of line hardware: insulators, splices and anchor clamps as masses on wires."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from catenary.solver.effects import vertical_effects  # noqa: F401  (built before)
from catenary.solver.effects.effect import Effect, register
from catenary.solver.model.links.links import at_places

if TYPE_CHECKING:
    from catenary.solver.model.builder import ModelBuilder


def _fittings(builder: ModelBuilder) -> None:
    for fittings in builder.problem.line.fittings:
        place = at_places(builder.model, fittings.wire, np.array(fittings.x))
        builder.add_masses_at(fittings.wire, place, np.array(fittings.mass))


register(
    Effect(
        "fittings",
        "section insulators and other fittings on the wires",
        "lumped masses at places of wires, for which droppers are cut; [[line.fittings]]",
        "consistent mass and weight at the place within its element",
        default=True,
        data="line.fittings",
        applies=lambda p: bool(p.line.fittings),
        build=_fittings,
    )
)
