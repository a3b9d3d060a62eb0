"""This rank's part of what acts on the line: contacts, droppers, and the answer to their forces."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.solver import compliance
from catenary.solver.contact import ContactWire, Touch
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
        self._is_damped = bool(self.damping.any())

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Difference upper minus lower of a local array, shape (n,)."""
        return np.asarray(values[self.upper] - values[self.lower])

    def tension(self) -> np.ndarray:
        """Tension from the line's present displacement and velocity [N], shape (n,)."""
        result = self.rest + self.stiffness * self.spread(self._line.displacement)
        if self._is_damped:
            result += self.damping * self.spread(self._line.velocity)
        return result

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
        # Both unknowns of a node share a window: one row each.
        self._node_start = columns.start[0::2].tolist()
        self._node_answers = [
            np.stack(pair) for pair in zip(columns.values[0::2], columns.values[1::2], strict=True)
        ]
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
        self._slope_answers = np.zeros(shape if uses_rate else (0, 0))
        self._filled = [slice(0, 0)] * n_contacts

    def place(self, touches: list[Touch]) -> None:
        """Work out the line's answer to a unit force at each touch."""
        for i, touch in enumerate(touches):
            self._answers[i, self._filled[i]] = 0.0
            self._filled[i] = self._combine(touch, touch.value, self._answers[i])
            if self._uses_rate:
                self._slope_answers[i] = 0.0
                self._combine(touch, touch.slope, self._slope_answers[i])

    def heights(self, touches: list[Touch]) -> tuple[np.ndarray, np.ndarray]:
        """This rank's share of wire height [m] and its total rate [m/s] at each touch, (n,).

        The total rate is what the pan head meets: dw/dt + V dw/dx. Shares add up over the ranks.
        """
        line, wire, n = self.line, self.wire, len(touches)
        height, rate = np.zeros(n), np.zeros(n)
        if line.ownership.n_local == 0:
            return height, rate
        for i, touch in enumerate(touches):
            local, owned = wire.local[touch.element], wire.owned[touch.element]
            value = touch.value * owned
            total = touch.rest + line.displacement[local]
            height[i] = value @ total
            if self._uses_rate:
                rate[i] = value @ line.velocity[local] + self._speed * (
                    (touch.slope * owned) @ total
                )
        return height, rate

    def response(
        self, touches: list[Touch], force_bound: np.ndarray, margin: float
    ) -> LineResponse:
        """This rank's share of the inner problem, after ``place`` and the free solve.

        The line must hold the end of the step without contact forces and with all droppers taut.
        Droppers are included if their tension may fall below ``margin`` [N] under contact
        forces up to ``force_bound`` (n,) [N].
        """
        line, n = self.line, len(touches)
        height, rate = self.heights(touches)
        by_force, rate_by_force = np.zeros((n, n)), np.zeros((n, n))
        for i, touch in enumerate(touches):
            local, owned = self.wire.local[touch.element], self.wire.owned[touch.element]
            if not line.ownership.n_local:
                break
            reached = self._answers[:, local]
            by_force[i] = line.position_factor * (reached @ (touch.value * owned))
            if self._uses_rate:
                rate_by_force[i] = line.velocity_factor * (
                    reached @ (touch.value * owned)
                ) + self._speed * line.position_factor * (reached @ (touch.slope * owned))
        if not self._may_slacken:
            empty, none = np.zeros(0), np.zeros((0, n))
            return LineResponse(
                height, rate, by_force, rate_by_force, empty.astype(int), empty, none, none, none
            )
        droppers = self.droppers
        tension = droppers.tension()
        candidate = tension < margin
        for i, touch in enumerate(touches):
            near = droppers.near(self.wire.x[touch.element], line.windows.reach)
            spread = self._answers[i, droppers.upper[near]] - self._answers[i, droppers.lower[near]]
            candidate[near] |= (
                tension[near] + droppers.per_acceleration[near] * spread * force_bound[i] < margin
            )
        chosen = np.flatnonzero(candidate)
        spread = (
            self._answers[:, droppers.upper[chosen]] - self._answers[:, droppers.lower[chosen]]
        ).T
        rate_spread = np.zeros_like(spread)
        if self._uses_rate:
            slope_spread = (
                self._slope_answers[:, droppers.upper[chosen]]
                - self._slope_answers[:, droppers.lower[chosen]]
            ).T
            rate_spread = (
                line.velocity_factor * spread + self._speed * line.position_factor * slope_spread
            )
        return LineResponse(
            height,
            rate,
            by_force,
            rate_by_force,
            droppers.numbers[chosen],
            tension[chosen],
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
                filled = self._filled[i]
                self._move(filled, force * self._answers[i, filled])
        columns = self._dropper_columns if droppers.size else None
        for dropper, force in zip(droppers.tolist(), compensation.tolist(), strict=True):
            assert columns is not None
            values, start = columns.values[dropper], int(columns.start[dropper])
            if values.size:
                self._move(slice(start, start + values.size), -force * values)

    def _move(self, where: slice, acceleration: np.ndarray) -> None:
        """Add to the acceleration, and what follows from it to displacement and velocity."""
        line = self.line
        line.acceleration[where] += acceleration
        line.displacement[where] += line.position_factor * acceleration
        line.velocity[where] += line.velocity_factor * acceleration

    def loads(
        self, touches: list[Touch], contact_force: np.ndarray, compensation: np.ndarray
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Local unknowns and forces of contacts (n,) and of all owned droppers' compensations."""
        result = []
        if self.line.ownership.n_local == 0:
            return []
        for touch, force in zip(touches, contact_force, strict=True):
            if force:
                values = force * touch.value * self.wire.owned[touch.element]
                result.append((self.wire.local[touch.element], values))
        slack = np.flatnonzero(compensation)
        if slack.size:
            result.append((self.droppers.upper[slack], -compensation[slack]))
            result.append((self.droppers.lower[slack], compensation[slack]))
        return result

    def _combine(self, touch: Touch, weights: np.ndarray, target: np.ndarray) -> slice:
        """Sum the columns of an element's unknowns into ``target``; the slice that it fills."""
        first = touch.element - self._first_node
        left, right = self._node_answers[first], self._node_answers[first + 1]
        low, split = self._node_start[first], self._node_start[first + 1]
        end, high = low + left.shape[1], split + right.shape[1]
        if left.shape[1]:
            np.dot(weights[:2], left, out=target[low:end])
        if right.shape[1]:
            target[split:high] += weights[2:] @ right
        return slice(min(low, split), max(end, high))


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
