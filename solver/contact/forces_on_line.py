"""Contacts of a rank, its links that switch under way, and the line's response to their forces."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from catenary.base.mpi import MPI
from catenary.solver.contact.contact_wire import Candidates, ContactWires
from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.integrators.line_state import LineState
from catenary.solver.kernels import native
from catenary.solver.linear.pieces import columns_by_pieces
from catenary.solver.linear.unit_responses import NO_COLUMNS, STRETCH, Forces, ShortColumns
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.switching_links import LinkTable, some_of
from catenary.solver.model.unknowns import LEVEL


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
        forces = Forces(unknowns[:, None], weights[:, None], law["place"], table.half_length)
        operators = line.operators.in_pieces
        self.columns = columns_by_pieces(line.responses, operators, forces, self._couple)
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


class ForceColumns:
    """Columns of A^-1 for forces on a line: of contacts, and of links that switch.

    Collective to make. Trains that run on the same line share them.

    Attributes
    ----------
    of_nodes : numbers of the columns of the contact wires' nodes, which know where theirs are
    of_links : columns for unit compensations of all links
    link_coupling : LinkCoupling, None if no link switches
    reach : how far from a force the line moves within a step [m]
    free : (n_local,) bool, whether an unknown is not held

    Parameters
    ----------
    wires : the contact wires, whose nodes get columns for this line
    links : the links of the line that are followed
    range_of_run : stretch of the contact wires that pan heads will touch [m]
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        wires: ContactWires,
        line: LineIntegrator,
        links: FollowedLinks,
        range_of_run: tuple[float, float],
    ) -> None:
        # A force on an unknown that is held, at an anchor, moves nothing.
        free = np.ones(model.n_dofs, dtype=bool)
        free[model.constrained] = False
        self.free = free[line.ownership.first : line.ownership.last]
        self.of_nodes, reach = _columns_of_nodes(wires, line, range_of_run, free)
        self.of_links = NO_COLUMNS
        self.link_coupling: LinkCoupling | None = None
        if links.table.switches:
            self.link_coupling = LinkCoupling(comm, links, line)
            self.of_links = self.link_coupling.columns
        self.reach = reach + float(links.table.half_length.max(initial=0.0))


class ForcesOnLine:
    """Contacts and links of one rank. Collective to make.

    Attributes
    ----------
    links : FollowedLinks
    link_coupling : LinkCoupling, None if no link switches
    reach : how far from a force the line moves within a step [m]
    contacts : all that kernels work on
    heights : ``heights(height, rate)`` fills in this rank's share of the wire's height [m] and of
        what the pan head meets, dw/dt + V dw/dx [m/s], at each contact; shares add up over ranks
    add_work : ``add_work(contact_force)`` adds the work of forces (n,) [N] in the step that the
        line has just completed

    Parameters
    ----------
    wires : the contact wires, whose nodes have the ``columns``
    line : whose motion forces read and change, unless another one is given
    links : the links of the line that are followed
    columns : of the line, for all places of the run
    candidates : pairs (n,) of strip and contact wire
    train_speed : V of the convective part of the gap rate [m/s]
    uses_rate : whether the contact law needs the gap rate
    work : of the contact forces; sums go on from those that it holds
    across : (3, n) what ``find_across`` fills in on rank 0, row by row what ``native.Across`` is;
        without columns if wires do not move sideways
    motion : of the line in one of several scenes
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        form: Equilibrium,
        wires: ContactWires,
        line: LineIntegrator,
        links: FollowedLinks,
        columns: ForceColumns,
        candidates: Candidates,
        train_speed: float,
        uses_rate: bool,
        across: np.ndarray,
        work: native.ContactWork,
        motion: LineState | None = None,
    ) -> None:
        motion = motion or line.motion
        self._comm, self.line = comm, line
        self.wires, self.links = wires, links
        self._free = columns.free
        self.link_coupling, self.reach = columns.link_coupling, columns.reach
        n, n_local = candidates.place.size, line.ownership.n_local
        self._across = across
        self._share_across = across if comm.size == 1 else np.zeros(across.shape)
        self.contacts = native.Contacts(
            x=candidates.place,
            touches=wires.on_wires(candidates.wire, candidates.half_length),
            wires=wires.shapes,
            columns=columns.of_nodes,
            answers=native.Answers(
                np.zeros((n, n_local)), np.zeros((n, n_local if uses_rate else 0))
            ),
            gains=native.Gains(
                train_speed, line.position_factor, line.velocity_factor, columns.reach
            ),
            motion=motion.read,
            motion_gains=motion.gains,
            followed=self.links.followed,
            link_columns=columns.of_links,
            work=work,
            sideways=_sideways_of(model, form, wires, line.ownership),
            across=native.Across(*self._share_across),
        )
        self._place = native.place.bound(self.contacts)
        self.heights = native.heights.bound(self.contacts)
        self._superpose = native.superpose.bound(self.contacts)
        self._compensate = native.compensate.bound(self.contacts)
        self._begin_work = native.begin_work.bound(self.contacts)
        self.add_work = native.add_work.bound(self.contacts)

    def place(self) -> None:
        """Look where the contacts are now, and work out the line's answer to a unit force at
        each. The line is still as it was before the step."""
        self._place()
        self._begin_work()

    def locate(self) -> None:
        """Look where the contacts are now, for heights and loads only."""
        native.locate(self.contacts.x, self.contacts.wires, self.contacts.touches)
        self._begin_work()

    @property
    def presence(self) -> np.ndarray:
        """(n,) 1 where the wire of a contact is on its strip, else 0; the records' own."""
        presence: np.ndarray = self.contacts.touches["present"]
        return presence

    def find_across(self) -> None:
        """Find where wires are across the track, and how that changes, where contacts were located.

        It is taken after a free step, without what the step's contact forces and slack droppers
        add: beside an arm h^2 / 4 times a force on some kilograms, less than 1e-4 m in steps of
        1 ms. Collective; does nothing if wires do not move sideways.
        """
        if self._across.size:
            native.find_across(self.contacts)
            if self._comm.size > 1:
                everything = self._across if self._comm.rank == 0 else None
                self._comm.Reduce(self._share_across, everything, op=MPI.SUM, root=0)

    def responder(self, share: native.Share) -> Callable[[], None]:
        """Function that fills in this rank's share of the inner problem.

        It is called after ``place`` and the free solve.

        The line must then hold the end of the step without contact forces and compensations, and
        the links their reserve there, as a free step leaves them. Links are included if they may
        switch within the share's bounds.
        """
        return native.respond.bound(self.contacts, share)

    def superpose(
        self, contact_force: np.ndarray, links: np.ndarray, compensation: np.ndarray
    ) -> None:
        """Add the line's response to contact forces and compensations to its state, and their work.

        Parameters
        ----------
        contact_force : ndarray, shape (n,)
            Contact forces, upward [N].
        links : ndarray of int, shape (m,)
            Numbers of the switched links.
        compensation : ndarray, shape (m,)
            Compensations of these links [N].
        """
        self._superpose(contact_force)
        if links.size:
            self._compensate(links, compensation)
        self.add_work(contact_force)

    def loads(
        self, contact_force: np.ndarray, compensation: np.ndarray
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Local unknowns and forces of contacts (n,) and of all followed links' compensations."""
        if self.line.ownership.n_local == 0:
            return []
        local, value = self.contacts.touches["local"], self.contacts.touches["value"]
        pushed = contact_force[:, None] * value * self._free[local]
        return [(local.ravel(), pushed.ravel()), *self.links.loads(compensation)]


def _sideways_of(
    model: Model, form: Equilibrium, wires: ContactWires, ownership: Ownership
) -> native.Sideways:
    """Lateral data of a line at rest in ``form``, empty if it has no lateral motion."""
    if form.lateral is None:
        nothing = np.zeros((0, 2))
        return native.Sideways(nothing.astype(np.int64), nothing.astype(bool), nothing)
    dofs = np.stack([model.dofs(wires.mesh_nodes, name) for name in LEVEL], axis=1)
    mine = ownership.owned(dofs)
    local = np.where(mine, dofs - ownership.first, 0).astype(np.int64)
    rest = np.stack([form.lateral.y, form.lateral.slope], axis=1)[wires.mesh_nodes]
    return native.Sideways(local, mine, rest)


def _columns_of_nodes(
    wires: ContactWires, line: LineIntegrator, range_of_run: tuple[float, float], free: np.ndarray
) -> tuple[np.ndarray, float]:
    """Columns of A^-1 for the nodes in a stretch of the wires, each with the place of its own,
    and how far off a force on them is felt [m].

    Collective; ``free`` (n_dofs,) is whether an unknown is not held.
    """
    # Places that are solved for together share their round-off. With the next ones, columns at the
    # end of a run are to the last bit those of one that goes further.
    begin, end = range_of_run[0], range_of_run[1] + STRETCH
    ranges = (wires.nodes_between(begin, end, k) for k in range(wires.n_wires))
    chosen = np.concatenate([np.arange(first, last) for first, last in ranges])
    dofs, nodes = wires.dofs[chosen][:, :, None], wires.nodes

    def put(found: ShortColumns, which: np.ndarray) -> None:
        """Enter the columns of some nodes in the table of nodes."""
        mine = chosen[which]
        nodes["begin"][mine], nodes["at"][mine] = found.start[which], found.at[which]
        nodes["width"][mine] = found.width[which]

    x, weights = wires.x[chosen], free[dofs].astype(float)
    forces = Forces(dofs, weights, x, np.zeros(x.size))
    found = columns_by_pieces(line.responses, line.operators.in_pieces, forces, put)
    return found.data, found.reach
