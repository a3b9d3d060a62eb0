"""Watches a march: its energy, how far it leaves linear theory, and contacts that are lost.

*Energy.* Average acceleration keeps the energy of a linear line exactly and damping only takes, so
that the energy of the line may grow by the work of the contact forces and no more:

    E(t) - E(0) <= W(t).

Whatever lies above is made by the time integration, in steps in which one-sided links switch. It is
a lower bound, since damping has taken a part. Lines under gusts or other loads in time are not
judged by it: these do work as well. Nor are lines with incidents, whose energy jumps.

*Motion.* The line is linear about its rest. The force of a wire across the track of its rest is
T sin(phi) in place of T phi: at 0.1 rad wrong by 0.2 %, at 1 rad by 16 %, and the tension, taken as
constant, by 0.5 and 46 %. A steady arm turns by its lift over its length: at 30 degrees its force
is off by some 15 %, and its end cannot be lifted by more than its length.

*Contact.* A raised pantograph that does not touch the wire for as long as the train takes for a
span is reported.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any

import numpy as np

from catenary.base.errors import RunBroken
from catenary.postproc.evaluate.wording import capital
from catenary.postproc.files.header import in_sentence, places_on_train
from catenary.solver.model.beam import MOST_ROTATION
from catenary.solver.model.loads import MemoryLoad
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.time_loop.views.observers import NEVER, Observer, Stage, StepView

logger = logging.getLogger("catenary.watch")
strip_logger = logging.getLogger("catenary.strips")

# Share of the work of the contacts above which energy made by the scheme is reported.
REPORTED_SHARE = 0.05
# Rotation of a wire from rest [rad], and lift of a steady arm over its length [-], above which the
# watch reports it, and ends the march.
REPORTED_ROTATION = 0.1
REPORTED_ARM, MOST_ARM = 0.5, 1.0
_ROTATIONS = ("theta_y", "theta_z")
# Time between two looks at energy and motion [s]. A look takes as long as twenty steps of 1 ms.
_LOOKS = 1.0


class RunWatch(Observer):
    """Observer that judges a march while it goes on. Collective.

    Each fault is reported once, when it is seen; ``facts`` has them at the end.

    Parameters
    ----------
    comm : mpi4py communicator
    at_rest : line of the run
    has_train : whether there is one, without which there are no contacts
    every : steps between two looks at energy and motion, those of ``_LOOKS`` if None

    Attributes
    ----------
    remarks : sentences on what was wrong, on rank 0
    """

    def __init__(
        self, comm: Any, at_rest: LineAtRest, has_train: bool = True, every: int | None = None
    ) -> None:
        problem, model = at_rest.problem, at_rest.model
        numerics, train = problem.numerics, problem.train
        self._comm, self._every = comm, every or max(1, round(_LOOKS / numerics.dt))
        # Energy of the line under the static forces, beside which energies are judged [J].
        static = sum(place.static_force**2 for place in train.placements)
        self._static_energy = 0.5 * static * float(np.max(at_rest.lift.lift, initial=0.0))
        # Whether it can grow by the work of contacts alone, and that work is summed.
        outer = any(not isinstance(load, MemoryLoad) for load in model.loads)
        steady = not outer and not model.simulated.incidents
        self._counts_energy = steady and numerics.adaptive_tolerance is None
        # Lengths of steady arms, infinite where they have none [m].
        lengths = np.array([*(arms.kind.length for arms in problem.line.steady_arms), 0.0])
        lengths[lengths == 0.0] = np.inf
        self._arm_lengths = lengths[model.mesh.arm_group]
        # Time from which on each pantograph is raised [s].
        self._raised = [
            train.raise_time if has_train and place.lowering is None else np.inf
            for place in train.placements
        ]
        self._span = float(np.diff(problem.line.support_positions).max())
        # Of line and pantographs, which is not stable at any step unless it is implicit.
        self._coupling = numerics.coupling if has_train else "implicit"
        self.remarks: list[str] = []
        self._reported: set[str] = set()
        self._start: tuple[float, float] | None = None
        self._energy = self._most_energy = self._work = self._most_work = self._made = 0.0
        self._rotation = self._turned = 0.0

    def start(self, stage: Stage) -> None:
        """Begin to watch a march."""
        self._dt, self._n_steps = stage.dt, stage.n_steps
        self._x = stage.node_points[stage.owned_nodes, 0]
        self._rotations = [name for name in _ROTATIONS if name in stage.unknowns]
        self._arm_length = self._arm_lengths[stage.owned_arms]
        self._arm_x = stage.arm_x[stage.owned_arms]
        self._lost_since = np.full(stage.n_pantographs, np.nan)
        self._lost_at = np.zeros(stage.n_pantographs)
        self._names = [in_sentence(place) for place in places_on_train(stage.n_pantographs)]

    def next_state(self, step: int) -> int:
        """The step of the next look; rows of others will do."""
        return step - step % self._every + self._every

    def observe(self, view: StepView) -> None:
        """Look at steps.

        Raises
        ------
        RunBroken
            On all ranks, where the march has left what its model bears.
        """
        self._check_contact(view)
        if view.step % self._every == 0 or view.step == self._n_steps or self._start is None:
            self._look(view)

    def finish(self, outcome: str) -> None:
        """Tell of contacts that are lost to the end."""
        for p in np.flatnonzero(np.isfinite(self._lost_since)):
            if f"lost {p}" in self._reported:
                self._say(
                    f"lost for good {p}",
                    f"{capital(self._names[p])} touches no wire from {self._lost_since[p]:.4g} s, "
                    f"{self._lost_at[p]:.4g} m on to the end of the run.",
                )

    def facts(self) -> dict[str, Any]:
        """Numbers and sentences for the result file."""
        if self._start is None:
            return {}
        facts: dict[str, Any] = {
            "remarks": self.remarks,
            "largest_rotation_rad": self._rotation,
            "largest_arm_turn": self._turned,
            "line_energy_J": self._energy,
            "most_line_energy_J": self._most_energy,
        }
        if self._counts_energy:
            facts |= {"contact_work_J": self._work, "energy_made_J": self._made}
        return facts

    def _look(self, view: StepView) -> None:
        energy = float(sum(view.energies()[:2]))
        work = float(self._comm.allreduce(view.contact_work()))
        if self._start is None:
            self._start = energy, work
        self._energy, self._work = energy - self._start[0], work - self._start[1]
        self._most_energy = max(self._most_energy, self._energy)
        self._check_motion(view)
        if self._counts_energy:
            self._check_energy(view)

    def _check_energy(self, view: StepView) -> None:
        self._most_work = max(self._most_work, abs(self._work))
        given = self._most_work + self._static_energy
        made = self._energy - self._work
        self._made = max(self._made, made)
        if not made <= REPORTED_SHARE * given:
            self._say(
                "energy",
                f"The time integration makes energy: at {self._where(view)} the line has "
                f"{self._energy:.3g} J, {made:.3g} J more than the contact forces have given it "
                f"({self._work:.3g} J). Take a smaller numerics.dt_s, damping of the droppers, or "
                'numerics.integrator = "generalized_alpha" with a spectral_radius below 1.',
            )
        if not made <= given:
            raise RunBroken(
                f"at {self._where(view)} the time integration has made more energy ({made:.3g} J) "
                f"than the contact forces have given the line ({self._work:.3g} J): results are of "
                "no use from here on; take a smaller numerics.dt_s, or damp the droppers"
            )

    def _check_motion(self, view: StepView) -> None:
        rotation, x = self._largest(
            np.max([np.abs(view.node_motion(name, False)) for name in self._rotations], axis=0),
            self._x,
        )
        self._rotation = max(self._rotation, rotation)
        self._judge(
            view,
            "rotation",
            (rotation, REPORTED_ROTATION, MOST_ROTATION),
            f"a wire has turned by {rotation:.3g} rad from rest at {x:.4g} m",
            "the linear model of a wire",
        )
        turned, x = self._largest(np.abs(view.arm_uplift) / self._arm_length, self._arm_x)
        self._turned = max(self._turned, turned)
        self._judge(
            view,
            "arm",
            (turned, REPORTED_ARM, MOST_ARM),
            f"the steady arm at {x:.4g} m is lifted by {turned:.3g} of its length",
            "the linear model of an arm",
        )

    def _judge(
        self,
        view: StepView,
        key: str,
        value: tuple[float, float, float],
        what: str,
        model: str,
    ) -> None:
        found, limit, most = value
        if not found <= limit:
            self._say(key, f"At {self._where(view)} {what}; {model} holds up to {limit:g}.")
        if not found <= most:
            suspects = "arms that are pushed at rest, too long a numerics.dt_s, "
            if self._coupling != "implicit":
                suspects += f'the {self._coupling} coupling (numerics.coupling = "implicit"), '
            raise RunBroken(
                f"at {self._where(view)} {what}, and {model} ends at {most:g}: look for steady "
                f"{suspects}or loads beyond any line's"
            )

    def _largest(self, values: np.ndarray, x: np.ndarray) -> tuple[float, float]:
        """The largest of the values on all ranks, and its place [m]. Collective."""
        here = (0.0, 0.0)
        if values.size:
            at = int(np.argmax(values))
            here = float(values[at]), float(x[at])
        if self._comm.size == 1:
            return here
        return max(self._comm.allgather(here))

    def _check_contact(self, view: StepView) -> None:
        times, forces = view.times, view.each("contact_force")
        if not forces.shape[1]:
            return  # on another rank
        places = view.each("contact_position")
        for p, raised in enumerate(self._raised):
            touching = np.flatnonzero((forces[:, p] != 0.0) | (times < raised))
            first = 0
            if touching.size:
                self._lost_since[p] = np.nan
                first = int(touching[-1]) + 1
                if first == times.size:
                    continue
            if np.isnan(self._lost_since[p]):
                self._lost_since[p], self._lost_at[p] = times[first], places[first, p]
            if places[-1, p] - self._lost_at[p] > self._span:
                self._say(
                    f"lost {p}",
                    f"{capital(self._names[p])} has not touched a wire for more than a span, from "
                    f"{self._lost_since[p]:.4g} s, {self._lost_at[p]:.4g} m on.",
                )

    def _where(self, view: StepView) -> str:
        position = self._comm.bcast(
            float(view.contact_position[0]) if view.contact_position.size else 0.0
        )
        return f"{view.time:.4g} s, train at {position:.4g} m,"

    def _say(self, key: str, sentence: str) -> None:
        """Tell a sentence once."""
        if key not in self._reported:
            self._reported.add(key)
            self.remarks.append(sentence)
            if self._comm.rank == 0:
                logger.warning(sentence)


class StripWatch(Observer):
    """Observer that warns once for each pantograph when a contact wire leaves its strips.

    Not collective; rank 0 sees them.

    Parameters
    ----------
    half_lengths : of the strips of each pantograph [m], NaN or infinite if it is not known
    """

    def __init__(self, half_lengths: Sequence[float]) -> None:
        self._half_lengths = half_lengths

    def start(self, stage: Stage) -> None:
        """Begin to watch a march."""
        ends = stage.train.n_wires * np.cumsum([0, *stage.train.n_strips])
        self._contacts = [slice(*pair) for pair in zip(ends[:-1], ends[1:], strict=True)]
        self._warned = [False] * stage.n_pantographs

    def next_state(self, step: int) -> int:
        """Rows are enough."""
        return NEVER

    def observe(self, view: StepView) -> None:
        """Check steps."""
        places = view.each("lateral_place")
        if not places.shape[1]:
            return  # on another rank
        for p, (half, own) in enumerate(zip(self._half_lengths, self._contacts, strict=True)):
            if self._warned[p]:
                continue
            beyond = (np.abs(places[:, own]) > half).any(axis=1)
            if beyond.any():
                self._warned[p] = True
                row = int(np.argmax(beyond))
                x = view.each("contact_position")[row, p]
                strip_logger.warning(
                    "a contact wire leaves the strips of %s at %.4g s, %.4g m: they end "
                    "%.3g m beside their middle; contact goes on as if it stayed on them",
                    in_sentence(places_on_train(len(self._contacts))[p]),
                    view.times[row],
                    x,
                    half,
                )
