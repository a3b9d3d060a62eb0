"""From the table of a line to what topologies take, in SI units; wires and links of a free line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.keys.units import length_from_mm
from catenary.cases.scene.line.hardware import (
    DropperTable,
    Hung,
    dropper_kind,
    hung_in,
    steady_arm,
)
from catenary.cases.scene.line.line import LineTable, curve_of
from catenary.cases.scene.line.wires import (
    AuxiliaryWireTable,
    FreeArmsTable,
    FreeClampsTable,
    FreeDroppersTable,
    FreeSupportsTable,
    FreeWireTable,
    clamped_wire_of,
    conductor,
)
from catenary.meshgen.line import Clamps, SteadyArms, Supports, mast_places
from catenary.meshgen.topologies.line_data import (
    AuxiliaryWire,
    Course,
    FreeDroppers,
    FreeLink,
    FreeWire,
    LineData,
    Overlaps,
    Twin,
)
from catenary.meshgen.wires import SAME_PLACE, Role
from catenary.solver.problem.ends import AlongTrack, Tensioner


def line_data(table: LineTable, origin: Origin) -> LineData:
    """The line of a table as topologies take it; ``origin`` says where its keys were written.

    Raises
    ------
    InputError
        If the droppers are not declared for one of the span lengths.
    """
    spans = span_lengths(table)
    hung = table.dropper
    wires = free_wires(table, spans)
    links = free_links(table, origin, spans, wires)
    droppers = [Hung((), ())] * table.n_spans
    if hung is not None:
        droppers = list(hung_in(origin, "line.dropper", hung, numbered(spans)).values())
    first, last = table.transition.n_spans_start, table.n_spans - table.transition.n_spans_end
    pre_sag = [own.sagging(first <= i < last) for i, own in enumerate(droppers)]
    return LineData(
        span_lengths=spans,
        dropper_positions=tuple(own.positions for own in droppers),
        pre_sag=tuple(pre_sag),
        stagger=staggered(table.stagger_m, table.n_spans),
        messenger_stagger=_optional(
            lambda own: staggered(own, table.n_spans), table.messenger_stagger_m
        ),
        curve=_optional(curve_of, table.curve),
        contact_height=table.contact_height_m,
        encumbrance=table.encumbrance_m or 0.0,
        contact_wire=_optional(conductor, table.contact_wire),
        messenger_wire=_optional(conductor, table.messenger_wire),
        dropper=None if hung is None else dropper_kind(hung, hung.contact_clamp_kg),
        support_stiffness=table.support.stiffness_N_per_m,
        steady_arm=steady_arm(table.steady_arm),
        n_transition=(table.transition.n_spans_start, table.transition.n_spans_end),
        transition_rise=table.transition.rise_m,
        topology=table.topology,
        auxiliary_wire=_optional(lambda own: _auxiliary(own, origin, spans), table.auxiliary_wire),
        stitch_wire=_optional(clamped_wire_of, table.stitch_wire),
        twin=_optional(lambda own: Twin(own.spacing_m, own.droppers == "alternating"), table.twin),
        bridle=_optional(clamped_wire_of, table.bridle),
        overlaps=overlaps_of(table),
        wires=wires,
        links=links,
    )


_Table = TypeVar("_Table")
_Part = TypeVar("_Part")


def _optional(make: Callable[[_Table], _Part], table: _Table | None) -> _Part | None:
    return None if table is None else make(table)


def _auxiliary(
    table: AuxiliaryWireTable, origin: Origin, spans: tuple[float, ...]
) -> AuxiliaryWire:
    key = "line.auxiliary_wire.dropper"
    return AuxiliaryWire(
        conductor(table),
        table.height_m,
        dropper_kind(table.dropper, table.dropper.auxiliary_clamp_kg),
        tuple(
            own.positions for own in hung_in(origin, key, table.dropper, numbered(spans)).values()
        ),
    )


def numbered(spans: Sequence[float]) -> dict[int, float]:
    """Lengths of spans [m] by their numbers, from 1."""
    return dict(enumerate(spans, start=1))


def span_lengths(table: LineTable) -> tuple[float, ...]:
    """Length of every span [m]; ``span_m`` is repeated over the spans that it stands for."""
    transition, n = table.transition, table.n_spans
    if transition.span_m is None:
        return tuple(table.span_m[i % len(table.span_m)] for i in range(n))
    n_running = n - transition.n_spans_start - transition.n_spans_end
    running = tuple(table.span_m[i % len(table.span_m)] for i in range(n_running))
    ends = (transition.span_m,)
    return ends * transition.n_spans_start + running + ends * transition.n_spans_end


# Values of ``start`` and ``end`` of a wire besides names of wires.
TENSIONER, FIXED = "tensioner", "fixed"


def free_wires(line: LineTable, spans: tuple[float, ...]) -> tuple[FreeWire, ...] | None:
    """The wires of a free line, None of another one."""
    if line.wires is None:
        return None
    masts = mast_places(spans)
    return tuple(_wire(line, table, masts) for table in line.wires)


def stretches_of(table: FreeWireTable, masts: np.ndarray) -> tuple[tuple[float, float], ...]:
    """From and to of the pieces of a wire [m]."""
    if table.stretches_m is not None:
        return tuple((start, end) for start, end in table.stretches_m)
    if table.from_supports_m is not None:
        start, end = table.from_supports_m
        return tuple((x + start, x + end) for x in _masts_of(table, masts).tolist())
    return ((float(masts[0]), float(masts[-1])),)


def _masts_of(table: FreeWireTable, masts: np.ndarray) -> np.ndarray:
    return masts[1:-1] if table.supports is None else masts[table.supports]


def _wire(line: LineTable, table: FreeWireTable, masts: np.ndarray) -> FreeWire:
    stretches = stretches_of(table, masts)
    role = Role(table.role)
    heights, lateral = _courses(line, table, role, masts)
    names = {wire.name for wire in line.wires or []}
    ends = (table.start, table.end)
    clamped = [end if end is not None and end in names else "" for end in ends]
    tensioned = [_tensioned(table, side, masts, stretches) for side in (0, -1)]
    return FreeWire(
        conductor(table),
        table.name,
        role,
        stretches,
        heights,
        lateral,
        table.course_m is not None,
        (clamped[0], clamped[1]),
        (tensioned[0], tensioned[1]),
        table.clamp_kg,
        table.clamp_stiffness_N_per_m,
    )


def _tensioned(
    table: FreeWireTable, side: int, masts: np.ndarray, stretches: tuple[tuple[float, float], ...]
) -> bool | None:
    """Whether an end has a tensioner; None where the wire ends with the line and the scene does not
    say."""
    given = table.start if side == 0 else table.end
    if given is not None:
        return given == TENSIONER
    at_end = all(abs(stretch[side] - masts[side]) < SAME_PLACE for stretch in stretches)
    return None if at_end else False


def _courses(
    line: LineTable, table: FreeWireTable, role: Role, masts: np.ndarray
) -> tuple[Course | None, Course | None]:
    """Heights and lateral positions of a wire along the line; None where the wires that it is
    clamped to say them."""
    if table.course_m is not None:
        along, sideways, height = np.array(table.course_m).T
        if table.from_supports_m is not None:
            starts = _masts_of(table, masts)
            along = np.add.outer(starts, along).ravel()
            sideways, height = np.tile(sideways, starts.size), np.tile(height, starts.size)
        x = tuple(along.tolist())
        sideways = sideways + table.sideways_m
        return Course(x, tuple(height.tolist())), Course(x, tuple(sideways.tolist()))
    at, n = tuple(masts.tolist()), line.n_spans
    heights = table.height_m
    if heights is None and role is Role.CONTACT:
        heights = [line.contact_height_m]
    level = None
    if heights is not None:
        level = Course(at, tuple(heights) if len(heights) > 1 else (heights[0],) * (n + 1))
    given = table.stagger_m
    if given is None and role is Role.CONTACT:
        given = line.stagger_m
    names = {wire.name for wire in line.wires or []}
    if given is None and names & {table.start, table.end}:
        return level, None
    if given is None:
        given = line.messenger_stagger_m or [0.0]
    places = tuple(y + table.sideways_m for y in staggered(given, n))
    return level, Course(at, places)


def free_links(
    line: LineTable, origin: Origin, spans: tuple[float, ...], wires: tuple[FreeWire, ...] | None
) -> tuple[FreeLink, ...] | None:
    """The links of a free line with span lengths ``spans`` [m] and ``wires``; None for other lines.

    Raises
    ------
    InputError
        If droppers are not declared for one of the span lengths.
    """
    if line.links is None or wires is None:
        return None
    masts = mast_places(spans)
    by_name = {wire.name: wire for wire in wires}
    links: list[FreeLink] = []
    for i, table in enumerate(line.links):
        match table:
            case FreeDroppersTable():
                links.append(_droppers(line, origin, f"line.links.{i}", table, spans))
            case FreeClampsTable():
                links.append(
                    Clamps(
                        table.name,
                        table.stiffness_N_per_m,
                        table.clamp_kg,
                        table.upper,
                        table.lower,
                        tuple(table.at_m),
                    )
                )
            case FreeSupportsTable():
                at = _places(table, by_name.get(table.wire), masts)
                own = table.stiffness_N_per_m, table.wire
                links.append(Supports(table.name, *own, at, holds=table.holds or ""))
            case FreeArmsTable():
                at = _places(table, by_name.get(table.wire), masts)
                links.append(SteadyArms(table.name, steady_arm(table), table.wire, at))
    return tuple(links)


def _places(
    table: FreeSupportsTable | FreeArmsTable, wire: FreeWire | None, masts: np.ndarray
) -> tuple[float, ...]:
    if table.at_m is not None:
        return tuple(table.at_m)
    if table.supports is not None:
        return tuple(masts[table.supports].tolist())
    inner = masts[1:-1]
    return () if wire is None else tuple(inner[wire.passes(inner, -SAME_PLACE)].tolist())


def _droppers(
    line: LineTable, origin: Origin, key: str, table: FreeDroppersTable, spans: tuple[float, ...]
) -> FreeDroppers:
    kind = dropper_kind(table, table.contact_clamp_kg)
    if table.at_m is not None:
        sag = tuple(map(length_from_mm, table.pre_sag_mm or [0.0] * len(table.at_m)))
        at = tuple(table.at_m)
        return FreeDroppers(table.name, kind, table.upper, table.lower, at, at, sag)
    starts = mast_places(spans)
    places: list[float] = []
    sags: list[float] = []
    first, last = line.transition.n_spans_start, line.n_spans - line.transition.n_spans_end
    own = {span: spans[span - 1] for span in table.spans or range(1, line.n_spans + 1)}
    for span, hung in hung_in(origin, key, table, own).items():
        places += [float(starts[span - 1] + x) for x in hung.positions]
        sags += hung.sagging(first <= span - 1 < last)
    at = tuple(places)
    return FreeDroppers(table.name, kind, table.upper, table.lower, at, at, tuple(sags))


def overlaps_of(table: LineTable) -> Overlaps | None:
    """Overlaps of a line's tension sections; None if it has one section.

    Overlaps are repeated as long as a running span is left behind them.
    """
    given = table.overlap
    if given is None:
        return None
    first = [number - 1 for number in given.first_span]
    if given.repeat_every_spans is not None:
        last = table.n_spans - table.transition.n_spans_end - given.n_spans - 1
        first += range(first[-1] + given.repeat_every_spans, last + 1, given.repeat_every_spans)
    return Overlaps(tuple(first), given.n_spans, given.rise_m, given.distance_m)


def along_of(table: LineTable) -> AlongTrack:
    """Ends of a line's wires along the track, and their other fixings."""
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


def hanging_table(table: LineTable) -> DropperTable | None:
    """The table that says what slack droppers do; of a free line that of its first droppers."""
    return next(iter(tables_of(table, DropperTable).values()), None)


def tables_of(table: LineTable, kind: type[_Table]) -> dict[str, _Table]:
    """Tables of a kind, such as all of wires, by their keys; of a free line those in its lists."""
    own = {f"line.{name}": getattr(table, name) for name in LineTable.model_fields}
    if table.wires is not None or table.links is not None:
        lists = {"line.wires": table.wires, "line.links": table.links}
        own = {f"{key}.{i}": one for key, ones in lists.items() for i, one in enumerate(ones or [])}
    return {key: one for key, one in own.items() if isinstance(one, kind)}


def staggered(given: list[float], n_spans: int) -> tuple[float, ...]:
    """Lateral positions at all supports: one number alternates [m]."""
    if len(given) > 1:
        return tuple(given)
    side = given[0]
    return tuple(side if i % 2 == 0 else -side for i in range(n_spans + 1))
