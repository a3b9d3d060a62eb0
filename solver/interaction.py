"""This rank's part of what acts on the line: contacts, droppers, and the answer to their forces."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.solver import compliance, kernels
from catenary.solver.contact import ContactWire, Touches
from catenary.solver.equilibrium import Equilibrium
from catenary.solver.inner import LineResponse
from catenary.solver.model import Model
from catenary.solver.newmark import NewmarkLine


class Droppers:
    """The droppers that this rank owns, with their tension as if they could push.

    Attributes
    ----------
    numbers : (n,) their numbers in the mesh; x : (n,) [m]
    upper, lower : (n,) local unknowns of their ends
    rest, stiffness, damping : (n,) force at rest [N], [N/m], [N s/m]
    latest_tension : (n,) what ``tension`` found last [N]
    """

    def __init__(self, model: Model, form: Equilibrium, line: NewmarkLine) -> None:
        ends = model.dofs(model.mesh.droppers)
        mine = line.ownership.owned(ends[:, 0])
        self.numbers = np.flatnonzero(mine)
        self.x = model.mesh.x(model.mesh.droppers[mine, 1])
        self.upper = ends[mine, 0] - line.ownership.first
        self.lower = ends[mine, 1] - line.ownership.first
        self.rest = form.dropper_force[mine]
        self.stiffness = model.dropper_stiffness[mine]
        self.damping = model.dropper_damping[mine]
        self._line = line
        # Change of tension per unit of relative acceleration within the step.
        self.per_acceleration = (
            self.stiffness * line.position_factor + self.damping * line.velocity_factor
        )
        self.latest_tension = np.zeros(self.numbers.size)

    def tension(self) -> np.ndarray:
        """Tension from the line's present motion [N], shape (n,), overwritten by the next call."""
        line = self._line
        kernels.tension(
            line.displacement,
            line.velocity,
            self.upper,
            self.lower,
            self.rest,
            self.stiffness,
            self.damping,
            self.latest_tension,
        )
        return self.latest_tension

    def energy_of_pushing(self) -> float:
        """Elastic energy that the owned droppers would hold by pushing, were they springs [J]."""
        stretch = self._line.displacement[self.upper] - self._line.displacement[self.lower]
        pushing = np.minimum(self.rest + self.stiffness * stretch, 0.0)
        return float((pushing**2 / (2.0 * self.stiffness)).sum())

    def near(self, x: float, distance: float) -> slice:
        """The droppers within ``distance`` of ``x`` [m]."""
        low, high = self.x.searchsorted([x - distance, x + distance])
        return slice(int(low), int(high))


class Interaction:
    """Contacts and droppers of one rank. Collective to make.

    Parameters
    ----------
    range_of_run : stretch of the contact wire that pan heads will touch [m]
    n_contacts : number of pantographs
    train_speed : V of the convective part of the gap rate [m/s]
    uses_rate : whether the contact law needs the gap rate
    may_slacken : whether droppers slacken
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        form: Equilibrium,
        line: NewmarkLine,
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
        columns = compliance.compute(
            comm, line.solver, line.ownership, line.windows, dofs, np.ones(dofs.shape), at
        )
        # Both unknowns of a node share a window; their columns stand one after the other.
        sizes = np.array([values.size for values in columns.values], dtype=np.int64)
        self._node_start = columns.start[0::2].copy()
        self._node_offset = np.concatenate([[0], np.cumsum(sizes[0::2] + sizes[1::2])])
        self._node_columns = np.concatenate([*columns.values, np.zeros(0)])
        self.slack_coupling: SlackCoupling | None = None
        if may_slacken:
            ends = model.dofs(model.mesh.droppers)
            self._dropper_columns = compliance.compute(
                comm,
                line.solver,
                line.ownership,
                line.windows,
                ends,
                np.broadcast_to(np.array([1.0, -1.0]), ends.shape),
                model.mesh.x(model.mesh.droppers[:, 1]),
            )
            self.slack_coupling = SlackCoupling(
                comm, model, self.droppers, self._dropper_columns, line
            )
        shape = (n_contacts, line.ownership.n_local)
        self._answers = np.zeros(shape)
        self._filled = np.zeros((n_contacts, 2), dtype=np.int64)
        self._slope_answers = np.zeros(shape if uses_rate else (n_contacts, 0))
        self._slope_filled = np.zeros((n_contacts, 2), dtype=np.int64)
        self._chosen = np.zeros(self.droppers.numbers.size, dtype=np.int64)

    def place(self, touches: Touches) -> None:
        """Work out the line's answer to a unit force at each touch."""
        self._combine(touches.element, touches.whole_value, self._answers, self._filled)
        if self._uses_rate:
            self._combine(
                touches.element, touches.whole_slope, self._slope_answers, self._slope_filled
            )

    def heights(self, touches: Touches) -> tuple[np.ndarray, np.ndarray]:
        """This rank's share of wire height [m] and its total rate [m/s] at each touch, (n,).

        The total rate is what the pan head meets: dw/dt + V dw/dx. Shares add up over the ranks.
        """
        height, rate = np.empty(touches.n), np.empty(touches.n)
        kernels.heights(
            self.line.displacement,
            self.line.velocity,
            touches.local,
            touches.value,
            touches.slope,
            touches.rest,
            self._speed,
            height,
            rate,
        )
        return height, rate

    def response(self, touches: Touches, force_bound: np.ndarray, margin: float) -> LineResponse:
        """This rank's share of the inner problem, after ``place`` and the free solve.

        The line must hold the end of the step without contact forces and with all droppers taut.
        Droppers are included if their tension may fall below ``margin`` [N] under contact
        forces up to ``force_bound`` (n,) [N].
        """
        line, n = self.line, touches.n
        height, rate = self.heights(touches)
        by_force, rate_by_force = np.zeros((n, n)), np.zeros((n, n))
        kernels.influence(self._answers, touches.local, touches.value, by_force)
        if self._uses_rate:
            kernels.influence(self._answers, touches.local, touches.slope, rate_by_force)
            rate_by_force *= self._speed * line.position_factor
            rate_by_force += line.velocity_factor * by_force
        by_force *= line.position_factor
        chosen = self._droppers_to_watch(touches, force_bound, margin)
        if chosen.size == 0:
            return LineResponse(
                height, rate, by_force, rate_by_force, chosen, np.zeros(0), *[np.zeros((0, n))] * 3
            )
        droppers = self.droppers
        upper, lower = droppers.upper[chosen], droppers.lower[chosen]
        spread = (self._answers[:, upper] - self._answers[:, lower]).T
        rate_spread = np.zeros_like(spread)
        if self._uses_rate:
            slope_spread = (self._slope_answers[:, upper] - self._slope_answers[:, lower]).T
            rate_spread = (
                line.velocity_factor * spread + self._speed * line.position_factor * slope_spread
            )
        return LineResponse(
            height,
            rate,
            by_force,
            rate_by_force,
            droppers.numbers[chosen],
            droppers.latest_tension[chosen],
            droppers.per_acceleration[chosen, None] * spread,
            line.position_factor * spread,
            rate_spread,
        )

    def superpose(
        self, contact_force: np.ndarray, droppers: np.ndarray, compensation: np.ndarray
    ) -> None:
        """Add the answer to contact forces (n,) and compensations (m,) [N] to the line's state."""
        for i, force in enumerate(contact_force.tolist()):
            if force:
                low, high = self._filled[i].tolist()
                self._move(low, self._answers[i, low:high], force)
        columns = self._dropper_columns if droppers.size else None
        for dropper, force in zip(droppers.tolist(), compensation.tolist(), strict=True):
            assert columns is not None
            self._move(int(columns.start[dropper]), columns.values[dropper], -force)

    def _move(self, begin: int, values: np.ndarray, factor: float) -> None:
        """Add to the acceleration, and what follows from it to displacement and velocity."""
        line = self.line
        kernels.move(
            begin,
            values,
            factor,
            line.acceleration,
            line.displacement,
            line.velocity,
            line.position_factor,
            line.velocity_factor,
        )

    def _droppers_to_watch(
        self, touches: Touches, force_bound: np.ndarray, margin: float
    ) -> np.ndarray:
        """Places among the owned droppers of those that may slacken in this step."""
        droppers = self.droppers
        if not self._may_slacken:
            return self._chosen[:0]
        count = kernels.may_slacken(
            droppers.tension(),
            margin,
            force_bound,
            droppers.per_acceleration,
            droppers.upper,
            droppers.lower,
            droppers.x,
            touches.x,
            self.line.windows.reach,
            self._answers,
            self._chosen,
        )
        return self._chosen[:count]

    def loads(
        self, touches: Touches, contact_force: np.ndarray, compensation: np.ndarray
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Local unknowns and forces of contacts (n,) and of all owned droppers' compensations."""
        result = []
        if self.line.ownership.n_local == 0:
            return []
        for local, value, force in zip(touches.local, touches.value, contact_force, strict=True):
            if force:
                result.append((local, force * value))
        slack = np.flatnonzero(compensation)
        if slack.size:
            result.append((self.droppers.upper[slack], -compensation[slack]))
            result.append((self.droppers.lower[slack], compensation[slack]))
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

    Collective to make. G_de = (k beta dt^2 + c gamma dt)_d L_d^T A^-1 L_e [-].
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        droppers: Droppers,
        columns: compliance.ShortColumns,
        line: NewmarkLine,
    ) -> None:
        x = model.mesh.x(model.mesh.droppers[:, 1])
        n = x.size
        far = np.searchsorted(x, x + line.windows.reach, side="right") - 1 - np.arange(n)
        self._half = int(far.max(initial=0))
        band = np.zeros((n, 2 * self._half + 1))
        scratch = np.zeros(line.ownership.n_local)
        for e in range(n):
            values = columns.values[e]
            if values.size == 0:
                continue
            filled = slice(int(columns.start[e]), int(columns.start[e]) + values.size)
            scratch[filled] = values
            near = droppers.near(x[e], line.windows.reach)
            spread = scratch[droppers.upper[near]] - scratch[droppers.lower[near]]
            offset = droppers.numbers[near] - e + self._half
            inside = (offset >= 0) & (offset < band.shape[1])
            band[e, offset[inside]] = (droppers.per_acceleration[near] * spread)[inside]
            scratch[filled] = 0.0
        self._band = comm.reduce(band, root=0) if comm.size > 1 else band
        self.n_droppers = n

    def among(self, droppers: np.ndarray) -> np.ndarray:
        """G of some droppers, shape (m, m). Rank 0 only."""
        offset = droppers[:, None] - droppers[None, :] + self._half
        inside = (offset >= 0) & (offset <= 2 * self._half)
        values = self._band[droppers[None, :], np.where(inside, offset, 0)]
        return np.where(inside, values, 0.0)

    def largest_drop_elsewhere(self, droppers: np.ndarray, compensation: np.ndarray) -> float:
        """Largest loss of tension of a dropper that is not among ``droppers`` [N]. Rank 0 only."""
        drop = np.zeros(self.n_droppers + 2 * self._half)
        for dropper, force in zip(droppers, compensation, strict=True):
            if force:
                drop[dropper : dropper + 2 * self._half + 1] += force * self._band[dropper]
        drop = drop[self._half : self._half + self.n_droppers]
        drop[droppers] = 0.0
        return float(drop.max(initial=0.0))
