"""A second opinion on every step: PETSc's TSALPHA2 on line and pantographs as one system.

Every step is a nonlinear system of all unknowns, solved by Newton's method with a Jacobian that is
factored anew each time. It is slow, and shares nothing with the default scheme but the model. This
file makes it a scheme of marches, ``TS_ALPHA2``: of lumped pantographs with one strip that is fixed
to the head, on one contact wire, under the linear law, on one rank.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from monolithic_system import WholeSystem

from catenary.base.errors import NotConverged
from catenary.base.petsc import PETSc
from catenary.solver.contact.forces_on_line import ForcesOnLine
from catenary.solver.contact.pantographs import Pantographs
from catenary.solver.linear.petsc_solvers import PREFIX
from catenary.solver.problem.integrator_parameters import GENERALIZED_ALPHA, NEWMARK, integration_of
from catenary.solver.problem.problem import Numerics, Problem
from catenary.solver.schemes.make_scheme import SCHEMES
from catenary.solver.schemes.scheme import Counters, find_crossings
from catenary.solver.statics.after_incidents import ChangedLine

# Norm of what may be left of the forces [N], and what short steps add to it by round-off of
# inertia forces, some ten times eps of masses below 100 kg and ways below 0.1 m [N s2].
_TOLERANCE = 1e-7
_ROUND_OFF = 100.0 * np.finfo(float).eps
_MOST_ITERATIONS = 50
_OWN_PREFIX = f"{PREFIX}alpha2_"
# The scheme's name in ``Numerics.scheme``.
TS_ALPHA2 = "ts_alpha2"


@dataclass
class TSAlpha2:
    """Steps of an inner TS of type ``alpha2``. On one rank; the maker calls ``destroy``.

    Forces are those of the state between two steps at which the method balances them, contacts and
    droppers included; the default scheme interpolates forces.
    """

    comm: Any
    interaction: ForcesOnLine
    pantographs: Pantographs
    system: WholeSystem
    numerics: Numerics
    counters: Counters = field(default_factory=Counters)

    def __post_init__(self) -> None:
        n = self.system.n
        self.system.place(self.pantographs.head_height)
        self._u, self._v = np.zeros(n), np.zeros(n)
        for head, after, height in zip(
            self.system.heads,
            [*self.system.heads[1:], n],
            self.pantographs.head_height,
            strict=True,
        ):
            self._u[head:after] = height - self.system.level
        self._residual = np.zeros(n)
        vectors = [
            PETSc.Vec().createWithArray(array, comm=self.comm)
            for array in (self._u, self._v, self._residual)
        ]
        matrix = PETSc.Mat().createAIJ(
            (n, n),
            csr=(
                self.system.indptr.astype(PETSc.IntType),
                self.system.indices.astype(PETSc.IntType),
                np.zeros(self.system.indices.size),
            ),
            comm=self.comm,
        )
        self._rows = self.system.indptr.astype(PETSc.IntType)
        self._columns = self.system.indices.astype(PETSc.IntType)
        ts = PETSc.TS().create(self.comm)
        self._held = [ts, matrix, *vectors]
        self._ts = ts
        ts.setOptionsPrefix(_OWN_PREFIX)
        ts.setProblemType(PETSc.TS.ProblemType.NONLINEAR)
        ts.setType("alpha2")
        ts.setI2Function(self._function, vectors[2])
        ts.setI2Jacobian(self._jacobian, matrix)
        ts.setSolution2(vectors[0], vectors[1])
        ts.setTime(0.0)
        ts.setTimeStep(self.numerics.dt)
        # The march decides when it ends; PETSc wants a limit.
        ts.setMaxTime(1e9)
        ts.setMaxSteps(2**31 - 1)
        ts.setExactFinalTime(PETSc.TS.ExactFinalTime.STEPOVER)
        snes = ts.getSNES()
        tolerance = _TOLERANCE + _ROUND_OFF / self.numerics.dt**2
        snes.setTolerances(rtol=0.0, atol=tolerance, stol=0.0, max_it=_MOST_ITERATIONS)
        snes.getKSP().setType(PETSc.KSP.Type.PREONLY)
        # The pattern is a band, with the pantographs' dense rows and columns at its end.
        pc = snes.getKSP().getPC()
        pc.setType(PETSc.PC.Type.LU)
        pc.setFactorOrdering(str(PETSc.Mat.OrderingType.NATURAL))
        self._set_from_options()

    def step(self, time: float, stop: bool) -> bool:
        self.pantographs.move_to(time)
        try:
            self._ts.step()
        except PETSc.Error as error:
            if self._ts.getSNES().getConvergedReason() >= 0:
                raise  # not for want of a solution
            raise NotConverged("PETSc's TSALPHA2 finds no solution") from error
        assert np.isfinite(self._u).all()
        # Its own times are sums of steps, which drift.
        self._ts.setTime(time)
        self._publish(time)
        return not stop

    def state(self) -> np.ndarray:
        """Nothing: the method's own acceleration is out of reach."""
        return np.zeros(0)

    def restore(self, state: np.ndarray) -> None:
        """Not possible, as PETSc keeps a part of the state to itself."""
        raise NotImplementedError

    @property
    def traffic(self) -> None:
        """None: it has one rank."""
        return None

    def destroy(self) -> None:
        """Free all PETSc objects. Collective."""
        for held in self._held:
            held.destroy()

    def _set_from_options(self) -> None:
        """Options that have no other way into PETSc; the user's own of the same name win."""
        beta, gamma, mass_weight, force_weight = _integration(self.numerics)
        options, given = PETSc.Options(_OWN_PREFIX), []
        for name, value in (
            ("ts_alpha_alpha_m", 1.0 - mass_weight),
            ("ts_alpha_alpha_f", 1.0 - force_weight),
            ("ts_alpha_gamma", gamma),
            ("ts_alpha_beta", beta),
            ("ts_adapt_type", "none"),
            ("snes_linesearch_type", "basic"),
        ):
            if not options.hasName(name):
                options.setValue(name, value)
                given.append(name)
        try:
            self._ts.setFromOptions()
            self._ts.setUp()
        finally:
            for name in given:
                options.delValue(name)

    def _function(self, ts: Any, time: float, u: Any, v: Any, a: Any, result: Any) -> None:
        result.setArray(self.system.residual(time, u.array_r, v.array_r, a.array_r))

    def _jacobian(
        self, ts: Any, time: float, u: Any, v: Any, a: Any, by_v: float, by_a: float, result: Any,
        _: Any,
    ) -> None:  # fmt: skip
        values = self.system.jacobian(time, u.array_r, v.array_r, by_v, by_a)
        result.setValuesCSR(self._rows, self._columns, values)
        result.assemble()
        self.counters.solves += 1

    def _publish(self, time: float) -> None:
        """Show the state where the march looks for it: at the line and the pantographs."""
        system, line, pantographs = self.system, self.interaction.line, self.pantographs
        line.displacement[:] = self._u[: system.n_line]
        line.velocity[:] = self._v[: system.n_line]
        force, depth, _ = system.contacts(time, self._u, self._v)
        pantographs.contact_force[:] = force
        pantographs.strip_force[:] = force
        pantographs.head_height[:] = system.level + self._u[system.heads]
        pantographs.wire_height[:] = pantographs.head_height - depth
        if pantographs.lateral:
            self.interaction.locate()
            find_crossings(self.interaction, pantographs, time)
        self.counters.steps += 1
        self.counters.rounds = self.counters.solves
        self.counters.slack_dropper_steps += system.n_slack(self._u, self._v)


def _integration(numerics: Numerics) -> tuple[float, float, float, float]:
    """Parameters of the numerics' integrator, of order two.

    Average acceleration is taken as generalized-alpha of radius 1, which it is for linear systems:
    in its usual form PETSc 3.18 starts it from twice the acceleration.
    """
    radius = 1.0 if numerics.integrator == NEWMARK else numerics.spectral_radius
    method = GENERALIZED_ALPHA if radius == 1.0 else numerics.integrator
    return integration_of(method, radius)


def _make(
    comm: Any,
    problem: Problem,
    changed: ChangedLine,
    interaction: ForcesOnLine,
    pantographs: Pantographs,
) -> TSAlpha2:
    assert comm.size == 1
    loads = interaction.line.loads
    system = WholeSystem(problem, changed.model, changed.form, pantographs.nominal_height, loads)
    return TSAlpha2(comm, interaction, pantographs, system, problem.numerics)


SCHEMES[TS_ALPHA2] = _make
