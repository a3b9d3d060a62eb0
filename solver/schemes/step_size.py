"""The size of the next step from the estimated error of the last: the elementary controller."""

from __future__ import annotations

from dataclasses import dataclass, field

# The local error of a step of a method of order two falls with the cube of its size.
_ORDER = 3
# Share of the size for which the error would be the tolerance, and a factor of it for a step that
# is rejected a second time.
_SAFETY, _AFTER_REJECTION = 0.9, 0.5
# A size changes by these factors at most from a step to the next.
_LEAST, _MOST = 0.1, 10.0
_AFTER_FAILURE = 0.25


@dataclass
class StepSize:
    """Controls the error per step (Hairer, Norsett and Wanner, Solving ODEs I, section II.4).

    The next size is ``s h (tolerance / error)^(1/3)`` with a safety factor s, by the rules of
    PETSc's ``TSADAPTBASIC`` with its usual options. Not collective.

    Parameters
    ----------
    tolerance : of the estimated error of a step [N]
    longest, smallest : limits of the step size [s]
    """

    tolerance: float
    longest: float
    smallest: float
    _accepted: bool = field(default=True, init=False)

    def after_step(self, error: float, size: float) -> tuple[bool, float]:
        """Whether to take a step of ``size`` [s] that is wrong by ``error`` [N], and the size [s]
        of the next, or of its repetition. The smallest is taken in any case."""
        good = error <= self.tolerance
        safety = _SAFETY if good or self._accepted else _SAFETY * _AFTER_REJECTION
        factor = safety * (self.tolerance / error) ** (1 / _ORDER) if error > 0.0 else _MOST
        wanted = size * min(max(factor, _LEAST), _MOST)
        self._accepted = good or size < (1 + 1e-8) * self.smallest
        return self._accepted, min(max(wanted, self.smallest), self.longest)

    def after_failure(self, size: float) -> float:
        """Size [s] with which to repeat a step of ``size`` [s] that has no solution."""
        self._accepted = False
        return _AFTER_FAILURE * size
