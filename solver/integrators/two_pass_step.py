"""A line's step without contacts in two passes over its state, for Newmark's family.

Forth, from both ends of the line to its middle: product with K and elimination, station by station.
Back: substitution, correction, and the prediction of the step to come. A step that does these one
after the other reads the state from memory as often as there are of them, which is what long lines
wait for. Two chains of stations go side by side, each of which waits for itself only.
"""

from __future__ import annotations

import numpy as np

from catenary.solver.base.kernels.pointers import HeldCall
from catenary.solver.integrators.line_state import AlphaAhead, AlphaSteps, PredictedLineState, Steps
from catenary.solver.integrators.two_pass_kernels import (
    follow,
    left_behind,
    predict,
    predict_velocities,
)
from catenary.solver.kernels import native
from catenary.solver.linear.step_operators import ByStations
from catenary.solver.model.switching_links import NO_LINKS, LinkArrays
from catenary.solver.window.window_kernels import NO_WINDOW, WindowArrays

# Unknowns of a stretch of the pass back, after which its droppers are looked at: large enough for
# memory to be read ahead, 64 kB of each array, which a cache next to a processor holds.
_STRETCH = 8192


class StationPasses:
    """Takes free steps. Not collective.

    Attributes
    ----------
    held : a step for compiled loops that take steps themselves, by its ``address``
    factors : as given
    known : what the motion keeps besides x, y and z, or nothing
    by_mass : whether right-hand sides are made by M, as where that is shorter than by K

    Parameters
    ----------
    parts : product, factors and what they work on. The rank's own part of ``read`` is x of the
        motion, and what others have of it is there before a step; that of ``rates`` is y of the
        motion, or of what it predicts of the velocity; that of ``answer`` is the acceleration
    loads : of all that is solved for [N], or none, added in the pass forth; kept by reference
    motion : of the rank's own stations
    steps : those that the motion is kept for
    """

    def __init__(
        self,
        parts: ByStations,
        loads: np.ndarray,
        motion: PredictedLineState,
        steps: Steps | AlphaSteps,
    ) -> None:
        product, factors, read, velocity, answer, by_mass = parts
        _, _, low, high, _ = factors.ends.tolist()
        self.by_mass, self.factors = by_mass != 0.0, factors
        changes, known, predicted = changes_of(motion, steps, by_mass)
        starts = factors.starts[low : high + 1] - factors.starts[low]
        self._stretch = max(1, _STRETCH * (high - low) // max(1, int(starts[-1])))
        self._place = low, high, self._stretch, starts
        self._changes, self._motion = changes, (*motion.read, known, predicted)
        layouts = [
            (of_rows.native, of_factors.native)
            for of_rows, of_factors in zip(product.layout.parts, factors.layout.parts, strict=True)
        ]
        arrays = read, velocity, loads, answer, *motion.read[:3], known
        self.held = native.Passes(
            *(layouts, product.stations.make_ups, product.native, factors.native), arrays, changes
        )
        self._window, self.known = NO_WINDOW, known
        self.track_links(NO_LINKS, np.zeros(0))

    def track_links(self, links: LinkArrays, reserve: np.ndarray) -> None:
        """Fill ``reserve`` on the way back, as ``LineIntegrator.track_links``."""
        window, motion = self._window, self._motion
        if window is NO_WINDOW:
            stretch, ranges = self._stretch, left_behind(*self._place, links.unknowns)
        else:
            stretch, ranges = window.low.size, window.ranges
        count = np.zeros(1, dtype=np.int64)
        ahead = motion, self._changes, links, reserve, count, window
        following = motion[:4], links, reserve, ranges, count
        # Kept, as what the passes have is where these are.
        self._around = HeldCall(predict, ahead), HeldCall(follow, following)
        self.held.call(stretch, *(around.address for around in self._around))

    def open(self, window: WindowArrays, links: LinkArrays, reserve: np.ndarray) -> None:
        """Take steps of the stations in a window only from now on; links as in ``track_links``."""
        self._window = window
        self.track_links(links, reserve)

    def predict_velocities(self) -> None:
        """Fill in the rank's own part of what others read of it in a product with C. A step does
        so, too, but only after these have read."""
        predict_velocities(self._motion, self._changes, 0, self._motion[0].size)

    def step(self) -> None:
        """Find the accelerations and what the next step starts from."""
        self.held.step()


def changes_of(
    motion: PredictedLineState, steps: Steps | AlphaSteps, by_mass: float
) -> tuple[tuple[float, ...], np.ndarray, np.ndarray]:
    """Numbers that take a state from one prediction to the next, the known acceleration, and the
    array for predicted velocities."""
    by_position, by_velocity, _ = map(float, motion.gains)
    if isinstance(steps, Steps):
        newmark = steps.dt, by_position, by_velocity, steps.damping_share
        return (*newmark, *[0.0] * 6, by_mass), np.zeros(0), np.zeros(0)
    assert isinstance(motion, AlphaAhead)
    of_balanced, of_known = steps.balance

    def from_kept(shares: tuple[float, float]) -> tuple[float, float]:
        """Shares of b and p as those of z and p."""
        return shares[0] / of_balanced, shares[1] - shares[0] * of_known / of_balanced

    # z of the end of the step stands for its part of the coming prediction.
    by_position += of_balanced
    step = steps.dt, by_position, by_velocity, steps.damping_share
    more = *from_kept(steps.known), *from_kept(steps.velocity), *steps.balance, by_mass
    return tuple(map(float, (*step, *more))), motion.known, motion.predicted
