"""Contact laws while they are marched: linearised at an iterate, with what they remember.

Each gives, for n contacts, own f = offset + by_depth d + by_rate d' with depth d [m] and rate d'
[m/s], which is the law itself or its tangent. Lives on rank 0; not collective.
"""

from __future__ import annotations

import numpy as np

from catenary.base.errors import RunBroken
from catenary.solver.kernels import native
from catenary.solver.problem.contact_laws import HertzLaw, KinematicLaw
from catenary.solver.problem.problem import Problem, Simulated


class LawInSteps:
    """A law for n contacts; by itself one of a spring and a damper, which remembers nothing.

    Attributes
    ----------
    n : number of contacts
    tangents : ``native.Tangents``, those where the law was linearised last
    marched : the law as kernels linearise it, None if the tangents are the law
    pulls : whether forces below zero are part of the law
    """

    marched: HertzInSteps | None = None

    def __init__(
        self, n: int, by_depth: float, by_rate: float, pulls: bool, own: float = 1.0
    ) -> None:
        self.n = n
        self.tangents = native.Tangents(
            np.full(n, own), np.zeros(n), np.full(n, by_depth), np.full(n, by_rate)
        )
        self.pulls = pulls
        self._memory = np.zeros(0)

    def force(self, depth: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """The law itself without the cut at zero (n,) [N]."""
        return np.asarray(self.tangents.by_depth * depth + self.tangents.by_rate * rate)

    def accept(self, time: float, depth: np.ndarray, rate: np.ndarray, force: np.ndarray) -> None:
        """Store what the law needs of an accepted step.

        Parameters
        ----------
        time : float
            Time at the end of the step [s].
        depth, rate : ndarray, shape (n,)
            Depths [m] and their rates [m/s] at the end of the step.
        force : ndarray, shape (n,)
            Contact forces at the end of the step [N], compression positive.

        Raises
        ------
        RunBroken
            If the law no longer holds.
        """

    def reported(self, force: np.ndarray) -> np.ndarray:
        """Recorded part of the forces (n,) of the latest step [N]."""
        return force

    def in_loop(self) -> native.StepLaw:
        """The law for a loop of kernels; forces count as they are."""
        reported = native.ReportedForces(0.0, 0.0, np.zeros(0), np.zeros(self.n))
        return native.StepLaw(self.marched, reported)

    def state(self) -> np.ndarray:
        """Memory of the law, as one array."""
        return self._memory.copy()

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""
        self._memory[:] = state


class HertzInSteps(LawInSteps):
    """Hertz's law with hysteresis, which remembers the speed of each contact's last impact.

    That is the rate at the start of the step in which the gap closes.

    Attributes
    ----------
    law : HertzLaw
    speed : (n,) speed of the last impact of a closed contact, of the next one of an open contact
        [m/s]
    there : (n,) forces of the law at the latest point of linearisation, not cut at zero [N]
    """

    def __init__(self, law: HertzLaw, n: int) -> None:
        super().__init__(n, 0.0, 0.0, pulls=False)
        self.law, self.marched = law, self
        self.speed = self._memory = np.full(n, law.least_speed)
        self.there = np.zeros(n)
        self._linearise = native.linearise.bound(self)
        self._remember = native.remember.bound(self)

    def force(self, depth: np.ndarray, rate: np.ndarray) -> np.ndarray:
        self._linearise(depth, rate)
        return self.there

    def accept(self, time: float, depth: np.ndarray, rate: np.ndarray, force: np.ndarray) -> None:
        self._remember(depth, rate)


class KinematicInSteps(LawInSteps):
    """Head and wire as one: d + tau d' = 0, with which a depth is gone after two steps.

    A force at the end of a step acts on heights and velocities through its mean with the one
    before, w f + (1 - w) f_before with Newmark's w = gamma. That mean is the contact force; the
    force itself alternates about it from step to step. While the pantographs are being raised,
    until ``from_time`` [s], the wire may pull them along.
    """

    def __init__(self, n: int, dt: float, gamma: float, from_time: float) -> None:
        super().__init__(n, 1.0, 0.5 * dt, pulls=True, own=0.0)
        self._gamma = gamma
        self._from_time = from_time
        self._force = self._memory = np.zeros(n)
        self._mean = np.zeros(n)

    def accept(self, time: float, depth: np.ndarray, rate: np.ndarray, force: np.ndarray) -> None:
        """End the run where head and wire would have to pull at each other."""
        self._mean[:] = self._gamma * force + (1.0 - self._gamma) * self._force
        self._force[:] = force
        if time > self._from_time and (self._mean < 0.0).any():
            number = int(np.argmin(self._mean)) + 1
            raise RunBroken(
                f"contact {number} would have to pull with {-self._mean.min():.3g} N: the "
                "kinematic contact law holds only while contact lasts; take contact.law = "
                '"linear"'
            )

    def reported(self, force: np.ndarray) -> np.ndarray:
        return self._mean

    def in_loop(self) -> native.StepLaw:
        """Means over the steps; none may pull once the pantographs are raised."""
        reported = native.ReportedForces(self._gamma, self._from_time, self._force, self._mean)
        return native.StepLaw(None, reported)


def law_in_steps(problem: Problem, simulated: Simulated, n: int) -> LawInSteps:
    """The simulated law of n contacts, for the problem's steps."""
    law, numerics = simulated.contact, problem.numerics
    if isinstance(law, KinematicLaw):
        return KinematicInSteps(n, numerics.dt, numerics.gamma, problem.train.raise_time)
    if isinstance(law, HertzLaw):
        return HertzInSteps(law, n)
    return LawInSteps(n, law.stiffness, law.damping, pulls=not simulated.contact_loss)
