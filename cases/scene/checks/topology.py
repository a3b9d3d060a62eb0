"""Whether a scene gives its topology's tables, and droppers fit into spans and between wires."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from catenary.cases.scene.checks.free import check_free_places, check_free_tables, droppers_inside
from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.line.line import LineTable
from catenary.cases.scene.line.line_data import numbered
from catenary.cases.scene.run.incidents import TensionLossTable
from catenary.cases.scene.scene import Scene
from catenary.meshgen.geometry import find_cuts
from catenary.meshgen.topologies.all_topologies import FREE, make_line, registered
from catenary.meshgen.topologies.line_data import SHORTEST_GAP, FreeDroppers, LineData

# Keys of ``line`` that come with a part of a topology.
_WITH = {"messenger_wire": ("encumbrance_m",)}


def check_topology(scene: Scene) -> Iterator[Fault]:
    """An unknown topology, tables that it lacks, and tables that it has no use for."""
    table, known = scene.line, registered()
    if table.topology not in known:
        yield from scene.among("line.topology", known)
        return
    needed = _keys(known[table.topology].parts)
    for name in needed:
        if getattr(table, name) is None:
            meaning = LineTable.model_fields[name].description
            yield scene.missing(f"line.{name}", meaning or "")
    takes = {name: {**_keys(entry.parts), **_keys(entry.may)} for name, entry in known.items()}
    every = {name for keys in takes.values() for name in keys}
    for name in sorted(every - takes[table.topology].keys()):
        if getattr(table, name) is not None:
            users = " or ".join(one for one, keys in takes.items() if name in keys)
            why = f"is no part of the topology {table.topology}; leave it out, or take"
            yield scene.fault(f"line.{name}", f"{why} line.topology = {users}")
    if table.topology == FREE and table.wires is not None and table.links is not None:
        yield from check_free_tables(scene)


def _keys(parts: tuple[str, ...]) -> dict[str, None]:
    """Keys of ``line`` that parts of a topology come from, in order."""
    return dict.fromkeys(key for part in parts for key in (part, *_WITH.get(part, ())))


def check_parts(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Parts of a topology that do not fit to each other."""
    if line.wires is not None:
        yield from check_free_places(scene, line)
        return
    yield from _stitch_wire(scene, line)
    yield from _auxiliary_wire(scene, line)
    yield from _bridle(scene, line)
    yield from _overlap(scene, line)


def check_names(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Names of wires in other tables: incidents, defects, fittings."""
    wires = tuple(wire.name for wire in make_line(line).wires)
    for i, table in enumerate(scene.incidents):
        if isinstance(table, TensionLossTable):
            yield from scene.among(f"incidents.{i}.wire", wires, "the line has")
    for where, entries in (("defects", scene.defects), ("line.fittings", scene.line.fittings)):
        for i, entry in enumerate(entries):
            if hasattr(entry, "wire"):
                yield from scene.among(f"{where}.{i}.wire", wires, "the line has")


def _stitch_wire(scene: Scene, line: LineData) -> Iterator[Fault]:
    stitch, messenger = line.stitch_wire, line.messenger_wire
    if stitch is None or messenger is None:
        return
    key, tension = "line.stitch_wire.length_m", stitch.conductor.tension
    if line.n_spans < 2:
        yield scene.refused("line.n_spans", "a stitched line needs a support, that is two spans")
        return
    yield from _length(scene, line, key, stitch.length)
    clamps = line.around_supports(stitch.length).ravel()
    apart = _to_nearest(clamps, line.dropper_x)
    if apart.min() < SHORTEST_GAP:
        why = f"its clamp at {clamps[apart.argmin()]:g} m of the line would stand on a dropper"
        yield scene.refused(key, why)
    nearest = _to_nearest(line.support_positions[1:-1], line.dropper_x).min()
    if nearest > 0.5 * stitch.length:
        why = f"no dropper would hang from it: the nearest one is {nearest:g} m from a support"
        yield scene.refused(key, why)
    yield from _tension(scene, "stitch_wire", tension, "messenger_wire", messenger.tension)


def _to_nearest(x: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Distances (n,) of places ``x`` (n,) from the nearest of others, ascending (m,) [m]."""
    behind = np.clip(np.searchsorted(places, x), 1, places.size - 1)
    return np.minimum(abs(x - places[behind - 1]), abs(places[behind] - x))


def _bridle(scene: Scene, line: LineData) -> Iterator[Fault]:
    if line.bridle is not None:
        yield from _length(scene, line, "line.bridle.length_m", line.bridle.length)
        tensions = line.bridle.conductor.tension, line.contact_wire.tension
        yield from _tension(scene, "bridle", tensions[0], "contact_wire", tensions[1])


def _length(scene: Scene, line: LineData, key: str, length: float) -> Iterator[Fault]:
    shortest = min(line.span_lengths)
    if length >= shortest:
        yield scene.refused(key, f"it must be less than the shortest span ({shortest:g} m)")


def _tension(scene: Scene, wire: str, tension: float, bearer: str, whole: float) -> Iterator[Fault]:
    """A wire between clamps that would take all tension of the one that it is clamped to."""
    if tension >= whole:
        yield scene.refused(
            f"line.{wire}.tension_N",
            f"it must be less than line.{bearer}.tension_N ({whole:g} N), of which it takes its "
            "part between the clamps",
        )


def _auxiliary_wire(scene: Scene, line: LineData) -> Iterator[Fault]:
    auxiliary = line.auxiliary_wire
    if auxiliary is not None and auxiliary.height >= line.encumbrance:
        yield scene.refused(
            "line.auxiliary_wire.height_m",
            f"it must be less than line.encumbrance_m ({line.encumbrance:g} m)",
        )


def _overlap(scene: Scene, line: LineData) -> Iterator[Fault]:
    overlaps, table = line.overlaps, scene.line.overlap
    if overlaps is None or table is None:
        return
    needs = f"an overlap of {overlaps.n_spans} spans needs a running span before it and behind it"
    first, last = line.n_transition[0] + 2, line.n_spans - line.n_transition[1] - overlaps.n_spans
    for i, number in enumerate(table.first_span):
        if not first <= number <= last:
            inside = (
                f"from {first} to {last}" if first <= last else "none, as the line is too short"
            )
            key = "line.overlap.first_span" + (f".{i}" if len(table.first_span) > 1 else "")
            yield scene.refused(key, f"{needs}: possible are {inside}", value=number)
        first = number + overlaps.n_spans + 1
    every = table.repeat_every_spans
    if every is not None and every <= overlaps.n_spans:
        yield scene.refused(
            "line.overlap.repeat_every_spans",
            f"{needs}: it must be at least {overlaps.n_spans + 1}",
        )
    free = line.encumbrance - (line.auxiliary_wire.height if line.auxiliary_wire else 0.0)
    if line.messenger_wire is not None and overlaps.rise >= free:
        yield scene.refused(
            "line.overlap.rise_m",
            f"it must be less than the {free:g} m that the messenger wire is above at the supports",
        )


def check_droppers_inside_spans(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Find the first span of each group whose droppers are outside or too close together."""
    table, spans = scene.line, numbered(line.span_lengths)
    if table.dropper is not None:
        yield from droppers_inside(scene, "line.dropper", table.dropper, spans)
    if line.auxiliary_wire is not None and table.auxiliary_wire is not None:
        key, hung = "line.auxiliary_wire.dropper", table.auxiliary_wire.dropper
        yield from droppers_inside(scene, key, hung, spans)


def check_dropper_lengths(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Droppers whose upper wire is expected to hang below the lower one."""
    made = make_line(line)
    for number, group in enumerate(made.droppers):
        x = np.array(group.lower_x)
        upper, lower = (made.wire(name).points(x)[:, 2] for name in (group.upper, group.lower))
        worst = int(np.argmin(upper - lower)) if x.size else 0
        if x.size == 0 or upper[worst] > lower[worst]:
            continue
        below = lower[worst] - upper[worst]
        if line.links is not None:
            links = [i for i, own in enumerate(line.links) if isinstance(own, FreeDroppers)]
            why = (
                f"at {x[worst]:g} m it is expected {below:.3f} m below "
                f"{group.lower}, which hangs from it: raise its height_m or its tension_N, or let "
                "the other wire hang lower"
            )
            yield scene.refused(f"line.links.{links[number]}.upper", why)
        elif line.overlaps is not None:
            find_cuts(made)  # says so
        else:
            over, under = (name.replace("_", " ") for name in (group.upper, group.lower))
            why = (
                f"the {over} would hang {below:.2f} m below the {under} in span "
                f"{np.searchsorted(line.support_positions, x[worst])}: raise it, raise "
                "line.messenger_wire.tension_N or shorten the span"
            )
            yield scene.refused("line.encumbrance_m", why)
        return
