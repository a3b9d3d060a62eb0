"""Whether the droppers of a scene fit into its spans, and hang between its wires."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.line.droppers import HangingTable, hung_in
from catenary.cases.scene.line.line_data import numbered
from catenary.cases.scene.scene import Scene
from catenary.meshgen.geometry import find_cuts
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import SHORTEST_GAP, LineData
from catenary.meshgen.topologies.named import TWIN
from catenary.postproc.evaluate.wording import counted
from catenary.solver.problem.problem import Problem

# As many span lengths are named in a sentence.
_SOME = 6


def check_droppers_inside_spans(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Of each group the first span whose droppers are outside or too close together."""
    table, spans = scene.line, numbered(line.span_lengths)
    if table.dropper is not None:
        yield from droppers_inside(scene, "line.dropper", table.dropper, spans)
    if line.auxiliary_wire is not None and table.auxiliary_wire is not None:
        key, hung = "line.auxiliary_wire.dropper", table.auxiliary_wire.dropper
        yield from droppers_inside(scene, key, hung, spans)


def droppers_inside(
    scene: Scene, table: str, kind: HangingTable, spans: Mapping[int, float]
) -> Iterator[Fault]:
    """The first of some spans in which droppers of a table are outside or too close together.

    ``spans`` are lengths [m] by numbers, from 1. Numbers of spans beyond the line are faults too.
    """
    numbers = {n: i for i, pattern in enumerate(kind.patterns or ()) for n in pattern.spans or ()}
    beyond = max(numbers, default=0)
    if beyond > scene.line.n_spans:
        key, why = (
            f"{table}.patterns.{numbers[beyond]}.spans",
            f"the line has {counted(scene.line.n_spans, 'span')}",
        )
        yield scene.refused(key, why, value=beyond)
        return
    if kind.positions_m is not None and len(set(spans.values())) > 1:
        key = f"{table}.positions_m"
        lengths = ", ".join(f"{span:g}" for span in sorted(set(spans.values()))[:_SOME])
        yield scene.fault(
            key,
            f"holds for one span length, but the spans are "
            f"{lengths} m long; give {table}.patterns or count and spacing_m",
        )
        return
    for number, (positions, _) in hung_in(scene.origin, table, kind, spans).items():
        span = spans[number]
        outside = [x for x in positions if not SHORTEST_GAP <= x <= span - SHORTEST_GAP]
        close = [pair for pair in zip(positions, positions[1:], strict=False)
                 if pair[1] - pair[0] < SHORTEST_GAP]  # fmt: skip
        if not outside and not close:
            continue
        if kind.count is not None and not outside:
            why = f"droppers must be at least {SHORTEST_GAP:g} m apart"
            yield scene.refused(f"{table}.spacing_m", why)
            return
        if kind.count is not None:
            yield scene.refused(
                f"{table}.count",
                f"at a spacing of {kind.spacing_m:g} m these do not fit into a span of {span:g} m",
            )
            return
        which = "positions_m" if kind.positions_m is not None else "patterns"
        key = f"{table}.{which}"
        of = f" of span {number}" if number in numbers else ""
        if outside:
            what = f"a dropper{of} at {outside[0]:g} m; it must lie inside the span, between 0 and "
            what += f"{span:g} m"
        else:
            left, right = close[0]
            what = f"droppers{of} at {left:.10g} and {right:.10g} m; they must be at least "
            what += f"{SHORTEST_GAP:g} m apart"
        yield scene.fault(key, f"puts {what}")
        return


def estimated_dropper_lengths(line: LineData, gravity: float) -> list[np.ndarray]:
    """Lengths of the droppers on the messenger wire of each span [m], this taken as a parabola.

    Its load is its own weight and that of the wires below less what the pre-sag's curvature lets
    the contact wire's tension carry, and stitch wires take a part of its tension beside supports;
    bending, what hangs from them and the supports' give are left out. Good to some centimetres: it
    serves to refuse the impossible, the form finding gives the lengths. Empty without a messenger
    wire.
    """
    messenger, auxiliary = line.messenger_wire, line.auxiliary_wire
    if messenger is None:
        return []
    hung = line.contact_wire.mass_per_length * (2.0 if line.topology == TWIN else 1.0)
    below, positions = 0.0, line.dropper_positions
    if auxiliary is not None:
        hung += auxiliary.conductor.mass_per_length
        below, positions = auxiliary.height, auxiliary.dropper_positions
    lengths = []
    ends = np.cumsum([len(places) for places in positions])[:-1]
    heights = np.split(line.target_height(line.along(positions)) + below, ends)
    for i, (span, places) in enumerate(zip(line.span_lengths, positions, strict=True)):
        x, pre_sag = np.asarray(places, dtype=float), np.asarray(line.pre_sag[i])
        height = heights[i] - (pre_sag if auxiliary is None else 0.0)
        mid_sag = float(pre_sag.max(initial=0.0))
        carried = 8 * mid_sag * line.contact_wire.tension / span**2
        weight = gravity * (hung + messenger.mass_per_length)
        load = max(weight - carried, gravity * messenger.mass_per_length)
        sag = load * x * (span - x) / (2 * messenger.tension)
        if line.stitch_wire is not None:
            stitch, inner = line.stitch_wire, (i > 0, i < line.n_spans - 1)
            less = 1 / (messenger.tension - stitch.conductor.tension) - 1 / messenger.tension
            deeper = 0.25 * load * span * stitch.length * less
            sag += deeper * (inner[0] + (inner[1] - inner[0]) * x / span)
        lengths.append(line.contact_height + line.encumbrance - sag - height)
    return lengths


def check_dropper_lengths(scene: Scene, line: LineData) -> Iterator[Fault]:
    """A messenger wire that would hang below the contact wire."""
    gravity = Problem.gravity if scene.switches().get("gravity", True) else 0.0
    if line.overlaps is not None and line.wires is None:
        find_cuts(make_line(line))  # refuses wires that would cross
    lengths = estimated_dropper_lengths(line, gravity)
    shortest = [float(v.min(initial=np.inf)) for v in lengths] or [np.inf]
    span = int(np.argmin(shortest))
    below = "contact" if line.auxiliary_wire is None else "auxiliary"
    if shortest[span] <= 0:
        yield scene.refused(
            "line.encumbrance_m",
            f"the messenger wire would hang {-shortest[span]:.2f} m below the {below} wire in span "
            f"{span + 1}: raise it, raise line.messenger_wire.tension_N or shorten the span",
        )
