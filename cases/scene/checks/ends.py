"""Whether the ends of the line leave room for what is judged."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.meshgen.topologies.line_data import LineData

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene


def check_ends(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Layers that are longer than the line, or reach into what is judged."""
    masts, n = line.support_positions, line.n_spans
    stretch = scene.evaluation
    for side, end in (("start", scene.line.ends.start), ("end", scene.line.ends.end)):
        if end.spans is None:
            continue
        key = f"line.ends.{side}.spans"
        if end.spans >= n:
            yield refusal(
                scene.origin, key, end.spans, f"the line has {n} spans (line.n_spans) with it"
            )
            continue
        inner = float(masts[end.spans] if side == "start" else masts[n - end.spans])
        reaches = stretch.from_m < inner if side == "start" else stretch.to_m > inner
        if reaches:
            given = (
                f"evaluation.from_m = {stretch.from_m:g}"
                if side == "start"
                else f"evaluation.to_m = {stretch.to_m:g}"
            )
            yield refusal(
                scene.origin,
                key,
                end.spans,
                f"the absorbing layer reaches to {inner:g} m, into the evaluated stretch "
                f"({given}); give the line more spans (line.n_spans) or the layer fewer",
            )
