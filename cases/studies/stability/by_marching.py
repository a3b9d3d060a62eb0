"""Stability of the coupling schemes by marching: does the program itself let a perturbation grow?

A pantograph without static force is pressed into the wire at rest by a little, and let go. Without
loss of contact and slack droppers all is linear, so that the size of the start does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from catenary.cases.studies.hard.runs import rest_height
from catenary.cases.studies.stability.from_matrices import methods_of
from catenary.mbs.lumped_data import LumpedData
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import NEVER, Observer, StepView

# Depth at the start [m]: exchanges settle to a share of it that is more than the round-off of
# heights of 5 m, 1e-15 m.
DEPTH = 1e-3
# Slow enough to stand: within a run the train moves less than a millimetre [m/s].
_SPEED = 1e-4
# A perturbation grows if the force passes this many times the first one within so many steps.
GROWN, STEPS = 1e3, 400
# Exchanges must agree to this share of the start within so many; one after the other, few steps
# tell as much as many.
AGREED, EXCHANGES, EXCHANGED_STEPS = 1e-9, 1000, 20
COUPLINGS = ("implicit", "explicit", "iterated", "fixed_point")


@dataclass(frozen=True)
class Bench:
    """A line at rest, and the place on it where heads are tried.

    ``rest`` is of a scene without loss of contact and slack droppers, whose leading pantograph is
    ``data``; ``x`` [m]. Lives on one process: ``comm`` is its own.
    """

    rest: LineAtRest
    data: LumpedData
    x: float
    comm: Any

    def problem(self, coupling: str, stiffness: float, head_mass: float, dt: float) -> Problem:
        """A head of ``head_mass`` [kg] on a contact of ``stiffness`` [N/m], for as many steps of
        ``dt`` [s] as show whether the ``coupling`` is stable."""
        usual = self.rest.problem
        height = float(rest_height(self.rest, np.array([self.x]))[0])
        data = LumpedData(
            (head_mass, *self.data.masses[1:]), self.data.stiffnesses, self.data.dampings
        )
        first = usual.train.placements[0]
        # At its nominal height no spring is strained: nothing but the perturbation moves.
        placement = replace(first, data=data, static_force=0.0, behind=0.0, nominal_height=height)
        n_steps = STEPS if coupling in ("implicit", "explicit") else EXCHANGED_STEPS
        train = replace(
            usual.train,
            speed=_SPEED,
            start=self.x,
            end=self.x + (n_steps + 0.5) * dt * _SPEED,
            raise_time=0.0,
            placements=(placement,),
            start_below=-DEPTH,
            vehicle=None,
        )
        eps_d, line = AGREED * DEPTH, methods_of(usual.numerics).line
        numerics = replace(
            usual.numerics,
            dt=dt,
            scheme="fixed_point" if coupling == "fixed_point" else "one_solve",
            coupling="implicit" if coupling == "fixed_point" else coupling,
            eps_force=AGREED * DEPTH * stiffness,
            eps_d=eps_d,
            eps_v=eps_d * line.gamma / (line.beta * dt),
            max_iterations=EXCHANGES,
        )
        return replace(
            usual, train=train, numerics=numerics, contact=LinearLaw(stiffness, damping=0.0)
        )

    def is_stable(self, coupling: str, stiffness: float, head_mass: float, dt: float) -> bool:
        """Whether the program's own steps of ``dt`` [s] with a ``coupling`` keep a perturbation
        small, of a head of ``head_mass`` [kg] on a contact of ``stiffness`` [N/m]."""
        problem = self.problem(coupling, stiffness, head_mass, dt)
        watched = _Growth(GROWN * stiffness * DEPTH)
        rest = self.rest
        with March(self.comm, problem, rest.model, rest.form, rest.lift) as march:
            ended = march.run([watched], lambda: watched.grown)
        return ended.outcome == "done" and not watched.grown

    def bracket(
        self,
        coupling: str,
        stiffness: float,
        head_mass: float,
        steps: tuple[float, float],
        resolution: float,
    ) -> tuple[float, float]:
        """A step [s] found stable and one found unstable, by bisection between two ``steps``.

        ``coupling``, ``stiffness`` and ``head_mass`` are as of ``is_stable``. The two differ by the
        factor 1 + ``resolution`` at most; (longest, inf) if all are stable, (0, shortest) if none
        is.
        """
        low, high = steps
        if self.is_stable(coupling, stiffness, head_mass, high):
            return high, np.inf
        if not self.is_stable(coupling, stiffness, head_mass, low):
            return 0.0, low
        while high > (1.0 + resolution) * low:
            middle = float(np.sqrt(low * high))
            if self.is_stable(coupling, stiffness, head_mass, middle):
                low = middle
            else:
                high = middle
        return low, high


class _Growth(Observer):
    """Observer that checks whether a contact force has passed a bound [N]."""

    def __init__(self, bound: float) -> None:
        self._bound = bound
        self.grown = False

    def next_state(self, step: int) -> int:
        """Rows are enough."""
        return NEVER

    def observe(self, view: StepView) -> None:
        """Not collective."""
        largest = float(np.abs(view.each("contact_force")).max())
        self.grown = self.grown or not largest < self._bound
