"""Whether what is to be recorded is there to record."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.postproc.record.snapshots.blocks import OTHER_PARTS

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene
    from catenary.meshgen.topologies.line_data import LineData


def check_output(scene: Scene) -> Iterator[Fault]:
    """Spans that the line does not have."""
    output, n = scene.output, scene.line.n_spans
    for key in ("line_channels_spans", "field_spans"):
        spans = getattr(output, key)
        if spans is not None and spans[1] > n:
            why = f"the line has the spans 1 to {n}"
            yield refusal(scene.origin, f"output.{key}", spans, why)


def check_recorded_parts(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Parts that the line does not have."""
    if scene.output.field_parts is None:
        return
    parts = [*(wire.name for wire in make_line(line).wires), *OTHER_PARTS]
    for part in scene.output.field_parts:
        if part not in parts:
            why = f"this line has {', '.join(parts)}"
            yield refusal(scene.origin, "output.field_parts", part, why)
