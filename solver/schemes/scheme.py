"""Interface of a scheme: a way through a time step for line and pantographs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from catenary.solver.contact.forces_on_line import ForcesOnLine
from catenary.solver.contact.pantographs import Pantographs


def find_crossings(interaction: ForcesOnLine, pantographs: Pantographs, time: float) -> None:
    """Find where wires that move sideways cross the strips at ``time`` [s], the end of a step.

    Contacts are located then, and their forces do not act yet. Collective."""
    interaction.find_across()
    pantographs.cross(time, interaction.presence)


@dataclass
class Counters:
    """Counts of the work of a run's steps.

    ``repeated_steps``: bounds of what may slacken were too small; ``pivoted_steps``: the active
    set of contacts and slack droppers cycled, and pivoting found it; ``unconverged_steps``:
    iterations ended above their tolerances, which ends the run (``Stepper`` counts that step)
    unless their number is given.
    """

    steps: int = 0
    rounds: int = 0
    repeated_steps: int = 0
    pivoted_steps: int = 0
    slack_dropper_steps: int = 0
    solves: int = 0
    unconverged_steps: int = 0

    def as_dict(self) -> dict[str, int]:
        """Names and counts, for the result file."""
        return dict(self.__dict__)


class Decision(NamedTuple):
    """Whether a step is taken, and the level of the next, or of its repetition."""

    accepted: bool
    level: int


class StepController(Protocol):
    """Decides on steps whose forces are found, where steps adapt (`adaptive_steps`)."""

    def decide(
        self,
        time: float,
        depth: np.ndarray,
        force: np.ndarray,
        stiffness: np.ndarray,
        compliance: np.ndarray,
    ) -> Decision:
        """Accept or reject a step; parameters as of `StepError.of`. Rank 0 only."""

    def set_level(self, level: int) -> None:
        """Set the level of the next step, as ``decide`` returned it on rank 0. All ranks."""


class StepRejected(Exception):
    """Step control rejected the step; only the state of the line has changed. On all ranks."""


class Scheme(ABC):
    """Advances line and pantographs by one step."""

    counters: Counters
    pantographs: Pantographs

    @abstractmethod
    def step(self, time: float, stop: bool) -> bool:
        """Advance to ``time`` [s]; False if ``stop`` is set on any rank. Collective.

        Raises
        ------
        RunBroken
            On all ranks, if the step has no solution or a result is not finite; NotConverged if
            iterations ended above their tolerances. ``Stepper`` adds time and place to the message.
        """

    @property
    def traffic(self) -> tuple[int, int] | None:
        """Messages and bytes that this rank sent so far, those to neighbours left out; None if
        they are not counted."""
        return None

    @abstractmethod
    def state(self) -> np.ndarray:
        """State of the contacts from which a run continues, as one array."""

    @abstractmethod
    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""

    def destroy(self) -> None:  # noqa: B027  (many have none)
        """Free PETSc objects of the scheme's own. Collective."""
