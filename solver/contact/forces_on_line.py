"""Contacts and links of this rank, and the line's response to their forces."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from catenary.base.mpi import MPI
from catenary.solver.contact.contact_wire import Candidates, ContactWires
from catenary.solver.contact.followed_links import FollowedLinks, LinkCoupling
from catenary.solver.contact.line_response import LineResponse
from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.integrators.line_state import LineState
from catenary.solver.kernels import native
from catenary.solver.linear.pieces.column_pieces import columns_of
from catenary.solver.linear.unit_responses import NO_COLUMNS, STRETCH, ShortColumns
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.statics.form_finding.equilibrium import Equilibrium


def _sideways_of(
    model: Model, form: Equilibrium, wires: ContactWires, ownership: Ownership
) -> native.Sideways:
    """Lateral data of a line at rest in ``form``, empty if it has no lateral motion."""
    if form.lateral is None:
        nothing = np.zeros((0, 2))
        return native.Sideways(nothing.astype(np.int64), nothing.astype(bool), nothing)
    dofs = np.stack([model.dofs(wires.mesh_nodes, name) for name in ("v", "theta_z")], axis=1)
    mine = ownership.owned(dofs)
    local = np.where(mine, dofs - ownership.first, 0).astype(np.int64)
    rest = np.stack([form.lateral.y, form.lateral.slope], axis=1)[wires.mesh_nodes]
    return native.Sideways(local, mine, rest)


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

    def responder(self, response: LineResponse) -> Callable[[], None]:
        """Function that fills in this rank's share of the inner problem.

        It is called after ``place`` and the free solve.

        The line must then hold the end of the step without contact forces and compensations, and
        the links their reserve there, as a free step leaves them. Links are included if they may
        switch within the response's bounds.
        """
        return native.respond.bound(self.contacts, response.share)

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

    places = dofs, free[dofs].astype(float), wires.x[chosen]
    found = columns_of(line.responses, line.operators.in_pieces, places, put)
    return found.data, found.reach
