"""Whether the ends of the line leave room for what is judged, and can go on beyond."""

from __future__ import annotations

from collections.abc import Iterator

from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.run.incidents import DropperBreakTable, TensionLossTable
from catenary.cases.scene.scene import Scene
from catenary.meshgen.topologies.line_data import LineData

# Lengths of spans that differ by less are one [m].
_TINY = 1e-6
# The last span and the one that is repeated.
_LAST = 2


def check_ends(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Ends that cannot be."""
    yield from _layers(scene, line)
    for side, end in (("start", scene.line.ends.start), ("end", scene.line.ends.end)):
        if end.kind == "periodic":
            yield from _goes_on(scene, line, side)


def _goes_on(scene: Scene, line: LineData, side: str) -> Iterator[Fault]:
    """Lines that cannot go on beyond an end as they are there."""
    key = f"line.ends.{side}.kind"

    def refused(why: str) -> Fault:
        return scene.refused(key, why)

    numerics, n = scene.numerics, line.n_spans
    if numerics.scheme == "ts_alpha2":
        yield refused("it acts with numerics.scheme one_solve or fixed_point, not with ts_alpha2")
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
    if abs(lengths[0] - lengths[1]) > _TINY:
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
    for side, end in (("start", scene.line.ends.start), ("end", scene.line.ends.end)):
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
