"""Overlaps: a line of any topology cut in tension sections, of which two run side by side there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from catenary.meshgen.line import Clamps, SteadyArms, Supports
from catenary.meshgen.topologies.line_data import (
    Course,
    FreeDroppers,
    FreeLink,
    FreeWire,
    LineData,
    Overlaps,
)
from catenary.meshgen.wires import SAME_PLACE, Section

# Attributes of groups that are names of wires and groups.
_NAMES = ("name", "wire", "upper", "lower", "holds")


def of_next(name: str) -> str:
    """Name of a wire or group of the second section, and of every other one after it."""
    return f"{name}_next"


def with_overlaps(data: LineData, overlaps: Overlaps) -> LineData:
    """The line cut into tension sections; its wires and links are listed from anchor to anchor.

    A section ends at the last mast of an overlap, and the next one begins at its first mast.
    Contact wires are level up to the middle of the overlap, and rise from there as a parabola to
    the end of their section. Wires of the two sections are ``distance`` apart at the masts in
    between. Wires of the first, third, ... section are pieces of the wires of the line; those of
    the second, fourth, ... are pieces of wires with the same names and ``_next``.
    """
    sideways = np.zeros(data.n_spans + 1)
    for first in overlaps.first:
        sideways[first : first + overlaps.n_spans + 1] = 0.5 * overlaps.distance
    own = _Sections(data, data.sections[::2], sideways, str)
    others = _Sections(data, data.sections[1::2], -sideways, of_next)
    halves = own, others
    names = [wire.name for wire in data.wires or ()]
    return replace(
        data,
        wires=tuple(half.wires[name] for name in names for half in halves if name in half.wires),
        links=(*own.links(), *others.links()),
        twins=(*own.twins(), *others.twins()),
    )


class _Sections:
    """Wires and links of a line in some of its sections, shifted sideways, under other names.

    Parameters
    ----------
    data : wires and links from anchor to anchor
    sections : ascending, without overlap
    sideways : (n_masts,) shift of the wires [m]
    name : name of a wire or group, given that in the line
    """

    def __init__(
        self,
        data: LineData,
        sections: tuple[Section, ...],
        sideways: np.ndarray,
        name: Callable[[str], str],
    ) -> None:
        self._data, self._sections, self._name = data, sections, name
        self._starts, self._ends = np.array([section.ends for section in sections]).T
        self._shift = Course(tuple(data.support_positions.tolist()), tuple(sideways.tolist()))
        cut = {wire.name: self._cut(wire) for wire in data.wires or ()}
        # By their names in the line.
        self.wires = {before: wire for before, wire in cut.items() if wire.stretches}

    def _cut(self, wire: FreeWire) -> FreeWire:
        """Part of a wire inside the sections: clamped pieces are kept whole, others cut."""
        stretches = np.array(wire.stretches)
        if all(wire.clamped_to):
            stretches = stretches[self._inside(*stretches.T)]
        else:
            low = np.maximum.outer(stretches[:, 0], self._starts).ravel()
            high = np.minimum.outer(stretches[:, 1], self._ends).ravel()
            stretches = np.column_stack([low, high])[high - low > SAME_PLACE]
        lateral = wire.lateral
        if lateral is not None:
            x = np.union1d(lateral.x, self._shift.x)
            lateral = Course(tuple(x.tolist()), tuple((lateral.at(x) + self._shift.at(x)).tolist()))
        start, end = (self._name(bearer) if bearer else "" for bearer in wire.clamped_to)
        return replace(
            wire,
            name=self._name(wire.name),
            stretches=tuple((low, high) for low, high in stretches.tolist()),
            lateral=lateral,
            clamped_to=(start, end),
            clamps=self._name(wire.clamps) if wire.clamps else "",
            sections=self._sections,
        )

    def _inside(self, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        """Whether stretches from ``low`` to ``high`` are inside one section [m]."""
        which = np.searchsorted(self._starts, low - SAME_PLACE) - 1
        return np.asarray((which >= 0) & (high < self._ends[which] - SAME_PLACE))

    def links(self) -> list[FreeLink]:
        """Droppers, arms, supports and clamps inside the sections."""
        placed = [link for link in self._data.links or () if not isinstance(link, FreeDroppers)]
        return [*self._droppers(), *(self._kept(link) for link in placed)]

    def _kept(self, group: SteadyArms | Supports | Clamps) -> FreeLink:
        """Part of a group that stands inside the sections, with its names there."""
        x = np.array(group.x)
        changes: dict[str, Any] = {"x": tuple(x[self._inside(x, x)].tolist())}
        for part in _NAMES:
            if getattr(group, part, ""):
                changes[part] = self._name(getattr(group, part))
        return replace(group, **changes)

    def _droppers(self) -> list[FreeDroppers]:
        """Groups of droppers inside the sections; those without any are left out.

        Where a clamped wire is not kept whole, its droppers hang from the wire that it is clamped
        to.
        """
        groups = [link for link in self._data.links or () if isinstance(link, FreeDroppers)]
        like = {(group.upper, group.lower): group for group in groups}
        bearers = {wire.name: wire.clamped_to[0] for wire in self._data.wires or ()}
        kept: dict[tuple[str, str], list[list[float]]] = {}
        for group in groups:
            places = np.column_stack([group.lower_x, group.upper_x, group.pre_sag])
            low, high = places.T[:2]
            inside = self._inside(high, high) & self._inside(low, low)
            wire = self.wires.get(group.upper)
            passes = np.zeros(high.size, dtype=bool) if wire is None else wire.passes(high)
            for bearer, here in ((group.upper, passes), (bearers[group.upper], ~passes)):
                if (inside & here).any():
                    kept.setdefault((bearer, group.lower), []).extend(
                        places[inside & here].tolist()
                    )
        found = []
        for pair, hung in kept.items():
            lower_x, upper_x, pre_sag = zip(*sorted(hung), strict=True)
            upper, lower = map(self._name, pair)
            name = self._name(like[pair].name)
            found.append(
                FreeDroppers(name, like[pair].kind, upper, lower, upper_x, lower_x, pre_sag)
            )
        return found

    def twins(self) -> list[tuple[str, str]]:
        """Pairs of wires side by side. Both are cut at the same places and exist together."""
        pairs = [pair for pair in self._data.twins if self.wires.keys() >= set(pair)]
        return [(self._name(one), self._name(other)) for one, other in pairs]
