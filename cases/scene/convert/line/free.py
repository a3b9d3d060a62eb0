"""From a scene's tables to the wires and links of a free line."""

from __future__ import annotations

import numpy as np

from catenary.cases.scene.convert.line.parts import (
    conductor,
    dropper_kind,
    positions_in,
    pre_sag_of,
    staggered,
    steady_arm,
)
from catenary.cases.scene.input.origin import Origin
from catenary.cases.scene.tables.line.free import (
    FreeArmsTable,
    FreeClampsTable,
    FreeDroppersTable,
    FreeSupportsTable,
    FreeWireTable,
)
from catenary.cases.scene.tables.line.line import LineTable
from catenary.cases.scene.tables.units import length_from_mm
from catenary.meshgen.hardware import Clamps, SteadyArms, Supports
from catenary.meshgen.topologies.free_data import Course, FreeDroppers, FreeLink, FreeWire
from catenary.meshgen.wires import Role

# What ``start`` and ``end`` of a wire say besides names of wires.
TENSIONER, FIXED = "tensioner", "fixed"
_INSIDE = 1e-6  # [m]


def free_wires(line: LineTable, spans: tuple[float, ...]) -> tuple[FreeWire, ...] | None:
    """The wires of a free line, None of another one."""
    if line.wires is None:
        return None
    masts = np.concatenate([[0.0], np.cumsum(spans)])
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
    """Whether an end has a tensioner; None of one where the line ends, about which nothing is
    said."""
    given = table.start if side == 0 else table.end
    if given is not None:
        return given == TENSIONER
    at_end = all(abs(stretch[side] - masts[side]) < _INSIDE for stretch in stretches)
    return None if at_end else False


def _courses(
    line: LineTable, table: FreeWireTable, role: Role, masts: np.ndarray
) -> tuple[Course | None, Course | None]:
    """Heights and lateral places of a wire along the line; None where the wires that it is clamped
    to say them."""
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
    """The links of a free line, None of another one.

    Raises
    ------
    InputError
        If droppers are not declared for one of the span lengths.
    """
    if line.links is None or wires is None:
        return None
    masts = np.concatenate([[0.0], np.cumsum(spans)])
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
    inner = masts[1:-1].tolist()
    return tuple(x for x in inner if wire is not None and wire.passes(x, -_INSIDE))


def _droppers(
    line: LineTable, origin: Origin, key: str, table: FreeDroppersTable, spans: tuple[float, ...]
) -> FreeDroppers:
    kind = dropper_kind(table, table.contact_clamp_kg)
    if table.at_m is not None:
        sag = tuple(map(length_from_mm, table.pre_sag_mm or [0.0] * len(table.at_m)))
        at = tuple(table.at_m)
        return FreeDroppers(table.name, kind, table.upper, table.lower, at, at, sag)
    starts = np.concatenate([[0.0], np.cumsum(spans)])
    places: list[float] = []
    sags: list[float] = []
    first, last = line.transition.n_spans_start, line.n_spans - line.transition.n_spans_end
    for span in table.spans or range(1, line.n_spans + 1):
        within = positions_in(origin, key, table, spans[span - 1])
        places += [float(starts[span - 1] + x) for x in within]
        running = first <= span - 1 < last
        sags += pre_sag_of(table, spans[span - 1], within) if running else (0.0,) * len(within)
    at = tuple(places)
    return FreeDroppers(table.name, kind, table.upper, table.lower, at, at, tuple(sags))
