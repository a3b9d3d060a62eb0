"""Gauges at the ends of wires and at mid-point anchors: tension, place of the end, stops.

What a gauge shows is linear in the displacements: it is a link that is watched and has no force.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.meshgen.wires import SAME_PLACE, End
from catenary.solver.kernels import native
from catenary.solver.model import axial_motion
from catenary.solver.model.model import Model
from catenary.solver.model.switching_links import RESERVE
from catenary.solver.problem.ends import Tensioner
from catenary.solver.problem.problem import Problem
from catenary.solver.problem.watched_links import (
    GAUGES,
    HIGH_STOP,
    LOW_STOP,
    TENSION,
    TRAVEL,
    WEIGHT,
)


class GaugePlace(NamedTuple):
    """Place of a gauge: number of its wire in the line, place [m], and on which side of the wire:
    -1 where the wire begins there, 1 where it ends there."""

    wire: int
    x: float
    outwards: int


def gauge_places(problem: Problem, moves: bool) -> tuple[GaugePlace, ...]:
    """Ends of wires that no clamp carries, and both sides of mid-points, by ascending place; none
    unless the line ``moves`` along the track."""
    if not moves:
        return ()
    found = []
    for number, wire in enumerate(problem.line.wires):
        for piece in wire.pieces:
            for end, outwards in ((0, -1), (-1, 1)):
                if piece.ends[end] is not End.CLAMPED:
                    found.append(GaugePlace(number, piece.x[end], outwards))
            if wire.pieces[0].ends[0] is not End.CLAMPED:
                inside = [x for x in problem.along.mid_points if piece.x[0] < x < piece.x[-1]]
                found += [GaugePlace(number, x, side) for x in inside for side in (1, -1)]
    return tuple(sorted(found, key=lambda place: place.x))


class Gauges(NamedTuple):
    """Gauges of a line: their places, and for each of ``GAUGES`` what is watched, (n,) links of all
    unknowns of the line."""

    places: tuple[GaugePlace, ...]
    watched: dict[str, native.Links]


def gauges_of(model: Model) -> Gauges:
    """The gauges of a line about its shape at rest, empty without motion along the track."""
    places = gauge_places(model.problem, "u" in model.unknowns)
    if not places:
        return Gauges((), {})
    ends = {(end.wire, end.node): end for end in axial_motion.ends_of(model)}
    tensioner = model.simulated.tensioner
    width = 10 if model.simulated.lateral else 6
    watched = {
        name: native.Links(
            np.zeros((len(places), width), dtype=np.int64),
            np.zeros((len(places), width)),
            np.zeros(len(places), dtype=RESERVE),
        )
        for name in GAUGES
    }
    for i, place in enumerate(places):
        wire = model.problem.line.wires[place.wire]
        element, node = _element_at(model, wire.name, place)
        _watch_tension(model, watched, i, place, element)
        end = ends.get((wire.name, node))
        if end is None:
            continue
        outwards = np.zeros(width)
        outwards[0 if place.outwards < 0 else 1] = place.outwards
        moved = _moved(model, node) * place.outwards
        watched[TRAVEL].weights[i] = outwards
        watched[TRAVEL].law["stiffness"][i], watched[TRAVEL].law["rest"][i] = 1.0, moved
        if end.tensioned and tensioner is not None:
            watched[WEIGHT].weights[i] = tensioner.ratio * outwards
            watched[WEIGHT].law["stiffness"][i] = 1.0
            watched[WEIGHT].law["rest"][i] = tensioner.ratio * moved
            _watch_stops(model, watched, i, end, tensioner, outwards, moved)
    return Gauges(places, watched)


def _watch_tension(
    model: Model, watched: dict[str, native.Links], i: int, place: GaugePlace, element: int
) -> None:
    """Watch the tension of an ``element`` by gauge ``i``; all that it watches has its unknowns."""
    wire = model.problem.line.wires[place.wire]
    unknowns = axial_motion.unknowns_along(model, wire.name)[element]
    for table in watched.values():
        _row(table, i, unknowns, place)
    assert wire.axial_stiffness is not None
    left, _ = wire.left_of(model.mesh.x(model.mesh.elements(wire.name)[element])[None])
    tension = watched[TENSION]
    tension.weights[i] = axial_motion.strain_rows(model, wire.name)[element]
    tension.law["stiffness"][i] = wire.axial_stiffness * left[0]
    tension.law["rest"][i] = model.tension_of(wire.name)[element]


def _watch_stops(
    model: Model,
    watched: dict[str, native.Links],
    i: int,
    end: axial_motion.WireEnd,
    tensioner: Tensioner,
    outwards: np.ndarray,
    moved: float,
) -> None:
    """Watch the stops of a tensioner by gauge ``i``, if its travel has limits.

    ``outwards`` (m,) are the weights of the end's travel, which is ``moved`` [m] at rest.
    """
    if tensioner.travel is None:
        return
    if not axial_motion.at_stop(model, end):
        for name, sign in ((LOW_STOP, 1.0), (HIGH_STOP, -1.0)):
            gap = max(tensioner.travel - sign * moved, 0.0)
            _open(watched[name], i, sign * outwards, gap, tensioner.stop_stiffness)
        return
    # The stop bears the difference of the weights' pull and the tension at rest.
    wire, tension = model.problem.line.wire(end.wire), watched[TENSION]
    low, high = tensioner.band(wire.name, wire, model.problem.gravity)
    name, sign, pull = (LOW_STOP, -1.0, low) if moved > 0.0 else (HIGH_STOP, 1.0, high)
    stop = watched[name]
    stop.weights[i] = tension.weights[i]
    stop.law["stiffness"][i] = sign * tension.law["stiffness"][i]
    stop.law["rest"][i] = sign * (tension.law["rest"][i] - pull)


def _open(table: native.Links, i: int, weights: np.ndarray, gap: float, stiffness: float) -> None:
    """Watch a stop that is ``gap`` [m] away at rest: its force is what its reserve lacks."""
    table.weights[i], law = weights, table.law
    law["rest"][i], law["stiffness"][i] = stiffness * gap, -stiffness
    law["carried"][i], law["released"][i] = 0.0, 1.0


def _row(table: native.Links, i: int, unknowns: np.ndarray, place: GaugePlace) -> None:
    """Give gauge ``i`` of a table its unknowns and its place; it shows its reserve unchanged."""
    table.unknowns[i] = unknowns
    table.law["place"][i], table.law["carried"][i] = place.x, 1.0


def _element_at(model: Model, wire: str, place: GaugePlace) -> tuple[int, int]:
    """The wire's element at a gauge, and its node there."""
    pairs = model.mesh.elements(wire)
    side = 0 if place.outwards < 0 else 1
    element = int(np.argmin(np.abs(model.mesh.x(pairs[:, side]) - place.x)))
    assert abs(model.mesh.x(pairs[element, side]) - place.x) < SAME_PLACE
    return element, int(pairs[element, side])


def _moved(model: Model, node: int) -> float:
    """Displacement of a node at rest along the track since the installation [m]."""
    return 0.0 if model.form is None else float(model.form.moved_along(node))
