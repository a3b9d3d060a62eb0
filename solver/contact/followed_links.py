"""Links that switch under way: those of a rank, and how they act on each other."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.kernels import native
from catenary.solver.linear.pieces.column_pieces import columns_of
from catenary.solver.linear.unit_responses import ShortColumns
from catenary.solver.model.switching_links import LinkTable, some_of


class FollowedLinks:
    """Links that this rank owns, and their reserve: for droppers the tension if they could push.

    Broken links are recorded with zero force and otherwise left out. So are dampers that act while
    their springs are slack: these are a part of the line's damping.

    Attributes
    ----------
    table : LinkTable of the whole line
    local : native.Links of the whole table, with local unknowns, of which other ranks own some
    numbers : (n,) numbers in the table of the owned, unbroken links that are no dependents
    links : native.Links of these, with local unknowns
    dependents, dependent_numbers : native.Dependents of these links, and their numbers (m,) in the
        table
    reserve : (n,) latest reserve, computed here or by a free step of the line [N]
    moving : (2,) first of the ``links`` that may switch and the one after the last; all of them
        without a window
    """

    def __init__(self, table: LinkTable, line: LineIntegrator) -> None:
        self.table = table
        mine = line.ownership.owned(table.arrays.unknowns[:, 0])
        self._mine = mine
        unknowns, weights, law = table.arrays
        self.local = native.Links(unknowns - line.ownership.first, weights, law.copy())
        self.numbers = np.flatnonzero(mine & ~table.broken & ~table.is_dependent)
        self.links = some_of(self.local, self.numbers)
        self.dependent_numbers = np.flatnonzero(mine & ~table.broken & table.is_dependent)
        leaders = table.leader[self.dependent_numbers]
        ends = np.append(self.numbers, table.leader.size)
        self.dependents = native.Dependents(
            some_of(self.local, self.dependent_numbers), np.searchsorted(leaders, ends)
        )
        self._leader = np.searchsorted(self.numbers, leaders)
        self._released = self.links.law["released"].copy()
        self.reserve = np.zeros(self.numbers.size)
        self.moving = np.array([0, self.numbers.size], dtype=np.int64)
        self._line = line
        line.track_links(self.links, self.reserve)

    def take_law(self, law: np.ndarray) -> None:
        """Take the laws (n,) of the links of the whole line, which are the same but for reserves at
        rest. Not collective."""
        self.local.law[:] = law
        self.links.law[:], self.dependents.links.law[:] = (
            law[self.numbers],
            law[self.dependent_numbers],
        )

    @property
    def followed(self) -> native.Followed:
        """Followed links as kernels take them."""
        links = self.numbers, self.links, self.reserve, self.moving
        return native.Followed(*links, self.dependents, self.dependent_numbers)

    def shown(self, component: str) -> tuple[np.ndarray, native.Links, native.Dependents]:
        """Numbers among those of its component, and arrays, of all links that this rank owns,
        broken ones included, and what bends of these add to their forces."""
        numbers = self.table.of_component(component)
        numbers = numbers[self._mine[numbers]]
        bends, begin = self.table.bends_of(numbers)
        add = some_of(self.local, bends)
        add.law["released"] *= self.table.pulls[bends]
        return (
            self.table.index[numbers],
            some_of(self.local, numbers),
            native.Dependents(add, begin),
        )

    def find_reserve(self) -> np.ndarray:
        """Reserve in the line's present motion [N], shape (n,), overwritten by the next call."""
        self._find_reserve()
        return self.reserve

    @cached_property
    def _find_reserve(self) -> Callable[[], None]:
        return native.reserves.bound(self._line.motion.read, self.links, self.reserve)

    @cached_property
    def _across(self) -> tuple[np.ndarray, Callable[[], None]]:
        """Reserve of dependents, and what finds it."""
        found = np.zeros(self.dependent_numbers.size)
        motion = self._line.motion.read
        return found, native.reserves.bound(motion, self.dependents.links, found)

    def compensation(self) -> np.ndarray:
        """Compensations of links, then of dependents, in the line's present motion [N], (n + m,).

        By equation (2.7) of the paper."""
        reserve = self.find_reserve()
        own = self._released * np.maximum(0.0, -reserve)
        if not self.dependent_numbers.size:
            return np.asarray(own)
        across, find = self._across
        find()
        carries = self.dependents.links.law["released"] * (reserve[self._leader] < 0.0)
        return np.concatenate([own, -carries * across])

    def energy_of_switching(self, displacement: np.ndarray, begin: int, end: int) -> float:
        """Elastic energy of switched links beyond the quadratic form of K [J], of this rank.

        It is negative for slack droppers, which store less than K assigns to them, and positive for
        closed stops; dampers store none. ``displacement`` (n_local,) is the line's [m], [rad]; the
        sum runs over the links from ``begin`` to before ``end``.
        """
        links = self.links, self.dependents
        return float(native.energy_of_switching(displacement, *links, begin, end))

    def loads(self, compensation: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Local unknowns and forces of compensations (n,) [N] of all of them, or (n + m,) with
        dependents."""
        found = []
        for part, links in zip(
            np.split(compensation, [self.numbers.size]),
            (self.links, self.dependents.links),
            strict=True,
        ):
            acting = np.flatnonzero(part)
            if acting.size:
                forces = -part[acting][:, None] * links.weights[acting]
                found.append((links.unknowns[acting].ravel(), forces.ravel()))
        return found


def no_links() -> native.Coupled:
    """A line without links that switch."""
    none = np.zeros(0)
    return native.Coupled(np.zeros((0, 1)), none, none > 0.0, np.zeros(0, dtype=np.int64), none)


class LinkCoupling:
    """Change of the reserve of one link by the compensation of another, on rank 0.

    Collective to make. G_de = (k sigma + c tau)_d L_d^T A^-1 L_e [-], k and c being those of the
    reserve.

    Attributes
    ----------
    columns : of A^-1 for unit compensations of all links
    coupled : ``native.Coupled``, whose band are the G_de; without any link on other ranks
    """

    def __init__(self, comm: Any, followed: FollowedLinks, line: LineIntegrator) -> None:
        self.coupled = no_links()
        self._followed, table = followed, followed.table
        unknowns, weights, law = table.arrays
        self._per_acceleration = np.zeros(law.size)
        owned = np.concatenate([followed.numbers, followed.dependent_numbers])
        own = law[owned]
        self._per_acceleration[owned] = own["stiffness"] * line.position_factor
        self._per_acceleration[owned] += own["damping"] * line.velocity_factor
        self._band: np.ndarray | None = None
        places = unknowns[:, None], weights[:, None], law["place"], table.half_length
        operators = line.operators.in_pieces
        self.columns = columns_of(line.responses, operators, places, self._couple)
        band = self._band_of(self.columns)
        if comm.size > 1:
            band = comm.reduce(band, root=0)
        if band is not None:
            released, slackens = table.arrays.law["released"].copy(), table.slackens
            behind = np.arange(law.size) - table.leader
            self.coupled = native.Coupled(band, released, slackens, behind, np.zeros(law.size))

    def _band_of(self, columns: ShortColumns) -> np.ndarray:
        """The array of the G_de, zero until their columns are there."""
        if self._band is None:
            x = self._followed.table.arrays.law["place"]
            far = np.searchsorted(x, x + self._distance(columns), side="right") - 1
            half = int((far - np.arange(x.size)).max(initial=0))
            self._band = np.zeros((x.size, 2 * half + 1))
        return self._band

    def _distance(self, columns: ShortColumns) -> float:
        """Distance up to which links are coupled [m]."""
        return float(columns.reach + 2.0 * self._followed.table.half_length.max(initial=0.0))

    def _couple(self, columns: ShortColumns, which: np.ndarray) -> None:
        """Work out the G_de of the links e ``which`` have their columns now."""
        unknowns, weights, law = self._followed.local
        x, band = law["place"], self._band_of(columns)
        distance, half = self._distance(columns), band.shape[1] // 2
        per_acceleration = self._per_acceleration
        for apart in range(-half, half + 1):
            # Links e whose compensation acts on the link that is so many further.
            e = which[(which + apart >= 0) & (which + apart < x.size)]
            d = e + apart
            seen = unknowns[d] - columns.start[e, None]
            inside = (seen >= 0) & (seen < columns.width[e, None])
            at = np.where(inside, columns.at[e, None] + seen, 0)
            answer = np.where(inside, columns.data[at] if columns.data.size else 0.0, 0.0)
            near = per_acceleration[d] * (np.abs(x[d] - x[e]) <= distance)
            band[e, apart + half] = near * (weights[d] * answer).sum(axis=1)
