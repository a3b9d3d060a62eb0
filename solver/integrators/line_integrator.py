"""The line's state, step operator and steps, whichever method of Newmark's family advances it.

Newmark's method (paper eqs. 2.4-2.6) is the generalized-alpha method with weights of zero; HHT is
another member. It balances forces between two states,
M a(1 - a_m) + C v(1 - a_f) + K d(1 - a_f) = f(1 - a_f). Let b be the acceleration that balances
the forces at the end of each step itself, M b = f - C v - K d. As the equations are linear in
M, C, K and f, the method is the same as

    (1 - a_m) a_new + a_m a_old = (1 - a_f) b_new + a_f b_old                            (*)

with Newmark's formulas in a. So a step has the form of Newmark's with b in place of a: no force of
an earlier step is needed, contacts and droppers meet the state at the end of the step, and one
product with K is enough. With r = (1 - a_f) / (1 - a_m) it is a = p + r b, p being known when a
step begins: sigma = r beta dt^2, tau = r gamma dt. Source of (*): M. Arnold, O. Brüls, Multibody
Syst. Dyn. 18 (2007) 185-202.

The step operator A = M + tau C + sigma K is factored once, sigma and tau being what displacement
and velocity gain from the step's unknown acceleration. With proportional damping the step's
right-hand side needs a single product with K: M v is eliminated by A itself.

A step without contacts goes in two passes over the state. Forth, from both ends of the line to its
middle: product with K and elimination, station by station. Back: substitution, correction, and the
prediction of the step to come. A step that does these one after the other reads the state from
memory as often as there are of them, which is what long lines wait for. Two chains of stations go
side by side, each of which waits for itself only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property, partial
from itertools import starmap
from typing import Any

import numpy as np

from catenary.base.mpi import MPI
from catenary.base.parallel import total
from catenary.base.petsc import PETSc
from catenary.solver.integrators.line_loads import LineLoads
from catenary.solver.integrators.line_state import AlphaAhead, LineState, PredictedLineState
from catenary.solver.integrators.slow_path import (
    CALLED,
    GENERAL,
    LIBRARY,
    PARTS,
    SlowPath,
    slow_load,
    slow_method,
    warn_of_slow_path,
)
from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.linear.pieces import WantedPieces
from catenary.solver.linear.step_operators import ByStations, LineOperators, Loads
from catenary.solver.linear.unit_responses import UnitResponses, Windows, reach
from catenary.solver.model.matrices import OperatorBands
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.model.switching_links import NO_LINKS
from catenary.solver.problem.integrator_parameters import Integration, integration_of
from catenary.solver.problem.problem import Numerics
from catenary.solver.window.moving_window import MovingWindow

# Arrays of every state of a line.
MOTION = ("displacement", "velocity", "acceleration")
# Unknowns of a stretch of the pass back, after which its droppers are looked at: large enough for
# memory to be read ahead, 64 kB of each array, which a cache next to a processor holds.
_STRETCH = 8192
_NO_LOADS = np.zeros(0)
# Share of dt^2 below which the acceleration cannot be found from what a prediction takes from it.
_LEAST_SHARE = 1e-3


class LineIntegrator:
    """State and step operator of the distributed line, relative to its equilibrium.

    Collective to make; ``destroy`` is collective too. Arrays are this rank's part, shape
    (n_local,). A step is ``free_step``, or the three parts of that; forces that are known later
    only change the acceleration, displacement and velocity by A^-1, sigma A^-1 and tau A^-1.

    Attributes
    ----------
    motion : LineState, the state as it is kept
    position_factor, velocity_factor : sigma [s2] and tau [s]
    operators : LineOperators
    responses : UnitResponses of the step operator
    loads : LineLoads, None if there are none
    passes : free steps in compiled code, None if these are taken in parts
    solution : a PETSc vector for the displacement
    slow_path : why ``keep_ahead`` could not, None if it could; the same on all ranks
    window : MovingWindow, None if all stations move

    Parameters
    ----------
    dt : time step [s]
    integration : parameters of the method
    wanted : which part of the line steps need at a time, None if all of it
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        ownership: Ownership,
        dt: float,
        integration: Integration,
        wanted: WantedPieces | None = None,
    ) -> None:
        self._comm = comm
        self.ownership = ownership
        beta, gamma, mass_weight, force_weight = integration
        ratio = (1.0 - force_weight) / (1.0 - mass_weight)
        self.position_factor, self.velocity_factor = ratio * beta * dt**2, ratio * gamma * dt
        coefficients = (1.0, self.position_factor, self.velocity_factor)
        bands = OperatorBands(model, coefficients)
        self.windows = Windows(model.numbering, reach(model, bands))
        in_pieces = None
        if wanted is not None:
            in_pieces = wanted.pieces_of(model, coefficients, self.windows.reach)
        self.operators = LineOperators(
            comm, model, ownership, coefficients, self.windows, in_pieces
        )
        like = self.operators.like
        self.responses = UnitResponses(comm, model, ownership, bands, self.windows, like)
        self._proportional = model.damping_is_proportional
        # Parts that are folded into the product with K, and parts left for after the solve.
        self._alpha_share = self._beta_share = 0.0
        # Factors of M and K in A, if damping leaves it their sum.
        self._shares: tuple[float, float] | None = None
        if self._proportional:
            alpha, beta_damping = (
                model.damping_of_block(model.blocks[0]) if model.blocks else (0.0, 0.0)
            )
            stiffness_share = self.position_factor + self.velocity_factor * alpha
            self._beta_share = beta_damping / (1.0 + self.velocity_factor * beta_damping)
            self._alpha_share = alpha - self._beta_share * stiffness_share
            self._shares = 1.0 + self.velocity_factor * beta_damping, stiffness_share
        n = ownership.n_local
        # The p of each step, none by Newmark's method.
        has_known = mass_weight != 0.0 or force_weight != 0.0
        self._known = aligned_arrays.zeros(n if has_known else 0, 4)
        self._steps = native.StepFactors(
            dt=dt,
            ratio=ratio,
            known_of_balanced=force_weight / (1.0 - mass_weight),
            known_of_own=-mass_weight / (1.0 - mass_weight),
            position_of_own=dt**2 * (0.5 - beta),
            position_of_known=dt**2 * beta,
            velocity_of_own=dt * (1.0 - gamma),
            velocity_of_known=dt * gamma,
            work_velocity=self._alpha_share,
            position_factor=self.position_factor,
            velocity_factor=self.velocity_factor,
            damping_share=self._beta_share,
        )
        gains = self.position_factor, self.velocity_factor, 1.0
        self.passes: StationPasses | None = None
        self.loads: LineLoads | None = None
        if model.loads:
            self.loads = LineLoads(model.loads, self.operators.domain, model.constrained, comm)
        self.slow_path: SlowPath | None = None
        self.window: MovingWindow | None = None
        self.motion = LineState(
            aligned_arrays.zeros(n, 2), aligned_arrays.zeros(n, 3), self.operators.answer, gains
        )
        if self.loads is not None:
            self.loads.read(self.motion)
        self.track_links(NO_LINKS, np.zeros(0))
        # PETSc's time loop wants the solution as a vector; it wraps our array.
        self.solution = PETSc.Vec().createWithArray(self.displacement, size=(n, None), comm=comm)

    def load_at(self, time: float) -> None:
        """Take the loads of the step to ``time`` [s]. Collective."""
        if self.loads is not None:
            self.loads.at(time)

    def keep_ahead(self) -> None:
        """Keep the state one prediction ahead from now on, if method and operators allow it.

        Of steps there are then only free ones, in two passes over the state. Collective.
        """
        motion = self._ahead()
        if motion is None:
            self.slow_path = SlowPath(
                "the method does not keep its state one prediction ahead", PARTS
            )
            return
        loads = np.zeros(0) if self.loads is None else self.loads.values
        parts, passes = self.operators.by_stations(not self._proportional, self._shares), None
        if parts is not None:
            passes = StationPasses(parts, loads, motion)
        # A rank without stations has no passes; it keeps its state like the others.
        can = passes is not None or self.ownership.n_local == 0
        if not self._comm.allreduce(int(can), op=MPI.MIN):
            self.slow_path = SlowPath(self.operators.why_not_by_stations(), LIBRARY)
            return
        self.passes = passes
        general = passes is not None and not passes.are_compiled
        if self._comm.allreduce(int(general), op=MPI.MAX):
            self.slow_path = SlowPath(
                "its cross-sections join their unknowns as in none that kernels are compiled for",
                GENERAL,
            )
        if passes is not None:
            passes.track_links(*self._links)
        motion.put(self.displacement, self.velocity, self.acceleration)
        self.motion = motion
        if self.loads is not None:
            self.loads.read(motion)

    def _ahead(self) -> PredictedLineState | None:
        """A motion to keep ahead, in the arrays of this one; None if the method cannot."""
        operators, (shown, rate, acceleration) = self.operators, self.motion.read[:3]
        if not self._known.size:
            # Products with C, if there are any, read the velocity.
            velocity = rate if self._proportional else operators.rate
            ahead = operators.factor, velocity, acceleration, shown
            return PredictedLineState(*ahead, self._steps)
        total = aligned_arrays.zeros(shown.size, 5)
        predicted = rate[:0] if self._proportional else operators.rate
        arrays = operators.factor, rate, total, self._known, shown, predicted
        motion = AlphaAhead(*arrays, self._steps)
        return None if abs(motion.balance[0]) < _LEAST_SHARE * self._steps.dt**2 else motion

    @property
    def displacement(self) -> np.ndarray:
        """[m], [rad]; the array itself, if the motion is kept as it is."""
        return self.motion.displacement

    @property
    def velocity(self) -> np.ndarray:
        """[m/s], [rad/s]; the array itself, if the motion is kept as it is."""
        return self.motion.velocity

    @property
    def acceleration(self) -> np.ndarray:
        """The one that balances the forces, M a = f - C v - K d [m/s2], [rad/s2]; the array
        itself."""
        return self.motion.acceleration

    def predict(self) -> None:
        """Turn displacement and velocity into their values at the end of the step without the
        step's unknown acceleration, and ``operators.factor`` into -(d + ``_alpha_share`` v). Not
        collective."""
        self._predict()

    @cached_property
    def _predict(self) -> Callable[[], None]:
        motion = self.displacement, self.velocity, self.acceleration
        return native.predict.bound(*motion, self._known, self.operators.factor, self._steps)

    def start(
        self, displacement: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray
    ) -> None:
        """Start from displacement [m], [rad] and velocity [m/s], [rad/s], (n_local,) each.

        ``acceleration`` (n_local,) [m/s2], [rad/s2] balances the forces of this state; that of the
        generalized-alpha method itself starts with the same values.
        """
        if self._known.size:
            self._known[:] = (1.0 - self._steps.ratio) * acceleration
        self.motion.put(displacement, velocity, acceleration)
        if self.window is not None:
            self.window.wake()

    def state(self) -> Mapping[str, np.ndarray]:
        """State that the next step starts from, by name; to be read before that."""
        return {name: part() for name, part in self._parts_of_state().items()}

    def _parts_of_state(self) -> Mapping[str, Callable[[], np.ndarray]]:
        """Functions that give each array of ``state``."""
        parts: dict[str, Callable[[], np.ndarray]]
        parts = {name: partial(getattr, self, name) for name in MOTION}
        if self._known.size:
            parts["known_acceleration"] = partial(np.asarray, self._known)
        return parts

    def kept(self) -> tuple[np.ndarray, ...]:
        """The arrays themselves that a step changes: copies of them, written back, undo steps."""
        return (*self.motion.read[:3], self._known)

    def exact_state(self) -> Mapping[str, Callable[[], np.ndarray]]:
        """Functions that return each array of ``state`` and of the kept predictions, by name.

        From these arrays a march with the same steps continues to the last bit. Call the functions
        before the next step, one after the other.
        """
        kept = {name: partial(np.asarray, array) for name, array in self.motion.carried().items()}
        return {**self._parts_of_state(), **kept}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from what ``state`` or ``exact_state`` gave, here or elsewhere, as arrays."""
        if self._known.size:
            self._known[:] = state["known_acceleration"]
        self.motion.take(state)
        if self.window is not None:
            self.window.wake()

    def track_links(self, links: native.Links, reserve: np.ndarray) -> None:
        """Fill ``reserve`` (n,) [N] at the end of each ``free_step``, see `switching_links`.

        The links stand in the order along the track. Without this there are none. Not collective.
        """
        self._links = links, reserve
        if self.passes is not None:
            self.passes.track_links(links, reserve)

    def open_window(self, window: MovingWindow) -> None:
        """Take steps of the stations in a window only from now on. One rank, in two passes."""
        assert self.passes is not None
        self.window = window
        arrays, steps = window.arrays, self.passes.native
        steps.open(arrays)
        steps.track(native.TrackedLinks(*self._links, arrays.ranges, arrays.low.size))

    def provide(self, way: float) -> None:
        """Have what steps need until contacts are a ``way`` [m] further. Not collective."""
        if self.window is not None:
            self.window.provide(way)

    def free_step(self) -> None:
        """Take the step without contacts and slack droppers: in two passes, or by ``predict``,
        ``free_acceleration`` and ``correct``. After ``load_at``. Collective."""
        if self.passes is not None:
            if self._comm.size > 1:
                # Products with C of other ranks read them before a step fills them in itself.
                self.passes.native.predict_velocities()
                self.operators.exchange()
            self.passes.native.step()
            return
        self.predict()
        self.free_acceleration()
        self.correct()
        native.reserves(self.motion.read, *self._links)

    def free_acceleration(self) -> None:
        """Fill the acceleration from the predictions and loads. Collective.

        Contact and slack droppers are left out, so that ``correct`` must follow.
        """
        self.internal_forces()
        self.solve()

    def internal_forces(self) -> None:
        """Right-hand side -C v - K d of the step, and loads; only right after ``predict``.

        Collective.
        """
        operators = self.operators
        operators.exchange()
        operators.multiply_stiffness()
        if not self._proportional:
            np.negative(self.velocity, out=operators.factor)
            operators.exchange()
            operators.add_damping()
        if self.loads is not None:
            operators.add_force(self.loads.values)

    def solve(self, loads: Loads | None = None) -> None:
        """Acceleration for the internal forces plus ``loads`` of contacts and droppers.

        It lacks its part by damping on mass, which ``correct`` takes off. May be called again for
        other loads. Collective.
        """
        self.operators.solve(loads)

    def correct(self) -> None:
        """Turn predictions into the new displacement and velocity."""
        native.correct(
            self.displacement,
            self.velocity,
            self.acceleration,
            self.position_factor,
            self.velocity_factor,
            self._beta_share,
        )

    def energies(self) -> tuple[float, float]:
        """Kinetic and elastic energy relative to equilibrium, all droppers taut [J]. Collective."""
        parts = self.energy_parts(self.displacement, self.velocity)
        kinetic, elastic = total(self._comm, parts).tolist()
        return kinetic, elastic

    def energy_parts(self, displacement: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """This rank's share of each of ``energies`` in a motion (n_local,) [J], shape (2,).

        Collective.
        """
        operators = self.operators
        ahead = operators.factor.copy()
        np.copyto(operators.factor, velocity)
        kinetic = 0.5 * operators.square("mass")
        np.copyto(operators.factor, displacement)
        elastic = 0.5 * operators.square("stiffness")
        np.copyto(operators.factor, ahead)
        return np.array([kinetic, elastic])

    @property
    def remembers(self) -> bool:
        """Whether a line goes on beyond an end, so that a step also depends on ``past``."""
        return self.loads is not None and self.loads.memories is not None

    def past(self) -> np.ndarray | None:
        """Memory of the ends that go on, see ``EndMemories.past``; None if there are none.
        Collective."""
        memories = None if self.loads is None else self.loads.memories
        return None if memories is None else memories.past()

    def recall(self, past: np.ndarray, n_steps: int) -> None:
        """Restore the memory of the ends: the first ``n_steps`` of ``past``. Not collective."""
        if self.loads is not None and self.loads.memories is not None:
            self.loads.memories.recall(past, n_steps)

    def destroy(self) -> None:
        """Free all PETSc objects. Collective."""
        if self.loads is not None and self.loads.memories is not None:
            self.loads.memories.destroy()
        self.operators.destroy()
        self.solution.destroy()


class StationPasses:
    """Takes free steps. Not collective.

    Attributes
    ----------
    native : compiled steps
    are_compiled : whether kernels were compiled for what its stations join
    parts : ``native.PassParts``
    factors : as given
    known : accelerations that the motion keeps besides x, y and z, or none

    Parameters
    ----------
    parts : product, factors and their arrays. The rank's own part of ``read`` is x of the motion,
        other ranks' parts are exchanged before a step; its own part of ``rates`` is y or the
        predicted velocity, that of ``answer`` the acceleration
    loads : forces on all unknowns that are solved for [N], or none, added in the pass forth; kept
        by reference
    motion : motion of the rank's own stations
    """

    def __init__(
        self,
        parts: ByStations,
        loads: np.ndarray,
        motion: PredictedLineState,
    ) -> None:
        product, factors, read, velocity, answer, by_mass = parts
        _, _, low, high, _ = factors.arrays.ends.tolist()
        self.factors = factors
        self.known = motion.known
        starts = factors.stations.starts
        self._starts = starts[low : high + 1] - starts[low]
        self._stretch = max(1, _STRETCH * (high - low) // max(1, int(self._starts[-1])))
        pairs = zip(product.layout.parts, factors.layout.parts, strict=True)
        layouts = [(rows.native, columns.native) for rows, columns in pairs]
        self.are_compiled = all(starmap(native.are_compiled, layouts))
        arrays = native.PassArrays(
            read, velocity, loads, answer, motion.read, self.known, motion.predicted
        )
        stations = product.stations.station_types, product.arrays, factors.arrays
        self.parts = native.PassParts(layouts, *stations, arrays, motion.changes(by_mass))
        self.native = native.TwoPasses(self.parts)
        self.track_links(NO_LINKS, np.zeros(0))

    def track_links(self, links: native.Links, reserve: np.ndarray) -> None:
        """Fill ``reserve`` on the way back, as ``LineIntegrator.track_links``.

        Links are looked at once the pass has left them behind, a stretch of stations at a time.
        """
        self.native.track(self.tracked(links, reserve))

    def tracked(self, links: native.Links, reserve: np.ndarray) -> native.TrackedLinks:
        """Arguments of the kernels for ``track_links``."""
        starts, n = self._starts, self._starts.size - 1
        middle, n_pairs = n // 2, (n - 1) // 2
        n_stretches = max(1, -(-n_pairs // self._stretch))
        # Unknowns that are solved for after each stretch; the last one is all that is left.
        reach = np.minimum(self._stretch * np.arange(1, n_stretches + 1), n_pairs)
        begin, end = starts[middle - reach], starts[middle + reach + 1]
        begin[-1], end[-1] = 0, starts[-1]
        low, high = links.unknowns.min(axis=1), links.unknowns.max(axis=1)
        first = int(np.append(links.unknowns[:, 0] >= starts[middle], True).argmax())

        def counts(low: np.ndarray, high: np.ndarray) -> np.ndarray:
            """How many links, one after the other outwards, are left behind with each stretch."""
            least, most = np.minimum.accumulate(low), np.maximum.accumulate(high)
            inside = np.searchsorted(-least, -begin, side="right"), np.searchsorted(most, end)
            return np.minimum(*inside)

        ranges = np.full((1 + n_stretches, 2), first)
        ranges[1:, 0] -= counts(low[:first][::-1], high[:first][::-1])
        ranges[1:, 1] += counts(low[first:], high[first:])
        return native.TrackedLinks(links, reserve, ranges, self._stretch)

    @property
    def scenes_at_once(self) -> list[int]:
        """Numbers of scenes, ascending, that kernels step side by side on this line."""
        return native.scenes_at_once(self.parts.layouts)

    def arrays_in_lanes(self, n_lanes: int, is_loaded: bool = False) -> native.PassArrays:
        """Arrays of ``n_lanes`` motions at rest; values of an unknown in all lanes are contiguous.

        Loads [N] of whole pairs of unknowns, if there are any, stand where a step puts the
        accelerations: it reads those of a station before. One rank, Newmark's method.
        """
        given = self.parts.arrays
        n = given.motion.x.size
        pad = (given.factor.size - n) // 2
        own = slice(pad * n_lanes, (pad + n) * n_lanes)
        assert np.shares_memory(given.motion.x, given.factor)
        assert np.shares_memory(given.answer, given.motion.z)
        factor, loads, velocity = (
            aligned_arrays.zeros(size * n_lanes, place)
            for place, size in enumerate((given.factor.size, n + n % 2, given.factor.size))
        )
        answer = loads[: n * n_lanes]
        reads_rates = np.shares_memory(given.velocity, given.motion.y)
        motion = native.Motion(factor[own], velocity[own], answer, given.motion.shares, n_lanes)
        return given._replace(
            factor=factor,
            velocity=velocity if reads_rates else factor,
            loads=loads if is_loaded else _NO_LOADS,
            answer=answer,
            motion=motion,
        )


def make_line(
    comm: Any,
    model: Model,
    ownership: Ownership,
    numerics: Numerics,
    only_free: bool = True,
    wanted: WantedPieces | None = None,
) -> LineIntegrator:
    """The line with the method that the numerics ask for. Collective.

    Parameters
    ----------
    comm : mpi4py communicator
        Communicator of the ranks.
    model : Model
        Discrete line.
    ownership : Ownership
        Which unknowns this rank owns.
    numerics : Numerics
        Time step and integrator of the run.
    only_free : bool, optional
        Whether all steps are free ones, not taken in parts.
    wanted : WantedPieces, optional
        Part of the line that steps need at a time, None if all of it.
    """
    weights = numerics.spectral_radius, numerics.beta, numerics.gamma
    chosen = integration_of(numerics.integrator, *weights)
    line = LineIntegrator(comm, model, ownership, numerics.dt, chosen, wanted)
    if only_free:
        line.keep_ahead()
    reason = slow_method(numerics)
    if reason and numerics.scheme == "one_solve":
        line.slow_path = SlowPath(reason, PARTS)
    reason = slow_load(model)
    if reason and line.slow_path is None:
        line.slow_path = SlowPath(reason, CALLED)
    if line.slow_path is not None and comm.rank == 0:
        warn_of_slow_path(line.slow_path)
    return line
