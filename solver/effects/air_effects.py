"""Effects of the air: what it does to pantographs."""

from __future__ import annotations

from dataclasses import replace

from catenary.solver.effects import vertical_effects  # noqa: F401  (built before)
from catenary.solver.effects.effect import Effect, register

register(
    Effect(
        "pantograph_aerodynamics",
        "aerodynamic forces on the pantographs",
        "uplift of head and frame by the air's speed, drag on bodies of a mechanism, tunnels",
        "uplift by speed as measured; forces with the square of the speed",
        default=True,
        applies=lambda p: any(place.data.meets_air for place in p.train.placements),
        law=lambda laws, p: replace(laws, meets_air=True),
        data="a table [pantographs.*.aerodynamics] or a force of type aerodynamic_force",
    )
)
