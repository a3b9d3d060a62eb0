"""Whether the tables of a line fit together: topology, droppers, ends, motion along and across it.

A scene gives the tables of its topology, droppers fit into spans and between wires, the ends of a
line fit it, and a scene has what motion along and across the track needs.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from catenary.cases.scene.checks.free import check_free_places, check_free_tables, droppers_inside
from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.table import take_away
from catenary.cases.scene.line.hardware import SteadyArmTable
from catenary.cases.scene.line.imperfections import WrongTensionTable
from catenary.cases.scene.line.line import LineTable
from catenary.cases.scene.line.line_data import (
    TENSIONER,
    along_of,
    numbered,
    tables_of,
)
from catenary.cases.scene.line.wires import FreeWireTable, WireTable
from catenary.cases.scene.run.incidents import DropperBreakTable, TensionLossTable
from catenary.cases.scene.scene import Scene
from catenary.meshgen.topologies.all_topologies import FREE, make_line, registered
from catenary.meshgen.topologies.line_data import (
    SHORTEST_GAP,
    ClampedWire,
    FreeDroppers,
    LineData,
)
from catenary.meshgen.wires import SAME_PLACE, End, Wire
from catenary.solver.problem.ends import AlongTrack
from catenary.solver.problem.problem import Problem

# Keys of ``line`` that come with a part of a topology.
_WITH = {"messenger_wire": ("encumbrance_m",)}
_SIDES = ("start", "end")
_ACROSS, _ALONG = "lateral_motion", "axial_motion"
# A place is at a mast if it is nearer than this [m].
_AT_MAST = 1e-3
_ARM = "line.steady_arm"
# Weights fit a tension if they differ by a smaller share.
_FITS = 1e-6
# The last span and the one that is repeated.
_LAST = 2


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
    if line.stitch_wire is not None:
        yield from _clamped(scene, line, "stitch_wire", line.stitch_wire, "messenger_wire")
        yield from _stitch_wire(scene, line, line.stitch_wire.length)
    if line.bridle is not None:
        yield from _clamped(scene, line, "bridle", line.bridle, "contact_wire")
    yield from _auxiliary_wire(scene, line)
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


def _clamped(
    scene: Scene, line: LineData, part: str, wire: ClampedWire, bearer: str
) -> Iterator[Fault]:
    """Wires clamped to another one at supports that are none, overlap, or take all its tension."""
    shortest, whole = min(line.span_lengths), getattr(line, bearer).tension
    if line.n_spans < 2:
        why = f"a line with {part.replace('_', ' ')}s needs a support, that is two spans"
        yield scene.refused("line.n_spans", why)
    if wire.length >= shortest:
        why = f"it must be less than the shortest span ({shortest:g} m)"
        yield scene.refused(f"line.{part}.length_m", why)
    if wire.conductor.tension >= whole:
        yield scene.refused(
            f"line.{part}.tension_N",
            f"it must be less than line.{bearer}.tension_N ({whole:g} N), of which it "
            "takes its part between the clamps",
        )


def _stitch_wire(scene: Scene, line: LineData, length: float) -> Iterator[Fault]:
    """Clamps on droppers, and stitch wires from which none hangs."""
    if line.n_spans < 2:
        return
    clamps = line.around_supports(length).ravel()
    apart = _to_nearest(clamps, line.dropper_x)
    if apart.min() < SHORTEST_GAP:
        why = f"its clamp at {clamps[apart.argmin()]:g} m of the line would stand on a dropper"
        yield scene.refused("line.stitch_wire.length_m", why)
    nearest = _to_nearest(line.support_positions[1:-1], line.dropper_x).min()
    if nearest > 0.5 * length:
        why = f"no dropper would hang from it: the nearest one is {nearest:g} m from a support"
        yield scene.refused("line.stitch_wire.length_m", why)


def _to_nearest(x: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Distances (n,) of places ``x`` (n,) from the nearest of others, ascending (m,) [m]."""
    behind = np.clip(np.searchsorted(places, x), 1, places.size - 1)
    return np.minimum(abs(x - places[behind - 1]), abs(places[behind] - x))


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
    """The first group with droppers whose upper wire is expected to hang below the lower one."""
    made, rises = make_line(line), scene.line.transition.rise_m or line.overlaps is not None
    for number, group in enumerate(made.droppers):
        x = np.array(group.lower_x)
        lower = made.wire(group.lower).points(x)[:, 2]
        below = lower - made.wire(group.upper).points(np.array(group.upper_x))[:, 2]
        if not (below >= 0.0).any():
            continue
        worst = int(np.argmax(below > below.max() - SAME_PLACE))  # the first of like ones
        if line.topology == FREE:
            links = [i for i, own in enumerate(line.links or ()) if isinstance(own, FreeDroppers)]
            why = (
                f"at {x[worst]:g} m it is expected {below[worst]:.3f} m below "
                f"{group.lower}, which hangs from it: raise its height_m or its tension_N, or let "
                "the other wire hang lower"
            )
            yield scene.refused(f"line.links.{links[number]}.upper", why)
        else:
            over, under = (name.replace("_", " ") for name in (group.upper, group.lower))
            why = (
                f"the {over} would hang {below[worst]:.2f} m below the {under} in span "
                f"{np.searchsorted(line.support_positions, x[worst])}: raise it, raise "
                "line.messenger_wire.tension_N or shorten the span"
            )
            why += ", or lower the rise of the transition spans or of the overlap" if rises else ""
            yield scene.refused("line.encumbrance_m", why)
        return


def check_lateral(scene: Scene) -> Iterator[Fault]:
    """Keys of lateral motion without it."""
    line = scene.line
    given = {
        "line.messenger_stagger_m": line.messenger_stagger_m,
        "line.curve.radius_m": line.curve,
        "line.damping.lateral": line.damping.lateral,
    }
    for key, arm in tables_of(line, SteadyArmTable).items():
        for name in ("inclination_deg", "registration_stiffness_N_per_m"):
            given[f"{key}.{name}"] = getattr(arm, name)
    yield from scene.needs_effect(_ACROSS, *(key for key in given if given[key] is not None))


def check_along(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Data that motion along the track lacks, and data that only it has a use for."""
    on = scene.switches()[_ALONG]
    yield from scene.needs_effect(_ALONG, *_data_of_effect(scene))
    yield from _mid_points(scene, line)
    yield from _weights(scene, line)
    if not scene.origin.recorded:
        yield from _idle_tensioners(scene)
    if on:
        yield from _without_stiffness(scene)
        yield from _without_length(scene, line)
        yield from _loose_sections(scene, line)
        yield from _loose_wires(scene, line)
        yield from _excluded(scene)


def _data_of_effect(scene: Scene) -> list[str]:
    """Keys of a line that nothing but motion along the track reads."""
    table, recorded = scene.line, scene.origin.recorded
    found, overlap = [], table.overlap
    if overlap and "along" in overlap.model_fields_set and not recorded:
        found.append("line.overlap.along")
    found += [f"line.ends.{side}.along" for side, end in table.ends if end.along == TENSIONER]
    found += ["line.temperature.difference_K"] if table.temperature.difference_K else []
    found += ["line.mid_points_m"] if table.mid_points_m else []
    if not recorded:
        found += _ends_of_free_wires(table)
        # Without any tensioner it is idle in any case, see below.
        if not found and overlap and overlap.along == TENSIONER:
            found += [f"line.tensioner.{name}" for name in sorted(table.tensioner.model_fields_set)]
    return found


def _ends_of_free_wires(table: LineTable) -> list[str]:
    """Keys of the ends of free wires that have tensioners of their own."""
    wires = enumerate(table.wires or [])
    ends = ((f"line.wires.{i}.{side}", getattr(wire, side)) for i, wire in wires for side in _SIDES)
    return [key for key, end in ends if end == TENSIONER]


def _idle_tensioners(scene: Scene) -> Iterator[Fault]:
    """Keys of tensioners on a line that has none, and of a stop without a travel."""
    table = scene.line
    given = table.tensioner.model_fields_set
    if not given or scene.effects.get("tensioners") is False:
        return
    ends = [end.along for _, end in table.ends]
    ends += [] if table.overlap is None else [table.overlap.along]
    if TENSIONER not in ends and not _ends_of_free_wires(table):
        yield scene.fault(
            "line.tensioner",
            f"has {', '.join(sorted(given))}, but no wire ends at a "
            "tensioner: line.ends.start.along or line.ends.end.along must be tensioner"
            + (", or start or end of a wire of line.wires" if table.wires else ""),
        )
    elif "stop_stiffness_N_per_m" in given and table.tensioner.travel_m is None:
        why = "it acts only with line.tensioner.travel_m, where the stop stands"
        yield scene.refused("line.tensioner.stop_stiffness_N_per_m", why)


def _without_stiffness(scene: Scene) -> Iterator[Fault]:
    for key, wire in tables_of(scene.line, WireTable).items():
        if wire.stiffness_along() is None:
            field = LineTable.model_fields.get(key.removeprefix("line."))
            what = wire.name if isinstance(wire, FreeWireTable) else field and field.description
            yield Fault(
                f"{key}.axial_stiffness_N",
                f"effects.{_ALONG} is on, but {key} ({what}) {scene.origin.of(key)} has no "
                "axial stiffness; give it axial_stiffness_N, or section_mm2 and youngs_modulus_GPa",
            )


def _without_length(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Arms without a length, along which nothing could swing."""
    made = make_line(line)
    keys = {
        getattr(table, "name", ""): key
        for key, table in tables_of(scene.line, SteadyArmTable).items()
    }
    for arms in made.steady_arms:
        if arms.kind.length == 0 and made.wire(arms.wire).radial_force(np.array(arms.x)).any():
            yield scene.refused(
                f"{keys.get(arms.name, _ARM)}.length_m",
                f"effects.{_ALONG} is on, and an arm that carries the radial force of its wire's "
                "stagger swings about its hinge: it must be greater than 0",
            )
            return


def _loose_sections(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Sections with a tensioner at both ends and nothing in between that holds their wires."""
    along, sections = along_of(scene.line), [section.ends for section in line.sections]
    between = len(sections) - 1
    tensioned = [along.start, *[along.overlap] * between, along.end]
    keys = [*["line.overlap.along"] * between, "line.ends.end.along"]
    for (start, end), both, key in zip(sections, pairwise(tensioned), keys, strict=True):
        if all(both) and not any(start < x < end for x in along.mid_points):
            yield scene.refused(
                key,
                f"the wires from {start:g} to {end:g} m would have tensioners at both ends and "
                "nothing to hold them in between: name a mast there in line.mid_points_m, or hold "
                "one end (fixed)",
            )


def _loose_wires(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Free wires with tensioners of their own at both ends and nothing in between."""
    along = along_of(scene.line)
    of_line = {"start": along.start, "end": along.end}
    for i, wire in enumerate(line.wires or ()):
        sides = zip(_SIDES, wire.tensioned, wire.clamped_to, strict=True)
        both = [(of_line[side] if own is None else own) and not on for side, own, on in sides]
        if not all(both) or wire.tensioned == (None, None):
            continue
        for start, end in wire.stretches:
            if not any(start < x < end for x in along.mid_points):
                why = (
                    f"it would have tensioners at both ends from {start:g} to {end:g} m and "
                    "nothing to hold it in between: name a mast there in line.mid_points_m, or "
                    "hold one end (fixed)"
                )
                key = f"line.wires.{i}.{'start' if wire.tensioned[0] else 'end'}"
                yield scene.refused(key, why)
                break


def _mid_points(scene: Scene, line: LineData) -> Iterator[Fault]:
    masts = line.support_positions[1:-1]
    for i, x in enumerate(scene.line.mid_points_m):
        if masts.size == 0 or np.abs(masts - x).min() > _AT_MAST:
            near = f", such as {masts[np.abs(masts - x).argmin()]:g} m" if masts.size else ""
            why = f"a mid-point anchor stands at a mast between two spans{near}"
            yield scene.refused(f"line.mid_points_m.{i}", why)
        elif any(abs(x - other) < _AT_MAST for other in scene.line.mid_points_m[:i]):
            yield scene.refused(f"line.mid_points_m.{i}", "it is listed twice; take one away")


def _weights(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Weights of wires that are none, or whose wheel would turn at rest."""
    along = along_of(scene.line)
    tensioner = along.tensioner
    if not tensioner.weights:
        return
    wrong = {
        defect.wire: defect.factor
        for defect in scene.defects
        if isinstance(defect, WrongTensionTable) and scene.switches()["wrong_tension"]
    }
    wires = {wire.name: wire for wire in make_line(line).with_shares(wrong).wires}
    tensioned = [name for name, wire in wires.items() if _has_tensioner(wire, along, line)]
    for name in tensioner.weights:
        key = f"line.tensioner.weights_kg.{name}"
        if name not in wires:
            yield scene.refused(key, f"the line has {', '.join(wires)}")
            continue
        if tensioned and name not in tensioned and not scene.origin.recorded:
            why = f"no end of this wire has a tensioner, only those of {', '.join(tensioned)}"
            yield scene.refused(key, why + take_away())
            continue
        tension = wires[name].tension
        low, high = tensioner.band(name, wires[name], Problem.gravity)
        if not low * (1 - _FITS) <= tension <= high * (1 + _FITS):
            fits = tension / (tensioner.ratio * Problem.gravity)
            holds = f"{low:g} N" if low == high else f"{low:g} to {high:g} N"
            yield scene.refused(
                key,
                f"it would hold {holds} by line.tensioner.ratio and efficiency, but "
                f"the wire has {tension:g} N, which {fits:.6g} kg hold",
            )


def _has_tensioner(wire: Wire, along: AlongTrack, line: LineData) -> bool:
    line_ends = float(line.support_positions[0]), float(line.support_positions[-1])
    return any(
        along.tensioned(float(x), line_ends, _AT_MAST) if own is None else own
        for piece in wire.pieces
        for x, kind, own in zip((piece.x[0], piece.x[-1]), piece.ends, piece.tensioned, strict=True)
        if kind is not End.CLAMPED
    )


def _excluded(scene: Scene) -> Iterator[Fault]:
    """Ends and windows that exclude motion along the track."""
    for side, end in scene.line.ends:
        if end.kind == "periodic":
            yield scene.refused(
                f"line.ends.{side}.kind",
                f"with effects.{_ALONG} a line ends fixed or in an absorbing_layer: waves along "
                "the track would go on beyond the end for ever",
            )
    if scene.window.mode == "bounded" and scene.window.tolerance is None:
        yield scene.refused(
            "window.mode",
            f"with effects.{_ALONG} waves along the track run far ahead of a window of some "
            "spans; take exact, or off",
        )


def check_ends(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Ends that cannot be."""
    yield from _layers(scene, line)
    for side, end in scene.line.ends:
        if end.kind == "periodic":
            yield from _goes_on(scene, line, side)


def _goes_on(scene: Scene, line: LineData, side: str) -> Iterator[Fault]:
    """Lines that cannot go on beyond an end as they are there."""
    key = f"line.ends.{side}.kind"

    def refused(why: str) -> Fault:
        return scene.refused(key, why)

    numerics, n = scene.numerics, line.n_spans
    if numerics.adaptive_tolerance_N is not None:
        yield refused(
            "it remembers steps of one size, so that numerics.adaptive_tolerance_N must not be "
            "given"
        )
    n_rising = line.n_transition[0 if side == "start" else 1]
    if n_rising:
        yield refused(
            "the line goes on with spans at running height, so that "
            f"line.transition.n_spans_{side} must be 0, not {n_rising}"
        )
        return
    if n <= _LAST:
        yield refused(f"it needs {_LAST + 1} spans (line.n_spans) at least, not {n}")
        return
    lengths = line.span_lengths[:_LAST] if side == "start" else line.span_lengths[-_LAST:]
    if abs(lengths[0] - lengths[1]) > SAME_PLACE:
        yield refused(
            f"the two spans there must have one length (line.span_m), not {lengths[0]:g} and "
            f"{lengths[1]:g} m"
        )
    switches = scene.switches()
    for i, table in enumerate(scene.incidents):
        if not switches.get(table.type, True):
            continue
        if isinstance(table, TensionLossTable):
            yield refused(f"a line beyond does not lose tension, which incidents.{i} lets wires do")
        elif isinstance(table, DropperBreakTable):
            near = table.span <= _LAST if side == "start" else table.span > n - _LAST
            if near:
                yield refused(
                    f"the line goes on with what the two spans there are, of which incidents.{i} "
                    f"breaks a dropper (span {table.span})"
                )


def _layers(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Layers that are longer than the line, or reach into what is judged."""
    masts, n = line.support_positions, line.n_spans
    stretch = scene.evaluation
    for side, end in scene.line.ends:
        if end.spans is None:
            continue
        key = f"line.ends.{side}.spans"
        if end.spans >= n:
            yield scene.refused(key, f"the line has {n} spans (line.n_spans) with it")
            continue
        inner = float(masts[end.spans] if side == "start" else masts[n - end.spans])
        reaches = stretch.from_m < inner if side == "start" else stretch.to_m > inner
        if reaches:
            given = (
                f"evaluation.from_m = {stretch.from_m:g}"
                if side == "start"
                else f"evaluation.to_m = {stretch.to_m:g}"
            )
            yield scene.refused(
                key,
                f"the absorbing layer reaches to {inner:g} m, into the evaluated stretch "
                f"({given}); give the line more spans (line.n_spans) or the layer fewer",
            )
