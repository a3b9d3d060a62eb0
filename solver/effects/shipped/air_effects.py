"""Effects of the air: what it does to pantographs and to wires."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from catenary.solver.effects.effect import Effect, register
from catenary.solver.effects.shipped import vertical_effects  # noqa: F401  (built before)
from catenary.solver.problem.problem import Problem, Simulated

if TYPE_CHECKING:
    from catenary.solver.model.builder import ModelBuilder


def _steady(laws: Simulated, problem: Problem) -> Simulated:
    assert problem.wind is not None  # the effect applies
    return replace(laws, wind=problem.wind.with_gusts(None))


def _damped(builder: ModelBuilder) -> None:
    from catenary.solver.wind import damping_blocks

    wind = builder.model.simulated.wind
    assert wind is not None
    for block in damping_blocks(builder.model, wind):
        builder.add_block(block)


def _gusts(builder: ModelBuilder) -> None:
    from catenary.solver.wind import gust_loads

    wind = builder.model.simulated.wind
    assert wind is not None
    for load in gust_loads(builder.model, wind):
        builder.add_load(load)


register(
    Effect(
        "pantograph_aerodynamics",
        "aerodynamic forces on the pantographs",
        "uplift of head and frame by the air's speed, drag on bodies of a mechanism, tunnels",
        "uplift by speed as measured; forces with the square of the speed",
        applies=lambda p: any(place.data.meets_air for place in p.train.placements),
        law=lambda laws, p: replace(laws, meets_air=True),
        data="a table [pantographs.*.aerodynamics] or a force of type aerodynamic_force",
    ),
    Effect(
        "wind",
        "mean wind on wires and pantographs",
        "drag of the wires at rest, aerodynamic damping of their motion, air at the pantographs",
        "1/2 rho d C_d |q| q, linear in the motion (Dyrbye, Hansen: Wind Loads on Structures)",
        applies=lambda p: p.wind is not None,
        build=_damped,
        law=_steady,
        data="a table [wind] with a speed above 0",
        after_cutting=True,
    ),
    Effect(
        "gusts",
        "gusts on wires and pantographs",
        "loads of a random field along the line, which is coherent in space",
        "spectra of Davenport, von Karman, Panofsky, Kaimal; coherence exp(-C n d / U)",
        requires=("wind",),
        applies=lambda p: p.wind is not None and p.wind.gusts is not None,
        build=_gusts,
        law=lambda laws, p: replace(laws, wind=p.wind),
        data="a table [wind.gusts] in a wind above 0",
        after_cutting=True,
    ),
)
