"""This rank's part of what acts on the line: contacts, droppers, and the answer to their forces."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.solver import compliance, kernels
from catenary.solver.contact import ContactWire, Touches
from catenary.solver.equilibrium import Equilibrium
from catenary.solver.line_motion import LineMotion
from catenary.solver.model import Model
from catenary.solver.response import LineResponse


class Droppers:
    """The droppers that this rank owns, with their tension as if they could push.

    Those that are broken take no part; they are only shown, carrying nothing.

    Attributes
    ----------
    shown : numbers in the mesh of all that this rank owns, those that are broken included
    shown_ends, shown_laws : ``ends`` and ``laws`` of those
    numbers : (n,) numbers in the mesh of those that may carry
    ends : (n, 2) local unknowns of their upper and lower ends
    laws : (n, 4) force at rest [N], stiffness [N/m], damping [N s/m], place along the track [m]
    latest_tension : (n,) what was found last, here or by a free step of the line [N]
    """

    def __init__(self, model: Model, form: Equilibrium, line: LineMotion) -> None:
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
                model.dropper_damping[mine],
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
        line.look_at(self.ends, self.laws, self.latest_tension)

    def tension(self) -> np.ndarray:
        """Tension in the line's present motion [N], shape (n,), overwritten by the next call."""
        line = self._line
        kernels.tension(line.motion.read, self.ends, self.laws, self.latest_tension)
        return self.latest_tension

    def energy_of_pushing(self) -> float:
        """Elastic energy that the owned droppers would hold by pushing, were they springs [J]."""
        upper, lower = self.ends.T
        displacement = self._line.displacement
        stretch = displacement[upper] - displacement[lower]
        rest, stiffness = self.laws[:, 0], self.laws[:, 1]
        pushing = np.minimum(rest + stiffness * stretch, 0.0)
        return float((pushing**2 / (2.0 * stiffness)).sum())

    def near(self, x: float, distance: float) -> slice:
        """The droppers within ``distance`` of ``x`` [m]."""
        low, high = self.x.searchsorted([x - distance, x + distance])
        return slice(int(low), int(high))


class Interaction:
    """Contacts and droppers of one rank. Collective to make.

    Parameters
    ----------
    range_of_run : stretch of the contact wire that pan heads will touch [m]
    n_contacts : number of strips that may touch the wire
    train_speed : V of the convective part of the gap rate [m/s]
    uses_rate : whether the contact law needs the gap rate
    may_slacken : whether droppers slacken
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        form: Equilibrium,
        line: LineMotion,
        range_of_run: tuple[float, float],
        n_contacts: int,
        train_speed: float,
        uses_rate: bool,
        may_slacken: bool,
    ) -> None:
        self.line = line
        self.wire = ContactWire(model, form, line.ownership)
        self.droppers = Droppers(model, form, line)
        self._speed = train_speed
        self._uses_rate = uses_rate
        self._may_slacken = may_slacken
        first, last = self.wire.nodes_between(*range_of_run)
        self._first_node = first
        dofs = self.wire.dofs[first:last].reshape(-1, 1)
        at = np.repeat(self.wire.x[first:last], 2)
        # A force on an unknown that is held, at an anchor, moves nothing.
        free = np.ones(model.n_dofs)
        free[model.constrained] = 0.0
        self._free = free[line.ownership.first : line.ownership.last]
        columns = compliance.compute(
            comm, line.operators.solve_for, line.ownership, line.windows, dofs, free[dofs], at
        )
        # Both unknowns of a node share a window; their columns stand one after the other.
        packed = columns.packed()
        self._node_start = packed.start[0::2].copy()
        self._node_offset = packed.offset[0::2].copy()
        self._node_columns = packed.data
        self._dropper_columns = compliance.ShortColumns(np.zeros(0, np.int64), []).packed()
        self.slack_coupling: SlackCoupling | None = None
        if may_slacken:
            ends = model.dofs(model.mesh.droppers)
            dropper_columns = compliance.compute(
                comm,
                line.operators.solve_for,
                line.ownership,
                line.windows,
                ends,
                np.broadcast_to(np.array([1.0, -1.0]), ends.shape),
                model.mesh.x(model.mesh.droppers[:, 1]),
            )
            self.slack_coupling = SlackCoupling(comm, model, self.droppers, dropper_columns, line)
            self._dropper_columns = dropper_columns.packed()
        shape = (n_contacts, line.ownership.n_local)
        self._answers = np.zeros(shape)
        self._filled = np.zeros((n_contacts, 2), dtype=np.int64)
        self._slope_answers = np.zeros(shape if uses_rate else (n_contacts, 0))
        self._slope_filled = np.zeros((n_contacts, 2), dtype=np.int64)

    def place(self, touches: Touches) -> None:
        """Work out the line's answer to a unit force at each touch."""
        self._combine(touches.element, touches.whole_value, self._answers, self._filled)
        if self._uses_rate:
            self._combine(
                touches.element, touches.whole_slope, self._slope_answers, self._slope_filled
            )

    def heights(self, touches: Touches, height: np.ndarray, rate: np.ndarray) -> None:
        """Fill in this rank's share of wire height [m] and its total rate [m/s] at each touch.

        The total rate is what the pan head meets: dw/dt + V dw/dx. Shares add up over the ranks.
        """
        kernels.heights(
            self.line.motion.read,
            touches.local,
            touches.value,
            touches.slope,
            touches.rest,
            self._speed,
            height,
            rate,
        )

    def respond(
        self, touches: Touches, force_bound: np.ndarray, margin: float, response: LineResponse
    ) -> None:
        """Fill in this rank's share of the inner problem, after ``place`` and the free solve.

        The line must hold the end of the step without contact forces and with all droppers taut,
        and the droppers their tension there, as a free step leaves them.
        Droppers are included if their tension may fall below ``margin`` [N] under contact
        forces up to ``force_bound`` (n,) [N].
        """
        line, droppers = self.line, self.droppers
        count = kernels.respond(
            line.motion.read,
            touches.local,
            touches.value,
            touches.slope,
            touches.rest,
            touches.x,
            self._speed,
            self._answers,
            self._slope_answers,
            self._uses_rate,
            line.position_factor,
            line.velocity_factor,
            line.windows.reach,
            force_bound,
            margin,
            droppers.numbers,
            droppers.ends,
            droppers.laws,
            self._may_slacken,
            droppers.latest_tension,
            response.height,
            response.rate,
            response.height_by_force,
            response.rate_by_force,
            response.rows,
        )
        response.put_count(count)

    def superpose(
        self, contact_force: np.ndarray, droppers: np.ndarray, compensation: np.ndarray
    ) -> None:
        """Add the answer to contact forces (n,) and compensations (m,) [N] to the line's state."""
        line, columns = self.line, self._dropper_columns
        kernels.superpose(
            contact_force,
            self._answers,
            self._filled,
            droppers,
            compensation,
            columns.start,
            columns.offset,
            columns.data,
            line.motion.read,
            line.motion.gains,
        )

    def loads(
        self, touches: Touches, contact_force: np.ndarray, compensation: np.ndarray
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Local unknowns and forces of contacts (n,) and of all owned droppers' compensations."""
        result = []
        if self.line.ownership.n_local == 0:
            return []
        for local, value, force in zip(touches.local, touches.value, contact_force, strict=True):
            if force:
                result.append((local, force * value * self._free[local]))
        slack = np.flatnonzero(compensation)
        if slack.size:
            upper, lower = self.droppers.ends[slack].T
            result.append((upper, -compensation[slack]))
            result.append((lower, compensation[slack]))
        return result

    def _combine(
        self, elements: np.ndarray, weights: np.ndarray, answers: np.ndarray, filled: np.ndarray
    ) -> None:
        kernels.combine(
            elements,
            weights,
            self._first_node,
            self._node_start,
            self._node_offset,
            self._node_columns,
            answers,
            filled,
        )


class SlackCoupling:
    """How the compensation of one dropper changes the tension of another, on rank 0.

    Collective to make. G_de = (k sigma + c tau)_d L_d^T A^-1 L_e [-].

    Attributes
    ----------
    n_droppers : of the whole line
    band : (n_droppers, 2 half + 1): ``band[e, d - e + half]`` is G_de; None on other ranks
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        droppers: Droppers,
        columns: compliance.ShortColumns,
        line: LineMotion,
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
        self.n_droppers = n
