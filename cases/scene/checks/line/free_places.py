"""Whether the links of a free line are where its wires are, and whether its wires hang on them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from catenary.cases.scene.checks.line.droppers import droppers_inside
from catenary.cases.scene.convert.line.line import line_data_of
from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.keys.error_sentences import refusal
from catenary.cases.scene.tables.line.free import FreeDroppersTable
from catenary.meshgen.division import divisions_of
from catenary.meshgen.geometry import SAME_CUT, Cuts
from catenary.meshgen.hardware import Clamps
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.free import carriers, hung
from catenary.meshgen.topologies.free_data import FreeDroppers, FreeLink, FreeWire
from catenary.meshgen.topologies.line_data import SHORTEST_GAP, LineData

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

# A wire may hang on nothing over so many times the longest span.
MOST_SPANS = 1.5
_TINY = 1e-6  # [m]


def check_free_droppers(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Of each link the first span whose droppers are outside or too close together."""
    for i, table in enumerate(scene.line.links or []):
        if isinstance(table, FreeDroppersTable) and table.at_m is None:
            spans = [line.span_lengths[span - 1] for span in table.spans or ()]
            key = f"line.links.{i}"
            yield from droppers_inside(scene, key, table, spans or line.span_lengths)


def check_free_places(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Links where a wire is not, places too close, wires that hang on nothing or cross."""
    assert line.wires is not None and line.links is not None
    wires = {wire.name: wire for wire in line.wires}
    found = [
        fault
        for i, link in enumerate(line.links)
        for fault in _on_wires(scene, f"line.links.{i}", link, wires)
    ]
    for i, wire in enumerate(line.wires):
        found += _clamped_on(scene, f"line.wires.{i}", wire, wires)
        found += _heights(scene, f"line.wires.{i}", wire, line)
    found += [] if found else _close(scene, line)
    found += [] if found else _twice(scene, line)
    for i, wire in enumerate([] if found else line.wires):
        found += _carried(scene, f"line.wires.{i}", wire, line)
        found += _left(scene, f"line.wires.{i}", wire, line)
    yield from found or _crossing(scene, line)


def places_of(line: LineData) -> np.ndarray:
    """All places at which wires are cut, ascending, each once [m]."""
    assert line.wires is not None and line.links is not None
    parts = [line.support_positions]
    parts += [np.array(wire.stretches).ravel() for wire in line.wires]
    parts += [np.array(_places(link)) for link in line.links]
    x = np.concatenate(parts)
    x = x[np.argsort(x, kind="stable")]
    return x[np.diff(x, prepend=-np.inf) > SAME_CUT]


def free_counts(scene: Scene) -> tuple[int, dict[str, int]]:
    """Numbers of droppers, and of nodes of each wire, of a free line.

    Raises
    ------
    InputError
        If droppers are not declared for one of the span lengths.
    """
    line = line_data_of(scene)
    assert line.wires is not None and line.links is not None
    x = places_of(line)
    cuts = Cuts(x, np.isin(x, line.support_positions), ())
    gaps = divisions_of(cuts, scene.mesh.elements_per_gap, scene.mesh.support_refinement)
    before = np.concatenate([[0], np.cumsum(gaps)])
    nodes = {}
    for wire in line.wires:
        ends = cuts.of(np.array(wire.stretches))
        nodes[wire.name] = int((np.diff(before[ends], axis=1) + 1).sum())
    droppers = sum(len(link.lower_x) for link in line.links if isinstance(link, FreeDroppers))
    return droppers, nodes


def _places(link: FreeLink) -> tuple[float, ...]:
    return link.lower_x if isinstance(link, FreeDroppers) else link.x


def _on_wires(
    scene: Scene, key: str, link: FreeLink, wires: dict[str, FreeWire]
) -> Iterator[Fault]:
    pair = isinstance(link, FreeDroppers | Clamps)
    for end in ("upper", "lower") if pair else ("wire",):
        wire = wires[getattr(link, end)]
        out = next((x for x in _places(link) if not wire.passes(x)), None)
        if out is not None:
            runs = ", ".join(f"{start:g} to {stop:g}" for start, stop in wire.stretches[:3])
            more = " and so on" if len(wire.stretches) > 3 else ""
            why = f"{wire.name} does not pass {out:g} m, only {runs} m{more}"
            yield refusal(scene.origin, f"{key}.{end}", wire.name, why)


def _clamped_on(
    scene: Scene, key: str, wire: FreeWire, wires: dict[str, FreeWire]
) -> Iterator[Fault]:
    for end, name in enumerate(wire.clamped_to):
        out = [] if not name else [s[end] for s in wire.stretches if not wires[name].passes(s[end])]
        if out:
            why = f"{name} does not pass {out[0]:g} m, where this wire would be clamped to it"
            yield refusal(scene.origin, f"{key}.{('start', 'end')[end]}", name, why)


def _heights(scene: Scene, key: str, wire: FreeWire, line: LineData) -> Iterator[Fault]:
    if wire.heights is None and wire.name in hung(line):
        yield Fault(
            f"{key}.height_m",
            f"{key}.height_m ({wire.name}) is missing {scene.origin.of(key)}: droppers hang this "
            "wire or supports hold it, at a height that nothing says",
        )


def _close(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Cuts that are too close to each other to be meant."""
    x = places_of(line)
    close = np.flatnonzero(np.diff(x) < SHORTEST_GAP)
    if close.size:
        one, other = x[close[0]], x[close[0] + 1]
        yield Fault(
            "line.links",
            f"line.links and line.wires {scene.origin.of('line.links')} name the places "
            f"{one:.10g} and {other:.10g} m; places must be one, or {SHORTEST_GAP:g} m apart",
        )


def _twice(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Two links that would hold the same place of a wire at its height."""
    assert line.links is not None
    seen: dict[tuple[str, int], int] = {}
    for i, link in enumerate(line.links):
        if not isinstance(link, FreeDroppers):
            continue
        for x in link.lower_x:
            j = seen.setdefault((link.lower, round(x / SHORTEST_GAP)), i)
            if j != i:
                why = f"line.links.{j} has a dropper of {link.lower} at {x:g} m already"
                yield refusal(scene.origin, f"line.links.{i}.lower", link.lower, why)
                return


def _carried(scene: Scene, key: str, wire: FreeWire, line: LineData) -> Iterator[Fault]:
    """Wires that nothing carries over much more than the longest span."""
    at, longest = carriers(line, wire), max(line.span_lengths)
    for start, end in wire.stretches:
        own = at[(at > start - _TINY) & (at < end + _TINY)]
        gap = np.diff(own)
        far = np.flatnonzero(gap > MOST_SPANS * longest)
        if far.size:
            a, b = own[far[0]], own[far[0] + 1]
            why = (
                f"it hangs on nothing from {a:g} to {b:g} m, and the longest span is {longest:g} "
                "m: give it droppers, clamps or supports there"
            )
            yield refusal(scene.origin, f"{key}.name", wire.name, why)
            return


def _left(scene: Scene, key: str, wire: FreeWire, line: LineData) -> Iterator[Fault]:
    """Wires whose tension is taken by those that are clamped to them."""
    assert line.wires is not None
    takers = [other for other in line.wires if wire.name in other.bearers]
    starts = sorted({s[0] for other in takers for s in other.stretches})
    for x in starts:
        own = [one for one in takers if any(s[0] <= x < s[1] for s in one.stretches)]
        taken = sum(one.conductor.tension for one in own)
        if taken >= wire.conductor.tension:
            why = (
                f"it must be more than the {taken:g} N that {' and '.join(o.name for o in own)} "
                f"take of it at {x:g} m"
            )
            yield refusal(scene.origin, f"{key}.tension_N", wire.conductor.tension, why)
            return


def _crossing(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Droppers whose upper wire is expected to hang below the lower one."""
    assert line.links is not None
    made = make_line(line)
    for i, link in enumerate(line.links):
        if not isinstance(link, FreeDroppers):
            continue
        x = np.array(link.lower_x)
        upper, lower = (made.wire(name).points(x)[:, 2] for name in (link.upper, link.lower))
        worst = int(np.argmin(upper - lower))
        if not upper[worst] > lower[worst]:
            why = (
                f"at {x[worst]:g} m it is expected {lower[worst] - upper[worst]:.3f} m below "
                f"{link.lower}, which hangs from it: raise its height_m or its tension_N, or let "
                "the other wire hang lower"
            )
            yield refusal(scene.origin, f"line.links.{i}.upper", link.upper, why)
            return
