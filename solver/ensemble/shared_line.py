"""A line that several scenes share: matrices, factors, columns and the motion in each of them.

Scenes that differ in their trains, pantographs and contact laws alone have the same line at rest,
the same factors and the same answers to unit forces. Their motions stand in lanes: the numbers of
an unknown in all scenes follow each other, so that a step reads each number of a factor once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from catenary.base.lone_process import alone
from catenary.meshgen.mesh import DROPPERS
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.contact.followed_links import FollowedLinks
from catenary.solver.contact.forces_on_line import ForceColumns
from catenary.solver.integrators.line_state import LineState, Motion
from catenary.solver.integrators.make_line import make_line
from catenary.solver.integrators.two_pass_step import StationPasses
from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.model.partition import distribute
from catenary.solver.model.switching_links import LinkArrays, switching_links
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest

N_LANES: int = native.SCENES


class LineExtremes(NamedTuple):
    """Extremes of what a line shows in each lane; see ``kernels/ensemble/scene_passes.hpp``.

    Attributes
    ----------
    arms : (n_arms,) unknowns of vertical displacement at steady arms
    droppers : LinkArrays
    uplift : (n_arms, N_LANES) largest displacement [m]
    least, largest : (n_droppers, N_LANES) forces of droppers [N]
    """

    arms: np.ndarray
    droppers: LinkArrays
    uplift: np.ndarray
    least: np.ndarray
    largest: np.ndarray


class Lane(NamedTuple):
    """A scene's part of a shared line: its motion, and the links that are followed in it."""

    motion: LineState
    links: FollowedLinks


class SharedLine:
    """A line at rest with all that steps it in several scenes at once. One process only.

    Attributes
    ----------
    at_rest : LineAtRest
    steps_together : whether kernels step it in several scenes; there is nothing else if not
    wires, columns, line : as a ``March`` has them
    lanes : one for each scene
    extremes : LineExtremes
    native : what takes steps, ``native.Ensemble``

    Parameters
    ----------
    at_rest : line at rest, of a problem for which ``why_alone`` has no reason
    range_of_run : stretch of the contact wires that pan heads of all scenes touch [m]
    """

    def __init__(self, at_rest: LineAtRest, range_of_run: tuple[float, float]) -> None:
        self.comm: Any = alone()
        self.at_rest = at_rest
        model, form = at_rest.model, at_rest.form
        self.ownership = distribute(model, 1, 0)
        self.line = make_line(self.comm, model, self.ownership, at_rest.problem.numerics)
        passes = self.line.passes
        self.steps_together = (
            passes is not None
            and not model.loads
            and all(map(native.are_compiled_for_scenes, passes.rows, passes.columns))
        )
        if passes is None or not self.steps_together:
            return
        self.wires = ContactWires(model, form, self.ownership)
        table = switching_links(model, form.dropper_force)
        links = [FollowedLinks(table, self.line) for _ in range(N_LANES)]
        self.columns = ForceColumns(self.comm, model, self.wires, self.line, links[0], range_of_run)
        arrays, motions = _in_lanes(passes, self.line.motion)
        parts = passes.parts._replace(arrays=arrays)
        self.lanes = [Lane(*pair) for pair in zip(motions, links, strict=True)]
        numbers, droppers, _ = links[0].shown(DROPPERS)
        arms = model.dofs(model.mesh.steady_arms).astype(np.int64)
        self.extremes = LineExtremes(
            arms,
            droppers,
            np.zeros((arms.size, N_LANES)),
            *np.zeros((2, numbers.size, N_LANES)),
        )
        self._at_rest_force = droppers.law["rest"] * droppers.law["carried"]
        self.native = native.Ensemble(passes.rows, passes.columns, parts, self.extremes)
        followed = passes.tracked(links[0].links, links[0].reserve)
        self.native.track(followed, [own.reserve for own in links])

    def clear(self, lane: int) -> None:
        """Put the line of a lane at rest."""
        self.native.rest(lane)
        self.extremes.uplift[:, lane] = 0.0
        self.extremes.least[:, lane] = self.extremes.largest[:, lane] = self._at_rest_force

    def destroy(self) -> None:
        """Free all PETSc objects."""
        self.line.destroy()


def _in_lanes(passes: StationPasses, motion: LineState) -> tuple[Any, Sequence[LineState]]:
    """Arrays of passes over all lanes, and the motion in each of them."""
    given = passes.parts.arrays
    x, n = given.motion.x, given.motion.x.size
    pad = (given.factor.size - n) // 2
    own = slice(pad * N_LANES, (pad + n) * N_LANES)
    factor = aligned_arrays.zeros(given.factor.size * N_LANES, 0)
    answer = aligned_arrays.zeros(n * N_LANES, 1)
    rates = np.shares_memory(given.velocity, given.motion.y)
    velocity = aligned_arrays.zeros(given.factor.size * N_LANES, 2)
    assert np.shares_memory(x, given.factor) and np.shares_memory(given.answer, given.motion.z)
    arrays = given._replace(
        factor=factor,
        velocity=velocity if rates else factor,
        answer=answer,
        motion=Motion(factor[own], velocity[own], answer, given.motion.shares, N_LANES),
    )
    motions = []
    for lane in range(N_LANES):
        read = Motion(
            factor[own][lane:],
            velocity[own][lane:],
            answer[lane:],
            given.motion.shares,
            N_LANES,
        )
        motions.append(LineState.of(read, motion.gains))
    return arrays, motions


def why_alone(problem: Problem) -> str:
    """Why scenes of a problem's line cannot step side by side, empty if they can."""
    numerics = problem.numerics
    if numerics.scheme != "one_solve" or numerics.coupling != "implicit":
        return "its scheme takes steps in parts"
    if numerics.integrator != "newmark":
        return "its integrator is not Newmark's"
    if numerics.adaptive_tolerance is not None:
        return "its steps are adaptive"
    if problem.window.moves:
        return "a window of its line follows the train"
    if problem.incidents:
        return "incidents change its line on the way"
    return ""
