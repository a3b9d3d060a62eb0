"""Whether a scene gives the tables that its line's topology is made of, and no others."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from typing import TYPE_CHECKING

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.cases.scene.tables.line import LineTable
from catenary.meshgen.topologies.all_topologies import registered
from catenary.meshgen.topologies.line_data import SHORTEST_GAP, LineData

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

# Keys of ``line`` that come with a part of a topology.
_WITH = {"messenger_wire": ("encumbrance_m",)}


def check_topology(scene: Scene) -> Iterator[Fault]:
    """An unknown topology, tables that it lacks, and tables that it has no use for."""
    table, known = scene.line, registered()
    if table.topology not in known:
        near = difflib.get_close_matches(table.topology, known, n=1)
        hint = f"did you mean {near[0]}?" if near else f"it must be one of {', '.join(known)}"
        yield refusal(scene.origin, "line.topology", table.topology, hint)
        return
    needed = _keys(known[table.topology].parts)
    for name in needed:
        if getattr(table, name) is None:
            key = f"line.{name}"
            meaning = LineTable.model_fields[name].description
            yield Fault(key, f"{key} ({meaning}) is missing {scene.origin.of(key)}")
    every = {name for one in known.values() for name in _keys(one.parts)}
    for name in sorted(every - needed.keys()):
        if getattr(table, name) is not None:
            key = f"line.{name}"
            users = [one for one, entry in known.items() if name in _keys(entry.parts)]
            yield Fault(
                key,
                f"{key} {scene.origin.of(key)} is no part of the topology {table.topology}; leave "
                f"it out, or take line.topology = {' or '.join(users)}",
            )


def _keys(parts: tuple[str, ...]) -> dict[str, None]:
    """Keys of ``line`` that parts of a topology come from, in order."""
    return dict.fromkeys(key for part in parts for key in (part, *_WITH.get(part, ())))


def check_parts(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Parts of a topology that do not fit to each other."""
    yield from _stitch_wire(scene, line)
    yield from _auxiliary_wire(scene, line)


def _stitch_wire(scene: Scene, line: LineData) -> Iterator[Fault]:
    stitch, messenger = line.stitch_wire, line.messenger_wire
    if stitch is None or messenger is None:
        return
    key, shortest = "line.stitch_wire.length_m", min(line.span_lengths)
    if line.n_spans < 2:
        why = "a stitched line needs a support, that is two spans"
        yield refusal(scene.origin, "line.n_spans", line.n_spans, why)
        return
    if stitch.length >= shortest:
        why = f"it must be less than the shortest span ({shortest:g} m)"
        yield refusal(scene.origin, key, stitch.length, why)
        return
    clamps = line.stitch_clamps
    apart = abs(line.dropper_x[:, None] - clamps)
    if apart.min() < SHORTEST_GAP:
        at = clamps[apart.min(axis=0).argmin()]
        why = f"its clamp at {at:g} m of the line would stand on a dropper"
        yield refusal(scene.origin, key, stitch.length, why)
    nearest = abs(line.dropper_x[:, None] - line.support_positions[1:-1]).min()
    if nearest > 0.5 * stitch.length:
        why = f"no dropper would hang from it: the nearest one is {nearest:g} m from a support"
        yield refusal(scene.origin, key, stitch.length, why)
    if stitch.conductor.tension >= messenger.tension:
        yield refusal(
            scene.origin,
            "line.stitch_wire.tension_N",
            stitch.conductor.tension,
            f"it must be less than line.messenger_wire.tension_N ({messenger.tension:g} N), of "
            "which it takes its part between the clamps",
        )


def _auxiliary_wire(scene: Scene, line: LineData) -> Iterator[Fault]:
    auxiliary = line.auxiliary_wire
    if auxiliary is not None and auxiliary.height >= line.encumbrance:
        yield refusal(
            scene.origin,
            "line.auxiliary_wire.height_m",
            auxiliary.height,
            f"it must be less than line.encumbrance_m ({line.encumbrance:g} m)",
        )
