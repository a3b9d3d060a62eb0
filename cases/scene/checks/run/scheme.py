"""What the scheme ts_alpha2 does not support; it is an independent check of plain scenes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.cases.scene.tables.train.pantograph import LumpedTable

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene


def check_scheme(scene: Scene) -> Iterator[Fault]:
    """What a scene's scheme cannot simulate.

    The names of its pantographs must be known.
    """
    if scene.numerics.scheme != "ts_alpha2":
        return
    knows = "numerics.scheme ts_alpha2 knows only"
    if scene.contact.law != "linear":
        yield refusal(scene.origin, "contact.law", scene.contact.law, f"{knows} law linear")
    for key in ("twin", "overlap"):
        if getattr(scene.line, key) is not None:
            why = f"{knows} one contact wire: take one_solve or fixed_point"
            yield Fault(f"line.{key}", f"line.{key} {scene.origin.of(f'line.{key}')}; {why}")
    switches = scene.switches()
    for i, incident in enumerate(scene.incidents):
        if switches[incident.type]:
            why = f"{knows} lines and pantographs that stay what they are"
            yield refusal(scene.origin, f"incidents.{i}.type", incident.type, why)
    for i, defect in enumerate(scene.defects):
        if defect.type == "kink" and switches["kink"]:
            yield refusal(scene.origin, f"defects.{i}.type", defect.type, f"{knows} smooth wires")
    if scene.irregularities.running_surface is not None and switches["running_surface"]:
        key = "irregularities.running_surface"
        why = f"{knows} smooth wires: write effects.running_surface = false"
        yield Fault(key, f"{key} {scene.origin.of(key)} is not smooth; {why}")
    for name in ("head_roll", "vehicle_motion"):
        if switches[name]:
            yield refusal(
                scene.origin,
                f"effects.{name}",
                True,
                f"{knows} heads and bases that move along a vertical: switch it off",
            )
    for name in {place.name: None for place in scene.train.pantographs}:
        table = scene.pantographs[name]
        if not isinstance(table, LumpedTable):
            key = f"pantographs.{name}.type"
            yield refusal(scene.origin, key, table.type, f"{knows} type lumped")
            continue
        switches_of = {"laws": "pantograph_laws", "regulation": "regulated_lift"}
        for part, effect in switches_of.items():
            if getattr(table, part) and switches[effect]:
                key = f"pantographs.{name}.{part}"
                why = f"{knows} linear pantographs: write effects.{effect} = false"
                yield Fault(key, f"{key} {scene.origin.of(key)} is not linear; {why}")
        key = f"pantographs.{name}.strips"
        if table.strips.number != 1:
            yield refusal(scene.origin, f"{key}.number", table.strips.number, f"{knows} one strip")
        if table.strips.stiffness_N_per_m is not None:
            value = table.strips.stiffness_N_per_m
            yield refusal(
                scene.origin,
                f"{key}.stiffness_N_per_m",
                value,
                f"{knows} strips that are fixed to the head",
            )
