"""What the scheme ts_alpha2, a second opinion on plain scenes, does not know."""

from __future__ import annotations

from typing import TYPE_CHECKING

from catenary.cases.messages import refuse
from catenary.cases.schema_pantograph import LumpedTable

if TYPE_CHECKING:
    from catenary.cases.scene import Scene


def check_scheme(scene: Scene) -> None:
    """Raise ``InputError`` with the first thing in a scene that its scheme cannot simulate.

    The names of its pantographs must be known.
    """
    if scene.numerics.scheme != "ts_alpha2":
        return
    knows = "numerics.scheme ts_alpha2 knows only"
    if scene.contact.law != "linear":
        refuse(scene.origin, "contact.law", scene.contact.law, f"{knows} law linear")
    switches = scene.switches()
    for i, incident in enumerate(scene.incidents):
        if switches[incident.type]:
            why = f"{knows} lines and pantographs that stay what they are"
            refuse(scene.origin, f"incidents.{i}.type", incident.type, why)
    for name in ("head_roll", "vehicle_motion"):
        if switches[name]:
            refuse(
                scene.origin,
                f"effects.{name}",
                True,
                f"{knows} heads and bases that move along a vertical: switch it off",
            )
    for name in {place.name: None for place in scene.train.pantographs}:
        table = scene.pantographs[name]
        if not isinstance(table, LumpedTable):
            refuse(scene.origin, f"pantographs.{name}.type", table.type, f"{knows} type lumped")
        key = f"pantographs.{name}.strips"
        if table.strips.number != 1:
            refuse(scene.origin, f"{key}.number", table.strips.number, f"{knows} one strip")
        if table.strips.stiffness_N_per_m is not None:
            value = table.strips.stiffness_N_per_m
            refuse(
                scene.origin,
                f"{key}.stiffness_N_per_m",
                value,
                f"{knows} strips that are fixed to the head",
            )
