"""Whether the droppers of a scene fit into its spans, and hang between its wires."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.meshgen.topologies.line_data import SHORTEST_GAP, LineData
from catenary.solver.problem.problem import Problem

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

# As many span lengths are named in a sentence.
_SOME = 6


def check_droppers_inside_spans(scene: Scene, line: LineData) -> Iterator[Fault]:
    """The first span whose droppers are outside or too close together."""
    kind = scene.line.dropper
    if kind.positions_m is not None and len(set(line.span_lengths)) > 1:
        key = "line.dropper.positions_m"
        lengths = ", ".join(f"{span:g}" for span in sorted(set(line.span_lengths))[:_SOME])
        yield Fault(
            key,
            f"{key} {scene.origin.of(key)} holds for one span length, but the spans are "
            f"{lengths} m long; give line.dropper.patterns or count and spacing_m",
        )
        return
    for span, positions in zip(line.span_lengths, line.dropper_positions, strict=True):
        outside = [x for x in positions if not SHORTEST_GAP <= x <= span - SHORTEST_GAP]
        close = [pair for pair in zip(positions, positions[1:], strict=False)
                 if pair[1] - pair[0] < SHORTEST_GAP]  # fmt: skip
        if not outside and not close:
            continue
        if kind.count is not None and not outside:
            why = f"droppers must be at least {SHORTEST_GAP:g} m apart"
            yield refusal(scene.origin, "line.dropper.spacing_m", kind.spacing_m, why)
            return
        if kind.count is not None:
            yield refusal(
                scene.origin,
                "line.dropper.count",
                kind.count,
                f"at a spacing of {kind.spacing_m:g} m these do not fit into a span of {span:g} m",
            )
            return
        which = "positions_m" if kind.positions_m is not None else "patterns"
        key = f"line.dropper.{which}"
        if outside:
            what = f"a dropper at {outside[0]:g} m; it must lie inside the span, between 0 and "
            what += f"{span:g} m"
        else:
            left, right = close[0]
            what = f"droppers at {left:.10g} and {right:.10g} m; they must be at least "
            what += f"{SHORTEST_GAP:g} m apart"
        yield Fault(key, f"{key} {scene.origin.of(key)} puts {what}")
        return


def estimated_dropper_lengths(line: LineData, gravity: float) -> list[np.ndarray]:
    """Dropper lengths of each span [m], the messenger wire taken as a parabola.

    Its load is its own weight and that of the contact wire less what the pre-sag's curvature lets
    the contact wire's tension carry; bending and the supports' give are left out. Good to a few
    centimetres: it serves to refuse the impossible, the form finding gives the lengths.
    """
    lengths = []
    places = [np.asarray(positions, dtype=float) for positions in line.dropper_positions]
    ends = np.cumsum([place.size for place in places])[:-1]
    masts = np.repeat(line.support_positions[:-1], [place.size for place in places])
    heights = np.split(line.target_height(masts + np.concatenate(places)), ends)
    for i, (span, x) in enumerate(zip(line.span_lengths, places, strict=True)):
        pre_sag = np.asarray(line.pre_sag[i])
        height = heights[i] - pre_sag
        mid_sag = float(pre_sag.max(initial=0.0))
        carried = 8 * mid_sag * line.contact_wire.tension / span**2
        weight = gravity * (line.contact_wire.mass_per_length + line.messenger_wire.mass_per_length)
        load = max(weight - carried, gravity * line.messenger_wire.mass_per_length)
        sag = load * x * (span - x) / (2 * line.messenger_wire.tension)
        lengths.append(line.contact_height + line.encumbrance - sag - height)
    return lengths


def check_dropper_lengths(scene: Scene, line: LineData) -> Iterator[Fault]:
    """A messenger wire that would hang below the contact wire."""
    gravity = Problem.gravity if scene.switches().get("gravity", True) else 0.0
    shortest = [float(v.min()) for v in estimated_dropper_lengths(line, gravity)]
    span = int(np.argmin(shortest))
    if shortest[span] <= 0:
        yield refusal(
            scene.origin,
            "line.encumbrance_m",
            line.encumbrance,
            f"the messenger wire would hang {-shortest[span]:.2f} m below the contact wire in span "
            f"{span + 1}: raise it, raise line.messenger_wire.tension_N or shorten the span",
        )
