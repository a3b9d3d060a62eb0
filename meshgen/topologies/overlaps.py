"""Overlaps: a line of any topology cut in tension sections, of which two run side by side there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from catenary.meshgen.line import Clamps, Droppers, Line, SteadyArms, Supports
from catenary.meshgen.topologies.line_data import Overlaps
from catenary.meshgen.wires import SAME_PLACE, End, Piece, Profile, Section, Wire

_Joining = TypeVar("_Joining", Droppers, Clamps)
_AtWire = TypeVar("_AtWire", SteadyArms, Supports)


def of_next(name: str) -> str:
    """Name of a wire or group of the second section, and of every other one after it."""
    return f"{name}_next"


def with_overlaps(line: Line, overlaps: Overlaps) -> Line:
    """The line cut into tension sections; ``line`` runs from anchor to anchor.

    A section ends at the last mast of an overlap, and the next one begins at its first mast.
    Contact wires are level up to the middle of the overlap, and rise from there as a parabola to
    the end of their section. Wires of the two sections are ``distance`` apart at the masts in
    between. Wires of the first, third, ... section are pieces of the wires of ``line``; those of
    the second, fourth, ... are pieces of wires with the same names and ``_next``.
    """
    masts = line.support_positions
    first = np.array(overlaps.first, dtype=np.int64)
    last = first + overlaps.n_spans
    middles = 0.5 * (masts[first] + masts[last])
    running = np.column_stack([np.append(-np.inf, middles), np.append(middles, np.inf)])
    sideways = np.zeros(masts.size)
    for begin, end in zip(first, last, strict=True):
        sideways[begin : end + 1] = 0.5 * overlaps.distance
    own, others = (
        _Sections(
            line,
            overlaps.sections(masts)[turn::2],
            running[turn::2],
            overlaps.rise,
            side * sideways,
            name,
        )
        for turn, side, name in ((0, 1.0, str), (1, -1.0, of_next))
    )
    names = [wire.name for wire in line.wires]
    places = {name_of(name): i for i, name in enumerate(names) for name_of in (str, of_next)}
    return Line(
        line.span_lengths,
        line.n_transition,
        line.topology,
        tuple(sorted((*own.wires(), *others.wires()), key=lambda wire: places[wire.name])),
        (*own.droppers(), *others.droppers()),
        (*own.arms(), *others.arms()),
        (*own.supports(), *others.supports()),
        (*own.clamps(), *others.clamps()),
        twins=(*own.twins(), *others.twins()),
    )


class _Sections:
    """Parts of a line in some of its sections, shifted sideways, under other names.

    Parameters
    ----------
    line : from anchor to anchor
    ends : (n, 2) start and end of each section, ascending, without overlap [m]
    running : (n, 2) stretch of each section between its overlaps' middles, where contact wires are
        level [m]
    rise : height that contact wires gain from there to the end of their section [m]
    sideways : (n_masts,) shift of the wires [m]
    name : name of a wire or group, given that in the line
    """

    def __init__(
        self,
        line: Line,
        ends: np.ndarray,
        running: np.ndarray,
        rise: float,
        sideways: np.ndarray,
        name: Callable[[str], str],
    ) -> None:
        self._line, self._name = line, name
        self._ends, self._running, self._rise = ends, running, rise
        self._sideways = sideways

    def wires(self) -> list[Wire]:
        """The wires, cut at the ends of the sections."""
        found = []
        for wire in self._line.wires:
            pieces = tuple(part for piece in wire.pieces for part in self._parts(piece))
            if not pieces:
                continue
            taken = tuple(
                part._replace(by=self._name(part.by))
                for part in wire.taken
                if self._inside(part.start, part.end)
            )
            profile = wire.profile
            if profile is not None:
                profile = self._risen(profile)
                pieces = tuple(
                    replace(piece, z=tuple(profile.level(np.array(piece.x)).tolist()))
                    for piece in pieces
                )
            name = self._name(wire.name)
            found.append(replace(wire, name=name, pieces=pieces, taken=taken, profile=profile))
        return found

    def twins(self) -> list[tuple[str, str]]:
        """Pairs of wires side by side. Both are cut at the same places and exist together."""
        there = {wire.name for wire in self.wires()}
        pairs = ((self._name(one), self._name(other)) for one, other in self._line.twins)
        return [pair for pair in pairs if there.issuperset(pair)]

    def _risen(self, profile: Profile) -> Profile:
        """The heights of a wire with those in overlaps."""
        (whole,) = profile.sections
        sections = []
        for (start, end), (low, high) in zip(
            self._ends.tolist(), self._running.tolist(), strict=True
        ):
            running = max(low, whole.running[0]), min(high, whole.running[1])
            rise = tuple(
                self._rise if np.isfinite(edge) else own
                for edge, own in zip((low, high), whole.rise, strict=True)
            )
            sections.append(Section((start, end), running, (rise[0], rise[1])))
        return replace(profile, sections=tuple(sections))

    def droppers(self) -> list[Droppers]:
        """Groups of droppers inside the sections; those without any are left out.

        Where a clamped wire is not kept whole, its droppers hang from the wire that it is clamped
        to.
        """
        bearers = {group.lower: group.upper for group in self._line.clamps}
        like = {(group.upper, group.lower): group for group in self._line.droppers}
        kept: dict[tuple[str, str], list[tuple[float, float]]] = {}
        for group in self._line.droppers:
            high, low = np.array(group.upper_x), np.array(group.lower_x)
            inside = self._inside(high, high) & self._inside(low, low)
            passes = self._passes(self._line.wire(group.upper), high)
            for there, upper in ((True, group.upper), (False, bearers.get(group.upper))):
                here = inside & (passes == there)
                if here.any():
                    assert upper is not None
                    pairs = zip(low[here].tolist(), high[here].tolist(), strict=True)
                    kept.setdefault((upper, group.lower), []).extend(pairs)
        groups = []
        for key, places in kept.items():
            lower_x, upper_x = zip(*sorted(places), strict=True)
            groups.append(replace(self._named(like[key]), upper_x=upper_x, lower_x=lower_x))
        return groups

    def _passes(self, wire: Wire, x: np.ndarray) -> np.ndarray:
        """Whether the sections have a piece of a wire at places ``x``, bool, shape as ``x``."""
        ends = np.array([(piece.x[0], piece.x[-1]) for piece in wire.pieces])
        keeps = np.array([self._keeps(piece) for piece in wire.pieces])
        which = np.clip(np.searchsorted(ends[:, 0], x, side="right") - 1, 0, None)
        return np.asarray(keeps[which] & (ends[which, 0] <= x) & (x <= ends[which, 1]))

    def arms(self) -> list[SteadyArms]:
        """Steady arms inside the sections."""
        return [self._at_wire(group) for group in self._line.steady_arms]

    def supports(self) -> list[Supports]:
        """Supports inside the sections."""
        return [
            replace(self._at_wire(group), holds=self._name(group.holds) if group.holds else "")
            for group in self._line.supports
        ]

    def _at_wire(self, group: _AtWire) -> _AtWire:
        """Part of a group at one wire that stands inside the sections, with its names."""
        x = np.array(group.x)
        places = tuple(x[self._inside(x, x)].tolist())
        return replace(group, name=self._name(group.name), wire=self._name(group.wire), x=places)

    def clamps(self) -> list[Clamps]:
        """Clamps at the ends of pieces that the sections have."""
        groups = []
        for group in self._line.clamps:
            x, ends = np.array(group.x), self._clamped_ends
            which = np.searchsorted(ends, x - SAME_PLACE)
            there = x[np.append(ends, np.inf)[which] < x + SAME_PLACE]
            if there.size:
                groups.append(replace(self._named(group), x=tuple(there.tolist())))
        return groups

    @cached_property
    def _clamped_ends(self) -> np.ndarray:
        """Places where clamped pieces that the sections keep begin and end, ascending (n,) [m]."""
        ends = [
            place
            for wire in self._line.wires
            for piece in wire.pieces
            if piece.ends[0] is End.CLAMPED and self._keeps(piece)
            for place in (piece.x[0], piece.x[-1])
        ]
        return np.sort(np.array(ends))

    def _named(self, group: _Joining) -> _Joining:
        """A group between two wires with the names of these sections."""
        name, upper, lower = (self._name(own) for own in (group.name, group.upper, group.lower))
        return replace(group, name=name, upper=upper, lower=lower)

    def _inside(self, low: np.ndarray | float, high: np.ndarray | float) -> np.ndarray:
        """Whether stretches from ``low`` to ``high`` are inside one section [m]."""
        which = np.searchsorted(self._ends[:, 0], np.asarray(low) - SAME_PLACE) - 1
        before_end = np.asarray(high) < self._ends[which, 1] - SAME_PLACE
        return np.asarray((which >= 0) & before_end)

    def _keeps(self, piece: Piece) -> bool:
        """Clamped pieces are kept whole, others as far as they reach into a section."""
        if piece.ends[0] is End.CLAMPED:
            return bool(self._inside(piece.x[0], piece.x[-1]))
        return bool(self._reached(piece).any())

    def _reached(self, piece: Piece) -> np.ndarray:
        """Into which sections a piece reaches, bool (n_sections,)."""
        low, high = self._ends.T
        return (piece.x[0] < high - SAME_PLACE) & (piece.x[-1] > low + SAME_PLACE)

    def _parts(self, piece: Piece) -> list[Piece]:
        """Part of a piece inside the sections."""
        masts, at = self._line.support_positions, piece.course[0]
        if piece.ends[0] is End.CLAMPED:
            sections = np.array([[at[0], at[-1]]])[: int(self._keeps(piece))]
        else:
            sections = self._ends[self._reached(piece)]
        parts = []
        for start, end in sections:
            low, high = max(start, at[0]), min(end, at[-1])
            between = slice(np.searchsorted(at, low, side="right"), np.searchsorted(at, high))
            x = np.concatenate([[low], at[between], [high]])
            points = piece.points(x)
            y = points[:, 1] + np.interp(x, masts, self._sideways)
            parts.append(
                Piece(
                    tuple(x.tolist()), tuple(y.tolist()), tuple(points[:, 2].tolist()), piece.ends
                )
            )
        return parts
