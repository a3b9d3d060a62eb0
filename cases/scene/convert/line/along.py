"""From a scene's tables to what holds wires along the track."""

from __future__ import annotations

from catenary.cases.scene.tables.line.line import LineTable
from catenary.solver.problem.along_track import AlongTrack, Tensioner

TENSIONER = "tensioner"


def along_of(table: LineTable) -> AlongTrack:
    """How the wires of a line end along the track, and what else holds them."""
    given = table.tensioner
    return AlongTrack(
        tensioner=Tensioner(
            ratio=given.ratio,
            efficiency=given.efficiency,
            travel=given.travel_m,
            stop_stiffness=given.stop_stiffness_N_per_m,
            weights=dict(given.weights_kg),
        ),
        start=table.ends.start.along == TENSIONER,
        end=table.ends.end.along == TENSIONER,
        overlap=table.overlap is None or table.overlap.along == TENSIONER,
        mid_points=tuple(table.mid_points_m),
        warmer=table.temperature.difference_K,
    )
