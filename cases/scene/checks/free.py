"""Whether the wires and links of a free line make a line, each where the other is."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.line.hardware import HangingTable, hung_in
from catenary.cases.scene.line.line import LineTable
from catenary.cases.scene.line.line_data import (
    FIXED,
    TENSIONER,
    numbered,
    span_lengths,
    stretches_of,
)
from catenary.cases.scene.line.wires import (
    FreeArmsTable,
    FreeClampsTable,
    FreeDroppersTable,
    FreeSupportsTable,
    FreeWireTable,
)
from catenary.cases.scene.scene import Scene
from catenary.meshgen.line import Clamps, mast_places
from catenary.meshgen.mesh import ANCHORS
from catenary.meshgen.topologies.free import carriers, cuts_of, hung, in_order
from catenary.meshgen.topologies.line_data import (
    SHORTEST_GAP,
    FreeDroppers,
    FreeLink,
    FreeWire,
    LineData,
)
from catenary.meshgen.wires import SAME_PLACE
from catenary.postproc.evaluate.wording import counted

# Names that mean something else in files and among ends.
TAKEN = (ANCHORS, "droppers", "clamps", "steady_arms", "masts", "pantographs", TENSIONER, FIXED)
# Tables of other topologies that have defaults, and would be read by none here.
_ELSEWHERE = {
    "support": "write a link of type supports",
    "steady_arm": "write a link of type steady_arms",
    "overlap": "give the wires of both sections stretches_m in line.wires",
}
# As many as spans of 20 droppers each on the longest line.
MOST_BY_LINKS = 400_000


def check_free_tables(scene: Scene) -> Iterator[Fault]:
    """Names, numbers of spans and supports, and ends that cannot be."""
    for key, instead in _ELSEWHERE.items():
        if getattr(scene.line, key) != LineTable.model_fields[key].get_default(
            call_default_factory=True
        ):
            why = f"is no part of the topology free; leave it out, and {instead}"
            yield scene.fault(f"line.{key}", why)
    yield from _names(scene)
    wires = {wire.name: wire for wire in scene.line.wires or []}
    if not any(wire.role == "contact" for wire in wires.values()):
        yield scene.fault("line.wires", "has no wire of the role contact to run under")
    for i, wire in enumerate(scene.line.wires or []):
        yield from _wire(scene, f"line.wires.{i}", wire, wires)
    for i, link in enumerate(scene.line.links or []):
        key = f"line.links.{i}"
        joined = ("upper", "lower", "wire", "holds")
        for end in joined:
            if getattr(link, end, None) is not None:
                yield from scene.among(f"{key}.{end}", wires, "line.wires has")
        if isinstance(link, FreeDroppersTable | FreeClampsTable) and link.upper == link.lower:
            yield scene.refused(f"{key}.upper", "a link joins two wires, and lower is this one too")
        yield from _numbers(scene, key, link)
    yield from _circles(scene)
    yield from _lifted(scene)
    yield from _slack(scene)
    yield from _many(scene)


def _names(scene: Scene) -> Iterator[Fault]:
    seen: dict[str, str] = {}
    entries = [(f"line.wires.{i}", wire.name) for i, wire in enumerate(scene.line.wires or [])]
    links = [(f"line.links.{i}", link.name) for i, link in enumerate(scene.line.links or [])]
    for key, name in [*entries, *links]:
        if name in TAKEN and key.startswith("line.wires"):
            yield scene.refused(f"{key}.name", "this name means something else; take another one")
        if name in seen:
            why = f"{seen[name]} has this name too; each wire and each link needs one of its own"
            yield scene.refused(f"{key}.name", why)
        seen.setdefault(name, key)
    for _, name in entries:
        if f"{name}_clamps" in seen:
            why = f"the clamps at the ends of {name} have this name"
            yield scene.refused(f"{seen[f'{name}_clamps']}.name", why)


def _wire(
    scene: Scene, key: str, table: FreeWireTable, wires: dict[str, FreeWireTable]
) -> Iterator[Fault]:
    masts = mast_places(span_lengths(scene.line))
    n, length = scene.line.n_spans, float(masts[-1])
    for name in ("height_m", "stagger_m"):
        given = getattr(table, name)
        if given is not None and len(given) not in (1, n + 1):
            why = f"must be one number or one for each support ({n + 1}), but lists {len(given)}"
            yield scene.fault(f"{key}.{name}", why)
    beyond = [number for number in table.supports or [] if number > n]
    if beyond:
        why = f"the line has the supports 0 to {n}"
        yield scene.refused(f"{key}.supports", why, value=beyond[0])
        return
    which = "stretches_m" if table.stretches_m is not None else "from_supports_m"
    stretches = stretches_of(table, masts)
    if not stretches:
        yield scene.refused(f"{key}.{which}", "the line has no inner support")
        return
    if stretches[0][0] < -SAME_PLACE or stretches[-1][1] > length + SAME_PLACE:
        outside = stretches[0] if stretches[0][0] < -SAME_PLACE else stretches[-1]
        why = f"a piece would run from {outside[0]:g} to {outside[1]:g} m, and the line from 0 to"
        yield scene.refused(f"{key}.{which}", f"{why} {length:g} m")
        return
    for one, other in zip(stretches, stretches[1:], strict=False):
        if other[0] < one[1] + SAME_PLACE:
            why = f"pieces would overlap from {other[0]:g} to {one[1]:g} m"
            yield scene.refused(f"{key}.{which}", why)
            return
    for side in ("start", "end"):
        yield from _end(scene, f"{key}.{side}", table, getattr(table, side), wires)
    needs = table.role != "contact" and not {table.start, table.end} & wires.keys()
    half = table.role != "contact" and not {table.start, table.end} <= wires.keys()
    if (needs or half) and table.height_m is None and table.course_m is None:
        why = "nothing else says how high its ends are held; give height_m or course_m"
        yield scene.missing(f"{key}.height_m", table.name, why, of=key)


def _end(
    scene: Scene, key: str, table: FreeWireTable, given: str | None, wires: dict[str, FreeWireTable]
) -> Iterator[Fault]:
    if given is None or given in (TENSIONER, FIXED):
        return
    if given == table.name:
        yield scene.refused(key, "a wire cannot be clamped to itself")
    elif given not in wires:
        near = difflib.get_close_matches(given, [*wires, TENSIONER, FIXED], n=1)
        meant = f"did you mean {near[0]}? " if near else ""
        why = f"{meant}it must be {TENSIONER}, {FIXED} or a wire of {', '.join(wires)}"
        yield scene.refused(key, why)
    elif {table.start, table.end} <= wires.keys() and table.start != table.end:
        if key.endswith("end"):
            why = (
                f"it starts on {table.start}: both ends must be clamped to one wire, or one be "
                f"{TENSIONER} or {FIXED}, for it to be known whose tension the wire takes"
            )
            yield scene.refused(key, why)


def _numbers(
    scene: Scene,
    key: str,
    link: FreeDroppersTable | FreeClampsTable | FreeSupportsTable | FreeArmsTable,
) -> Iterator[Fault]:
    """Numbers of spans and supports that the line does not have."""
    n = scene.line.n_spans
    for name, first, what in (("spans", 1, "spans"), ("supports", 0, "supports")):
        beyond = [number for number in getattr(link, name, None) or [] if number > n]
        if beyond:
            yield scene.refused(
                f"{key}.{name}", f"the line has the {what} {first} to {n}", value=beyond[0]
            )


def _circles(scene: Scene) -> Iterator[Fault]:
    """Wires that are clamped to each other, or hang from each other, in a circle."""
    wires = scene.line.wires or []
    names = {wire.name for wire in wires}
    ends = {wire.name: [e for e in (wire.start, wire.end) if e in names] for wire in wires}
    hanging: dict[str, list[str]] = {wire.name: [] for wire in wires}
    for link in scene.line.links or []:
        if isinstance(link, FreeDroppersTable | FreeClampsTable) and link.upper in names:
            hanging[link.upper].append(link.lower)
    for key, what, after in (
        ("line.wires", "clamped to", ends),
        ("line.links", "hanging from", hanging),
    ):
        if any(name in others for name, others in after.items()):
            continue  # reported as a link to itself
        try:
            in_order(after.items())
        except InputError as circle:
            yield scene.fault(key, f"has wires {what} each other: {circle}")


def _lifted(scene: Scene) -> Iterator[Fault]:
    """Supports that are to hold a wire which only droppers join to the wire that they carry."""
    wires, links = scene.line.wires or [], scene.line.links or []
    joined = [(wire.name, end) for wire in wires for end in (wire.start, wire.end) if end]
    joined += [(link.upper, link.lower) for link in links if isinstance(link, FreeClampsTable)]
    for i, link in enumerate(links):
        if not isinstance(link, FreeSupportsTable) or link.holds is None:
            continue
        moved, before = {link.wire}, 0
        while len(moved) > before:
            before = len(moved)
            moved |= {name for pair in joined if moved & set(pair) for name in pair}
            moved -= {TENSIONER, FIXED}
        if link.holds not in moved:
            why = (
                f"no clamp joins it to {link.wire}, which the supports carry, and droppers are cut "
                f"for its height: it must be one of {', '.join(sorted(moved))}"
            )
            yield scene.refused(f"line.links.{i}.holds", why)


def _slack(scene: Scene) -> Iterator[Fault]:
    """Droppers with different behaviour when slack: a line has one for all of them."""
    links = [
        (i, link)
        for i, link in enumerate(scene.line.links or [])
        if isinstance(link, FreeDroppersTable)
    ]
    for i, link in links[1:]:
        for name in ("residual_stiffness_ratio", "slack_damping"):
            first = getattr(links[0][1], name)
            if getattr(link, name) != first:
                why = f"it must be the {first} of line.links.{links[0][0]}, as for all droppers"
                yield scene.refused(f"line.links.{i}.{name}", why)


def _many(scene: Scene) -> Iterator[Fault]:
    """More droppers than any line of so many spans has."""
    n = 0
    for i, link in enumerate(scene.line.links or []):
        if isinstance(link, FreeDroppersTable):
            spans = len(link.spans) if link.spans is not None else scene.line.n_spans
            patterns = [len(pattern.positions_m) for pattern in link.patterns or []]
            each = max([len(link.positions_m or []), link.count or 0, *patterns])
            n += len(link.at_m) if link.at_m is not None else spans * each
            if n > MOST_BY_LINKS:
                key = f"line.links.{i}"
                yield Fault(
                    key,
                    f"{key} ({link.name}) {scene.origin.of(key)} and the links before it have {n} "
                    f"droppers, but at most {MOST_BY_LINKS} are allowed",
                )
                return


# As many span lengths are named in a sentence.
_SOME = 6


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
        lengths = ", ".join(f"{span:g}" for span in sorted(set(spans.values()))[:_SOME])
        yield scene.fault(
            f"{table}.positions_m",
            f"holds for one span length, but the spans are {lengths} m long; give {table}.patterns "
            "or count and spacing_m",
        )
        return
    for number, own in hung_in(scene.origin, table, kind, spans).items():
        span, positions = spans[number], own.positions
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


# A wire may be without a link over so many times the longest span.
MOST_SPANS = 1.5


def check_free_droppers(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Find the first span of each link whose droppers are outside or too close together."""
    for i, table in enumerate(scene.line.links or []):
        if isinstance(table, FreeDroppersTable) and table.at_m is None:
            spans = numbered(line.span_lengths)
            own = spans if table.spans is None else {n: spans[n] for n in table.spans}
            yield from droppers_inside(scene, f"line.links.{i}", table, own)


def check_free_places(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Links beyond the ends of a wire, places too close, wires that no link carries."""
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
    yield from found


def _places(link: FreeLink) -> tuple[float, ...]:
    return link.lower_x if isinstance(link, FreeDroppers) else link.x


def _on_wires(
    scene: Scene, key: str, link: FreeLink, wires: dict[str, FreeWire]
) -> Iterator[Fault]:
    pair = isinstance(link, FreeDroppers | Clamps)
    for end in ("upper", "lower") if pair else ("wire",):
        wire = wires[getattr(link, end)]
        places = np.array(_places(link))
        out = places[~wire.passes(places)]
        if out.size:
            runs = ", ".join(f"{start:g} to {stop:g}" for start, stop in wire.stretches[:3])
            more = " and so on" if len(wire.stretches) > 3 else ""
            why = f"{wire.name} does not pass {out[0]:g} m, only {runs} m{more}"
            yield scene.refused(f"{key}.{end}", why)


def _clamped_on(
    scene: Scene, key: str, wire: FreeWire, wires: dict[str, FreeWire]
) -> Iterator[Fault]:
    for end, name in enumerate(wire.clamped_to):
        at = np.array([stretch[end] for stretch in wire.stretches if name])
        out = at[~wires[name].passes(at)] if name else at
        if out.size:
            why = f"{name} does not pass {out[0]:g} m, where this wire would be clamped to it"
            yield scene.refused(f"{key}.{('start', 'end')[end]}", why)


def _heights(scene: Scene, key: str, wire: FreeWire, line: LineData) -> Iterator[Fault]:
    if wire.heights is None and wire.name in hung(line):
        why = "droppers hang this wire or supports hold it, at a height that nothing says"
        yield scene.missing(f"{key}.height_m", wire.name, why, of=key)


def _close(scene: Scene, line: LineData) -> Iterator[Fault]:
    """Cuts that are too close to each other to be meant."""
    x = cuts_of(line).x
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
                yield scene.refused(f"line.links.{i}.lower", why)
                return


def _carried(scene: Scene, key: str, wire: FreeWire, line: LineData) -> Iterator[Fault]:
    """Wires that no link carries over much more than the longest span."""
    at, longest = carriers(line, wire), max(line.span_lengths)
    for start, end in wire.stretches:
        own = at[(at > start - SAME_PLACE) & (at < end + SAME_PLACE)]
        gap = np.diff(own)
        far = np.flatnonzero(gap > MOST_SPANS * longest)
        if far.size:
            a, b = own[far[0]], own[far[0] + 1]
            why = (
                f"it hangs on nothing from {a:g} to {b:g} m, and the longest span is {longest:g} "
                "m: give it droppers, clamps or supports there"
            )
            yield scene.refused(f"{key}.name", why)
            return


def _left(scene: Scene, key: str, wire: FreeWire, line: LineData) -> Iterator[Fault]:
    """Wires whose whole tension the wires clamped to them take."""
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
            yield scene.refused(f"{key}.tension_N", why)
            return
