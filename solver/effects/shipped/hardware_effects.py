"""Effects of line hardware: fittings as masses on wires, stops above steady arms."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from catenary.base.errors import InputError
from catenary.solver.effects.effect import Effect, register
from catenary.solver.effects.shipped import vertical_effects  # noqa: F401  (built before)
from catenary.solver.model.link_directions import at_nodes, at_places
from catenary.solver.model.links import PULLS, law
from catenary.solver.problem.watched_links import UPLIFT_STOPS

if TYPE_CHECKING:
    from catenary.solver.model.builder import ModelBuilder


# Lift that no wire gets to [m].
_OUT_OF_REACH = 1e3


def _fittings(builder: ModelBuilder) -> None:
    for fittings in builder.problem.line.fittings:
        place = at_places(builder.model, fittings.wire, np.array(fittings.x))
        builder.add_masses_at(fittings.wire, place, np.array(fittings.mass))


def _stops(builder: ModelBuilder) -> None:
    """Open links to the ground; an arm without a stop has one that it does not reach.

    Stops stay where they were installed, whatever has raised or lowered the wire since.
    """
    mesh, model = builder.mesh, builder.model
    gap, stiffness = np.full(mesh.steady_arms.size, _OUT_OF_REACH), np.ones(mesh.steady_arms.size)
    for number, arms in enumerate(builder.problem.line.steady_arms):
        if arms.kind.uplift_stop is not None:
            own = mesh.arm_group == number
            gap[own], stiffness[own] = arms.kind.uplift_stop, arms.kind.stop_stiffness
    if model.form is not None and model.form.arm_raised.size:
        gap -= model.form.arm_raised
        _refuse_pushed(builder, gap)
    laws = law(mesh.x(mesh.steady_arms), stiffness, acts=PULLS, gap=gap)
    builder.add_links(UPLIFT_STOPS, at_nodes(model, mesh.steady_arms), laws)


def _refuse_pushed(builder: ModelBuilder, gap: np.ndarray) -> None:
    """Refuse a line that rests on a stop: a wire that is higher than stops allow was hung wrong."""
    if (gap >= 0.0).all():
        return
    mesh, form = builder.mesh, builder.model.form
    assert form is not None
    worst = int(np.argmin(gap))
    arms = builder.problem.line.steady_arms[mesh.arm_group[worst]]
    raise InputError(
        f"line.steady_arm.uplift_stop_m is {arms.kind.uplift_stop:g} m, but the steady arm at "
        f"{mesh.x(mesh.steady_arms[worst]):g} m rests {form.arm_raised[worst]:.3f} m above its "
        "place at the installation: take a larger one, or less of what raises the wire "
        "(defects, irregularities, temperature, wind)"
    )


register(
    Effect(
        "uplift_stops",
        "stops that end the uplift at steady arms",
        "a link for each arm that pushes its wire down beyond a lift",
        "linear complementarity with a gap, one way",
        data="line.steady_arm.uplift_stop_m",
        applies=lambda p: any(arms.kind.uplift_stop is not None for arms in p.line.steady_arms),
        build=_stops,
        components=(UPLIFT_STOPS,),
        law=lambda laws, p: replace(laws, uplift_stops=True),
    ),
    Effect(
        "fittings",
        "section insulators and other fittings on the wires",
        "lumped masses at places of wires, for which droppers are cut; [[line.fittings]]",
        "consistent mass and weight at the place within its element",
        data="line.fittings",
        applies=lambda p: bool(p.line.fittings),
        build=_fittings,
    ),
)
