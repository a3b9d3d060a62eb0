"""Whether what is to be recorded is there to record."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene


def check_output(scene: Scene) -> Iterator[Fault]:
    """Spans that the line does not have."""
    spans, n = scene.output.line_channels_spans, scene.line.n_spans
    if spans is not None and spans[1] > n:
        key = "output.line_channels_spans"
        yield refusal(scene.origin, key, spans, f"the line has the spans 1 to {n}")
