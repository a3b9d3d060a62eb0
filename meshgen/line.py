"""The line as an engineer describes it: masts, wires by name and role, what hangs between them.

SI units, no mesh yet. Axes: x along the track from the first anchor, y lateral, z up from the top
of rail. Which wires a line has is decided by its topology (``catenary.meshgen.topologies``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from catenary.meshgen.hardware import Clamps, Droppers, Fittings, SteadyArms, Supports
from catenary.meshgen.track import Curve, Spans, read_only
from catenary.meshgen.wires import SAME_PLACE, Profile, Role, Wire


class DropperPlace(NamedTuple):
    """Lower end of a dropper along the track [m], and which one it is, from 0, of those that twin
    wires, or the wires of two tension sections, have there."""

    x: float
    nth: int = 0


def droppers_at(x: np.ndarray, places: Sequence[DropperPlace]) -> np.ndarray:
    """Numbers of the droppers that stand nearest to places, (n_places,) int.

    ``x`` are the lower ends of all droppers, (n_droppers,) [m], in the order of a mesh.
    """
    found = np.zeros(len(places) if x.size else 0, dtype=np.int64)
    for number, (place, nth) in enumerate(places[: found.size]):
        away = np.abs(x - place)
        there = np.flatnonzero(away <= away.min() + SAME_PLACE)
        found[number] = there[min(nth, there.size - 1)]
    return found


@dataclass(frozen=True)
class Line(Spans):
    """A line: masts, wires, and the groups of what hangs between them and stands under them.

    Attributes
    ----------
    topology : name of what made it
    wires : from the contact wires upwards
    droppers, steady_arms, supports, clamps : groups
    curve : of the track, None if it is straight; lateral positions count from the track's middle
    twins : pairs of like wires side by side: the second one of each, and the first one
    fittings : insulators and the like on wires, which no mesh file has

    Raises ValueError if names occur twice, a group names no wire, or droppers hang a wire without
    wanted heights: a topology that makes such a line is wrong.
    """

    topology: str
    wires: tuple[Wire, ...]
    droppers: tuple[Droppers, ...]
    steady_arms: tuple[SteadyArms, ...]
    supports: tuple[Supports, ...]
    clamps: tuple[Clamps, ...] = ()
    fittings: tuple[Fittings, ...] = ()
    curve: Curve | None = None
    twins: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        wires = {wire.name for wire in self.wires}
        groups = [*self.droppers, *self.hardware, *self.clamps]
        names = [wire.name for wire in self.wires] + [group.name for group in groups]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"topology {self.topology}: two parts have the name {twice[0]}")
        asked = {part.wire for part in self.hardware}
        asked |= {part.holds for part in self.supports if part.holds}
        asked |= {wire for part in self.droppers for wire in (part.upper, part.lower)}
        asked |= {wire for part in self.clamps for wire in (part.upper, part.lower)}
        asked |= {wire for pair in self.twins for wire in pair}
        unknown = sorted(asked - wires)
        if unknown:
            raise ValueError(f"topology {self.topology}: there is no wire {unknown[0]}")
        for part in self.droppers:
            if self.wire(part.lower).profile is None:
                raise ValueError(
                    f"topology {self.topology}: {part.name} hang {part.lower}, which has no profile"
                )

    def wire(self, name: str) -> Wire:
        """The wire of that name; KeyError if there is none."""
        for wire in self.wires:
            if wire.name == name:
                return wire
        raise KeyError(f"the line has no wire {name}")

    @property
    def components(self) -> tuple[str, ...]:
        """Names of all wires and groups, which damping may be given for."""
        parts = (*self.wires, *self.droppers, *self.hardware, *self.clamps)
        return tuple(part.name for part in parts)

    def wires_of(self, role: Role) -> tuple[Wire, ...]:
        """The wires of a role, in the order of ``wires``."""
        return tuple(wire for wire in self.wires if wire.role is role)

    @property
    def hardware(self) -> tuple[SteadyArms | Supports, ...]:
        """Groups at single places of wires: arms, then supports."""
        return (*self.steady_arms, *self.supports)

    @property
    def clamp_group(self) -> np.ndarray:
        """Number of its group for each clamp, group by group."""
        return np.repeat(np.arange(len(self.clamps)), [len(group.x) for group in self.clamps])

    @property
    def profiles(self) -> tuple[Profile, ...]:
        """Heights wanted of the wires that droppers hang, in the order of ``wires``."""
        return tuple(wire.profile for wire in self.wires if wire.profile is not None)

    @cached_property
    def dropper_x(self) -> np.ndarray:
        """Places of the lower ends of all droppers, ascending [m]; read-only."""
        places = np.concatenate([np.zeros(0), *(group.lower_x for group in self.droppers)])
        return read_only(np.sort(places))

    def droppers_of_span(self, span: int) -> np.ndarray:
        """Places of the lower ends of a span's droppers, ascending [m]; spans count from 0."""
        masts, x = self.support_positions, self.dropper_x
        first = np.searchsorted(x, masts[span], side="right")
        return x[first : np.searchsorted(x, masts[span + 1])]

    def dropper_of_span(self, span: int, number: int) -> DropperPlace:
        """Place of a dropper by its number in a span; both count from 1."""
        x = self.droppers_of_span(span - 1)[:number]
        return DropperPlace(float(x[-1]), int((x[-1] - x[:-1] <= SAME_PLACE).sum()))

    @property
    def numbered_droppers(self) -> dict[tuple[int, int], float]:
        """Places of the droppers of all spans [m], by the span and the number in it, from 1."""
        return {
            (span + 1, number): float(x)
            for span in range(self.n_spans)
            for number, x in enumerate(self.droppers_of_span(span), start=1)
        }

    def running_spans(self, wire: Wire) -> list[int]:
        """Spans in which trains run on a wire, from support to support; they count from 0.

        Those in which it rises to an end of its section do not count. Those at an end of the wire,
        which is held otherwise than at a support, count only if there are no others.
        """
        sections = wire.profile.sections if wire.profile is not None else ()
        level = [own.running for own in sections] or [self.running_range]
        there, inner = [], []
        for span, (start, end) in enumerate(pairwise(self.support_positions.tolist())):
            within = [
                piece
                for piece in wire.pieces
                for low, high in level
                if max(low, piece.x[0]) < start + SAME_PLACE
                and end - SAME_PLACE < min(high, piece.x[-1])
            ]
            there += [span] * bool(within)
            inner += [span] * any(
                piece.x[0] < start - SAME_PLACE and end + SAME_PLACE < piece.x[-1]
                for piece in within
            )
        return inner or there

    def with_shares(self, shares: Mapping[str, float]) -> Line:
        """The line with the tensions of some wires multiplied by ``shares`` [-], by name.

        A wire that is clamped to others takes from them its own share of the tension before.
        """
        wires = (
            replace(
                wire,
                tension=shares.get(wire.name, 1.0) * wire.tension,
                taken=tuple(
                    part._replace(tension=shares.get(part.by, 1.0) * part.tension)
                    for part in wire.taken
                ),
            )
            for wire in self.wires
        )
        return replace(self, wires=tuple(wires))
