"""From a scene's table to the overlaps of a line's tension sections."""

from __future__ import annotations

from catenary.cases.scene.tables.line.line import LineTable
from catenary.meshgen.topologies.line_data import Overlaps


def overlaps_of(table: LineTable) -> Overlaps | None:
    """Where a line's tension sections overlap; None if it has one section.

    Repeated ones are those that leave a running span behind them.
    """
    given = table.overlap
    if given is None:
        return None
    first = [number - 1 for number in given.first_span]
    if given.repeat_every_spans is not None:
        last = table.n_spans - table.transition.n_spans_end - given.n_spans - 1
        first += range(first[-1] + given.repeat_every_spans, last + 1, given.repeat_every_spans)
    return Overlaps(tuple(first), given.n_spans, given.rise_m, given.distance_m)
