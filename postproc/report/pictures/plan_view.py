"""The line at rest seen from above: lateral places of the contact wires, forces of steady arms."""

from __future__ import annotations

from typing import TYPE_CHECKING

from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures.figures import (
    COLOURS,
    GREY,
    colour,
    legend_above,
    own_style,
    stacked,
    tidy,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@own_style()
def plan_view(results: Results) -> Figure | None:
    """Where contact wires are laterally, and radial forces of arms; None where no wire moves so."""
    registration = results.registration()
    if registration is None or not results.has_static("contact_y"):
        return None
    figure, (plan, forces) = stacked(5.2, 2)
    profiles = results.contact_profiles()
    for number, (name, wire) in enumerate(profiles.items()):
        assert wire.y is not None
        label = "contact wire" if len(profiles) == 1 else name
        plan.plot(*wire.drawn(wire.y), color=colour(number), linewidth=1.2, label=label)
    plan.plot(registration.x, registration.stagger, "o", ms=3, color=GREY, label="steady arm")
    plan.axhline(0.0, color=GREY, linewidth=0.6, linestyle="--")
    tidy(plan, "position along the track [m]", "to the left [m]", "Contact wire from above")
    legend_above(plan)
    pushed = registration.pushed
    for which, look, label in (
        (~pushed, "o", "arm that pulls"),
        (pushed, "v", "arm that its wire pushes"),
    ):
        if which.any():
            tone = COLOURS[0] if look == "o" else COLOURS[1]
            at, force = registration.x[which], registration.force[which, 0]
            forces.plot(at, force, look, ms=4, color=tone, label=label)
    forces.axhline(0.0, color=GREY, linewidth=0.8)
    tidy(
        forces,
        "position along the track [m]",
        "force to the left [N]",
        "Radial forces of the steady arms",
    )
    legend_above(forces)
    forces.set_xlim(plan.get_xlim())
    return figure
