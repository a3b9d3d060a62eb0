"""Kinds of links that no scene has yet, each an effect of a few lines and a channel of one row."""

from __future__ import annotations

import numpy as np

from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.solver.effects.effect import Effect
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.link_directions import at_nodes, at_places, difference
from catenary.solver.model.links import PULLS, PUSHES, law
from catenary.solver.time_loop.views.channels import ARM, Channel

GAP, STIFFNESS = 4e-3, 2e5  # [m], [N/m] of an uplift stop
STOPS = "uplift_stops"


def _stops(builder: ModelBuilder) -> None:
    arms = builder.mesh.steady_arms
    laws = law(builder.mesh.x(arms), STIFFNESS, acts=PULLS, gap=GAP)
    builder.add_links(STOPS, at_nodes(builder.model, arms), laws)


UPLIFT_STOP = Effect(
    "uplift_stop", "stops above the steady arms", "a link each", "test", False, build=_stops
)
STOP_FORCE = Channel(
    "further_stop_force",
    "N",
    "force of a stop of the tests",
    ARM,
    lambda now: now.link_force[STOPS],
)

# Places [m] of a stop below the contact wire, and of both ends of leaning links.
BELOW, LEANING = 17.3, ((9.1, 9.9), (39.2, 38.3))
SOFT, FALL = 3e4, 2e-4  # [N/m], [m]


def _leaning(builder: ModelBuilder) -> None:
    model = builder.model
    upper, lower = np.array(LEANING).T
    direction = difference(
        at_places(model, MESSENGER_WIRE, upper), at_places(model, CONTACT_WIRE, lower)
    )
    builder.add_links("leaning", direction, law(0.5 * (upper + lower), SOFT, acts=PULLS))
    below = np.array([BELOW])
    laws = law(below, SOFT, acts=PUSHES, gap=FALL)
    builder.add_links("prop", at_places(model, CONTACT_WIRE, below), laws)


LEANING_LINKS = Effect(
    "leaning_links",
    "links between nodes of both wires, and a prop below the contact wire",
    "a link each",
    "test",
    False,
    build=_leaning,
)
