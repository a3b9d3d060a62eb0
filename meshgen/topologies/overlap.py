"""Overlap of two tension sections: a line of any topology cut in two that run side by side."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from catenary.meshgen.hardware import Clamps, Droppers, SteadyArms, Supports
from catenary.meshgen.line import Line
from catenary.meshgen.topologies.line_data import Overlap
from catenary.meshgen.wires import End, Piece, Profile, Wire

_SAME_PLACE = 1e-6  # [m]

_Joining = TypeVar("_Joining", Droppers, Clamps)
_AtWire = TypeVar("_AtWire", SteadyArms, Supports)


def of_next(name: str) -> str:
    """Name of a wire or group in the section that follows."""
    return f"{name}_next"


def with_overlap(line: Line, overlap: Overlap) -> Line:
    """Two sections in place of a line from anchor to anchor.

    The first ends at the last mast of the overlap, the second begins at its first mast. Contact
    wires are level up to the middle of the overlap, and rise from there as a parabola to where
    their section ends. Wires of the two sections are ``distance`` apart at the masts in between.
    Names of the second section end in ``_next``.
    """
    masts = line.support_positions
    first, last = masts[overlap.first], masts[overlap.first + overlap.n_spans]
    middle = 0.5 * (first + last)
    sideways = np.zeros(masts.size)
    sideways[overlap.first : overlap.first + overlap.n_spans + 1] = 0.5 * overlap.distance
    earlier = _Section(line, (masts[0], last), sideways, lambda name: name)
    later = _Section(line, (first, masts[-1]), -sideways, of_next)
    ended = [_rising(wire, end=last, middle=middle, rise=overlap.rise) for wire in earlier.wires()]
    begun = [_begun(wire, first, middle, overlap.rise) for wire in later.wires()]
    order = sorted((*ended, *begun), key=lambda wire: _place(line, wire.name))
    return Line(
        line.span_lengths,
        line.n_transition,
        line.topology,
        tuple(order),
        (*earlier.droppers(), *later.droppers()),
        (*earlier.arms(), *later.arms()),
        (*earlier.supports(), *later.supports()),
        (*earlier.clamps(), *later.clamps()),
    )


def _place(line: Line, name: str) -> int:
    """Place of a wire of either section among the line's: contact wires stay first."""
    names = [wire.name for wire in line.wires]
    return names.index(name) if name in names else names.index(name.removesuffix(of_next("")))


def _rising(wire: Wire, end: float, middle: float, rise: float) -> Wire:
    """The wire with the heights of a section that ends in an overlap."""
    if wire.profile is None:
        return wire
    wanted = wire.profile
    changed = replace(
        wanted,
        ends=(wanted.ends[0], end),
        running=(wanted.running[0], middle),
        end_rise=rise,
    )
    return _on(wire, changed)


def _begun(wire: Wire, start: float, middle: float, rise: float) -> Wire:
    """The wire with the heights of a section that begins in an overlap."""
    if wire.profile is None:
        return wire
    wanted = wire.profile
    end_rise = wanted.rise if wanted.end_rise is None else wanted.end_rise
    changed = replace(
        wanted,
        rise=rise,
        ends=(start, wanted.ends[1]),
        running=(middle, wanted.running[1]),
        end_rise=end_rise,
    )
    return _on(wire, changed)


def _on(wire: Wire, profile: Profile) -> Wire:
    pieces = tuple(
        replace(piece, z=tuple(profile.level(np.array(piece.x)).tolist())) for piece in wire.pieces
    )
    return replace(wire, pieces=pieces, profile=profile)


class _Section:
    """What of a line is between two masts, shifted sideways, under other names."""

    def __init__(
        self,
        line: Line,
        ends: tuple[float, float],
        sideways: np.ndarray,
        name: Callable[[str], str],
    ) -> None:
        self._line, self._name = line, name
        self._start, self._end = float(ends[0]), float(ends[1])
        self._sideways = sideways

    def wires(self) -> list[Wire]:
        """The wires, cut at the ends of the section."""
        found = []
        for wire in self._line.wires:
            pieces = [self._cut(wire, piece) for piece in wire.pieces if self._keeps(piece)]
            taken = tuple(part for part in wire.taken if self._inside(part[0], part[1]))
            if pieces:
                found.append(
                    replace(wire, name=self._name(wire.name), pieces=tuple(pieces), taken=taken)
                )
        return found

    def droppers(self) -> list[Droppers]:
        """Groups of droppers inside the section; those without any are left out.

        Where a clamped wire is not kept whole, its droppers hang from the wire that it is clamped
        to.
        """
        bearers = {group.lower: group.upper for group in self._line.clamps}
        kept: dict[tuple[str, str], list[tuple[float, float]]] = {}
        like = {(group.upper, group.lower): group for group in self._line.droppers}
        for group in self._line.droppers:
            for high, low in zip(group.upper_x, group.lower_x, strict=True):
                if not (self._inside(high, high) and self._inside(low, low)):
                    continue
                upper = group.upper
                if not self._passes(self._line.wire(upper), high):
                    upper = bearers[upper]
                kept.setdefault((upper, group.lower), []).append((low, high))
        groups = []
        for key, places in kept.items():
            lower_x, upper_x = zip(*sorted(places), strict=True)
            groups.append(replace(self._named(like[key]), upper_x=upper_x, lower_x=lower_x))
        return groups

    def _passes(self, wire: Wire, x: float) -> bool:
        """Whether the section has a piece of a wire at ``x`` [m]."""
        return any(self._keeps(own) and own.x[0] <= x <= own.x[-1] for own in wire.pieces)

    def arms(self) -> list[SteadyArms]:
        """Steady arms inside the section."""
        return [self._at_wire(group) for group in self._line.steady_arms]

    def supports(self) -> list[Supports]:
        """Supports inside the section."""
        return [
            replace(self._at_wire(group), holds=self._name(group.holds) if group.holds else "")
            for group in self._line.supports
        ]

    def _at_wire(self, group: _AtWire) -> _AtWire:
        """What of a group at one wire stands inside the section, with its names."""
        name, wire = self._name(group.name), self._name(group.wire)
        return replace(group, name=name, wire=wire, x=self._places(group.x))

    def clamps(self) -> list[Clamps]:
        """Clamps at the ends of pieces that the section has."""
        groups = []
        for group in self._line.clamps:
            x = tuple(place for place in group.x if self._has_end(place))
            if x:
                groups.append(replace(self._named(group), x=x))
        return groups

    def _named(self, group: _Joining) -> _Joining:
        """A group between two wires with the names of this section."""
        names = (self._name(name) for name in (group.name, group.upper, group.lower))
        name, upper, lower = names
        return replace(group, name=name, upper=upper, lower=lower)

    def _has_end(self, x: float) -> bool:
        """Whether a clamped piece that the section keeps ends at ``x`` [m]."""
        ends = [
            place
            for wire in self._line.wires
            for piece in wire.pieces
            if piece.ends[0] is End.CLAMPED and self._keeps(piece)
            for place in (piece.x[0], piece.x[-1])
        ]
        return any(abs(x - place) < _SAME_PLACE for place in ends)

    def _inside(self, first: float, last: float) -> bool:
        return self._start + _SAME_PLACE < first and last < self._end - _SAME_PLACE

    def _places(self, x: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(place for place in x if self._inside(place, place))

    def _keeps(self, piece: Piece) -> bool:
        """Clamped pieces are kept whole, others as far as they reach into the section."""
        if piece.ends[0] is End.CLAMPED:
            return self._inside(piece.x[0], piece.x[-1])
        return bool(
            piece.x[0] < self._end - _SAME_PLACE and piece.x[-1] > self._start + _SAME_PLACE
        )

    def _cut(self, wire: Wire, piece: Piece) -> Piece:
        x = np.array(piece.x)
        start, end = max(self._start, x[0]), min(self._end, x[-1])
        masts = self._line.support_positions
        x = np.unique(np.concatenate([[start], x[(x > start) & (x < end)], [end]]))
        points = piece.points(x)
        y = points[:, 1] + np.interp(x, masts, self._sideways)
        return Piece(tuple(x.tolist()), tuple(y.tolist()), tuple(points[:, 2].tolist()), piece.ends)
