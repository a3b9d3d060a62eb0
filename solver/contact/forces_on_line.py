"""Contacts and droppers of this rank, and the line's response to their forces."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from catenary.solver.base.bound import bound
from catenary.solver.contact import contact_kernels
from catenary.solver.contact.contact_kernels import TOUCH
from catenary.solver.contact.contact_wire import ContactWire
from catenary.solver.contact.line_response import LineResponse
from catenary.solver.integrators import state_kernels
from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.linear import unit_responses
from catenary.solver.model.model import Model
from catenary.solver.statics.equilibrium import Equilibrium


class Droppers:
    """The droppers that this rank owns, with their tension as if they could push.

    Those that are broken take no part; they are only shown, carrying nothing. Of dampers that go on
    acting when springs are slack nothing is here: they are a part of the line's damping.

    Attributes
    ----------
    shown : numbers in the mesh of all that this rank owns, those that are broken included
    shown_ends, shown_laws : ``ends`` and ``laws`` of those
    numbers : (n,) numbers in the mesh of those that may carry
    ends : (n, 2) local unknowns of their upper and lower ends
    laws : (n, 4) force at rest [N], stiffness [N/m], damping that goes slack with it [N s/m], place
        along the track [m]
    latest_tension : (n,) what was found last, here or by a free step of the line [N]
    """

    def __init__(self, model: Model, form: Equilibrium, line: LineIntegrator) -> None:
        ends = model.dofs(model.mesh.droppers)
        mine = line.ownership.owned(ends[:, 0])
        self.shown = np.flatnonzero(mine)
        intact = ~model.broken[mine]
        self.numbers = self.shown[intact]
        x = model.mesh.x(model.mesh.droppers[mine, 1])
        self.shown_ends = (ends[mine] - line.ownership.first).astype(np.int64)
        self.shown_laws = np.column_stack(
            [
                np.where(intact, form.dropper_force[mine], 0.0),
                model.dropper_stiffness[mine],
                model.released_damping[mine],
                x,
            ]
        )
        self.x, self.ends = x[intact], self.shown_ends[intact]
        self.laws = self.shown_laws[intact]
        _, stiffness, damping, _ = self.laws.T
        # Change of tension per unit of relative acceleration within the step.
        self.per_acceleration = stiffness * line.position_factor + damping * line.velocity_factor
        self.latest_tension = np.zeros(self.numbers.size)
        self._line = line
        line.track_droppers(self.ends, self.laws, self.latest_tension)

    def tension(self) -> np.ndarray:
        """Tension in the line's present motion [N], shape (n,), overwritten by the next call."""
        line = self._line
        state_kernels.tension(line.motion.read, self.ends, self.laws, self.latest_tension)
        return self.latest_tension

    def energy_of_pushing(self) -> float:
        """Elastic energy that the owned droppers would hold by pushing, were they springs [J]."""
        return float(state_kernels.energy_of_pushing(self._line.motion.read, self.ends, self.laws))

    def near(self, x: float, distance: float) -> slice:
        """The droppers within ``distance`` of ``x`` [m]."""
        low, high = self.x.searchsorted([x - distance, x + distance])
        return slice(int(low), int(high))


class ForcesOnLine:
    """Contacts and droppers of one rank. Collective to make.

    Attributes
    ----------
    placing : arguments of ``contact_kernels.place``
    superposing, compensating : of ``superpose`` and ``compensate`` after the forces

    Parameters
    ----------
    range_of_run : stretch of the contact wire that pan heads will touch [m]
    contact_place : (n,) where strips may touch the wire [m], kept by reference
    train_speed : V of the convective part of the gap rate [m/s]
    uses_rate : whether the contact law needs the gap rate
    may_slacken : whether droppers slacken
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        form: Equilibrium,
        line: LineIntegrator,
        range_of_run: tuple[float, float],
        contact_place: np.ndarray,
        train_speed: float,
        uses_rate: bool,
        may_slacken: bool,
    ) -> None:
        self.line = line
        self.wire = ContactWire(model, form, line.ownership)
        self.droppers = Droppers(model, form, line)
        self._speed = train_speed
        # A force on an unknown that is held, at an anchor, moves nothing.
        free = np.ones(model.n_dofs)
        free[model.constrained] = 0.0
        self._free = free[line.ownership.first : line.ownership.last]
        node_columns = self._columns_of_nodes(comm, range_of_run, free)
        dropper_columns = unit_responses.ShortColumns(np.zeros(0, np.int64), [])
        self.slack_coupling: SlackCoupling | None = None
        if may_slacken:
            dropper_columns = self._columns_of_droppers(comm, model)
            self.slack_coupling = SlackCoupling(comm, model, self.droppers, dropper_columns, line)
        n, n_local = contact_place.size, line.ownership.n_local
        self._contact_place = contact_place
        self._touches = np.zeros(n, dtype=TOUCH)
        self._answers = np.zeros((n, n_local))
        self._slope_answers = np.zeros((n, n_local if uses_rate else 0))
        touched = self._touches, self._answers, self._slope_answers
        self.placing = contact_place, self.wire.nodes, node_columns, *touched
        self._place = bound(contact_kernels.place, *self.placing)
        motion = line.motion.read, line.motion.gains
        self._force = np.zeros(n)
        self.superposing = self._answers, self._touches, *motion
        self._superpose = bound(contact_kernels.superpose, self._force, *self.superposing)
        self.compensating = (*dropper_columns.packed(), *motion)

    def place(self) -> None:
        """Look where the contacts are now, and work out the line's answer to a unit force at
        each."""
        self._place()

    def locate(self) -> None:
        """Look where the contacts are now, for heights and loads only."""
        contact_kernels.locate(self._contact_place, self.wire.nodes, self._touches)

    def heights(self, height: np.ndarray, rate: np.ndarray) -> None:
        """Fill in this rank's share of wire height [m] and its total rate [m/s] at each contact.

        The total rate is what the pan head meets: dw/dt + V dw/dx. Shares add up over the ranks.
        """
        contact_kernels.heights(self.line.motion.read, self._touches, self._speed, height, rate)

    def responder(self, response: LineResponse) -> Callable[[], None]:
        """What fills in this rank's share of the inner problem, after ``place`` and the free solve.

        The line must then hold the end of the step without contact forces and with all droppers
        taut, and the droppers their tension there, as a free step leaves them. Droppers are
        included if their tension may fall below the response's margin under contact forces up to
        its limits.
        """
        return bound(contact_kernels.respond, *self.responding(response))

    def responding(self, response: LineResponse) -> tuple[Any, ...]:
        """Arguments of ``contact_kernels.respond``."""
        line, droppers = self.line, self.droppers
        return (
            line.motion.read,
            self._touches,
            self._speed,
            line.position_factor,
            line.velocity_factor,
            line.windows.reach,
            self._answers,
            self._slope_answers,
            response.limits,
            droppers.numbers,
            droppers.ends,
            droppers.laws,
            droppers.latest_tension,
            response.summed,
            response.rows,
        )

    def superpose(
        self, contact_force: np.ndarray, droppers: np.ndarray, compensation: np.ndarray
    ) -> None:
        """Add the answer to contact forces (n,) and compensations (m,) [N] to the line's state."""
        self._force[:] = contact_force
        self._superpose()
        if droppers.size:
            contact_kernels.compensate(droppers, compensation, *self.compensating)

    def loads(
        self, contact_force: np.ndarray, compensation: np.ndarray
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Local unknowns and forces of contacts (n,) and of all owned droppers' compensations."""
        result = []
        if self.line.ownership.n_local == 0:
            return []
        for touch, force in zip(self._touches, contact_force, strict=True):
            local, value = touch["local"], touch["value"]
            if force:
                result.append((local, force * value * self._free[local]))
        slack = np.flatnonzero(compensation)
        if slack.size:
            upper, lower = self.droppers.ends[slack].T
            result.append((upper, -compensation[slack]))
            result.append((lower, compensation[slack]))
        return result

    def _columns_of_nodes(
        self, comm: Any, range_of_run: tuple[float, float], free: np.ndarray
    ) -> np.ndarray:
        """Columns of A^-1 for the nodes in a stretch of the wire, each with the place of its own.

        Collective; ``free`` (n_dofs,) is zero for the unknowns that are held.
        """
        line = self.line
        first, last = self.wire.nodes_between(*range_of_run)
        dofs = self.wire.dofs[first:last].reshape(-1, 1)
        at = np.repeat(self.wire.x[first:last], 2)
        packed = unit_responses.compute(
            comm, line.operators.solve_for, line.ownership, line.windows, dofs, free[dofs], at
        ).packed()
        # Both unknowns of a node share a window; their columns stand one after the other.
        nodes, offset = self.wire.nodes[first:last], packed.offset[0::2]
        nodes["begin"], nodes["at"] = packed.start[0::2], offset[:-1]
        nodes["width"] = np.diff(offset) // 2
        return packed.data

    def _columns_of_droppers(self, comm: Any, model: Model) -> unit_responses.ShortColumns:
        """Columns of A^-1 for unit compensations of all droppers. Collective."""
        line, ends = self.line, model.dofs(model.mesh.droppers)
        return unit_responses.compute(
            comm,
            line.operators.solve_for,
            line.ownership,
            line.windows,
            ends,
            np.broadcast_to(np.array([1.0, -1.0]), ends.shape),
            model.mesh.x(model.mesh.droppers[:, 1]),
        )


class SlackCoupling:
    """How the compensation of one dropper changes the tension of another, on rank 0.

    Collective to make. G_de = (k sigma + c tau)_d L_d^T A^-1 L_e [-], c being what is released.

    Attributes
    ----------
    band : (n_droppers, 2 half + 1): ``band[e, d - e + half]`` is G_de; None on other ranks
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        droppers: Droppers,
        columns: unit_responses.ShortColumns,
        line: LineIntegrator,
    ) -> None:
        x = model.mesh.x(model.mesh.droppers[:, 1])
        n = x.size
        far = np.searchsorted(x, x + line.windows.reach, side="right") - 1 - np.arange(n)
        half = int(far.max(initial=0))
        band = np.zeros((n, 2 * half + 1))
        scratch = np.zeros(line.ownership.n_local)
        for e in range(n):
            values = columns.values[e]
            if values.size == 0:
                continue
            filled = slice(int(columns.start[e]), int(columns.start[e]) + values.size)
            scratch[filled] = values
            near = droppers.near(x[e], line.windows.reach)
            upper, lower = droppers.ends[near].T
            spread = scratch[upper] - scratch[lower]
            offset = droppers.numbers[near] - e + half
            inside = (offset >= 0) & (offset < band.shape[1])
            band[e, offset[inside]] = (droppers.per_acceleration[near] * spread)[inside]
            scratch[filled] = 0.0
        self.band = comm.reduce(band, root=0) if comm.size > 1 else band
