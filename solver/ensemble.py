"""Marches of several scenes that share a line, side by side in the lanes of vectors.

Scenes that differ in their trains, pantographs and contact laws alone have the same line at rest,
the same factors and the same answers to unit forces; those that differ in errors of the droppers'
lengths, too, rest otherwise but have the same factors and answers. Their motions stand in lanes:
the numbers of an unknown in all scenes follow each other, so that a step reads each number of a
factor once. Lanes are filled as scenes come to their ends.

Droppers that are slack at rest in some scenes are taut in the matrices, as those that slacken under
way: displacements are counted from the shape that the line would have if droppers could push, where
matrices hold without compensations, and the line starts displaced from there.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import CatenaryError
from catenary.base.process import alone
from catenary.mbs.interface import drive_width
from catenary.meshgen.mesh import DROPPERS
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.contact.forces_on_line import FollowedLinks, ForceColumns, ForcesOnLine
from catenary.solver.contact.pantographs import Pantographs, nominal_height_rule
from catenary.solver.effects.all_effects import needs_form, simulated
from catenary.solver.effects.build_model import rebuilt
from catenary.solver.integrators.line_integrator import StationPasses, make_line
from catenary.solver.integrators.line_state import LineState
from catenary.solver.kernels import native
from catenary.solver.kernels.flush_to_zero import flushed
from catenary.solver.model.links import Links
from catenary.solver.model.model import Model, same_matrices
from catenary.solver.model.partition import distribute
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.switching_links import NO_LINKS, LinkTable, switching_links
from catenary.solver.problem.contact_laws import uses_rate
from catenary.solver.problem.problem import Problem, steps_of
from catenary.solver.schemes.make_scheme import one_solve
from catenary.solver.schemes.scheme import OneSolve, find_crossings
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.statics.rest_nearby import StiffLine
from catenary.solver.time_loop.compiled_steps import step_parts
from catenary.solver.time_loop.prepared_line import make_room, stepped_by_kernels

# Steps whose least time tells how many lanes are quickest.
_TRIALS = 10
# Steps between two looks at signals.
_MOST_STEPS = 4096


class TautLine(NamedTuple):
    """A line at rest, with displacements from the shape that it would have if droppers could push.

    Attributes
    ----------
    rest : model of the line at rest, whose droppers may be slack
    model, form : model with all droppers taut, and its shape, from which displacements count
    moved : (n_dofs,) displacement of the line at rest from ``form`` [m], [rad]
    links : LinkTable of ``model``
    """

    rest: Model
    model: Model
    form: Equilibrium
    moved: np.ndarray
    links: LinkTable


class TautLines:
    """Makes taut lines, which share a stiffness; keeps the latest."""

    def __init__(self) -> None:
        self._stiff: StiffLine | None = None
        self._latest: TautLine | None = None

    def of(self, at_rest: LineAtRest) -> TautLine:
        """The taut line of a line at rest. Not collective.

        It is the same line if no dropper is slack or if its matrices depend on its shape.
        """
        model, form = at_rest.model, at_rest.form
        if self._latest is None or self._latest.rest is not model:
            taut, moved = model, np.zeros(model.n_dofs)
            if model.dropper_gap.any() and not (model.droppers_bend or needs_form(model.problem)):
                taut = rebuilt(model, form=form, gap=None)
                if self._stiff is None:  # of a line with other matrices no lane takes the result
                    self._stiff = StiffLine(taut)
                moved, form = _displaced(taut, model.dropper_gap, form, self._stiff)
                taut.links = [_from_taut(own, moved) for own in taut.links]
            links = switching_links(taut, form.dropper_force)
            self._latest = TautLine(model, taut, form, moved, links)
        return self._latest


def _from_taut(own: Links, moved: np.ndarray) -> Links:
    """Open links, such as uplift stops, of a line whose displacements count from a shape in which
    its rest is ``moved`` (n_dofs,) [m]."""
    if not own.law["open"].any():
        return own
    law, (unknowns, weights) = own.law.copy(), own.direction
    stretch = (weights * moved[unknowns]).sum(axis=1)
    law["rest"] -= np.where(law["open"], law["stiffness"] * stretch, 0.0)
    return replace(own, law=law)


def _displaced(
    taut: Model, gap: np.ndarray, form: Equilibrium, stiff: StiffLine
) -> tuple[np.ndarray, Equilibrium]:
    """Displacement (n_dofs,) of the rest ``form`` from the taut shape, and the taut shape.

    Slack droppers lack ``gap`` (n_droppers,) [m] of being taut; the taut line carries the force
    that they release as a load.
    """
    unknowns, weights = taut.droppers.direction
    lacks = taut.dropper_stiffness * gap
    load, released = np.zeros(taut.n_dofs), 1.0 - taut.simulated.kept_ratio
    np.add.at(load, unknowns, -released * lacks[:, None] * weights)
    load[taut.constrained] = 0.0
    moved = stiff.moved(load)
    stretch = (weights * moved[unknowns]).sum(axis=1)
    every = np.arange(taut.mesh.n_nodes)
    force = np.where(gap > 0.0, -lacks, form.dropper_force)
    return moved, replace(
        form,
        height=form.height - moved[taut.dofs(every)],
        slope=form.slope - moved[taut.dofs(every, "theta_y")],
        dropper_force=force - taut.dropper_stiffness * stretch,
    )


class Lane:
    """A scene's part of a shared line.

    Attributes
    ----------
    number : of the lane
    motion : of the line in this scene
    links : its links whose state is followed
    taut : the line in the scene that is there
    wires, wires_at_rest : its contact wires where displacements are zero, and at rest
    """

    taut: TautLine | None = None
    wires: ContactWires
    wires_at_rest: ContactWires

    def __init__(self, number: int, motion: LineState, links: FollowedLinks) -> None:
        self.number, self.motion, self.links = number, motion, links


class SharedLine:
    """A line at rest with all that steps it in several scenes at once. One process only.

    Attributes
    ----------
    steps_together : whether kernels step it in several scenes; there is nothing else if not
    columns, line : as a ``March`` has them
    lanes : one for each scene
    extremes : ``native.LineExtremes``
    native : compiled steps, ``native.Ensemble``

    Parameters
    ----------
    at_rest : line at rest, of a problem for which ``why_alone`` has no reason
    range_of_run : stretch of the contact wires that pan heads of all scenes touch [m]
    n_scenes : so many march at once
    """

    def __init__(
        self, at_rest: LineAtRest, range_of_run: tuple[float, float], n_scenes: int
    ) -> None:
        self.comm: Any = alone()
        self._taut = TautLines()
        _, model, form, _, self._table = self._taut.of(at_rest)
        self._model = model
        self.ownership = distribute(model, 1, 0)
        self.line = make_line(self.comm, model, self.ownership, at_rest.problem.numerics)
        passes = self.line.passes
        self.steps_together = (
            passes is not None
            and not model.loads
            and not model.droppers_bend  # extremes of forces know one slope
            and bool(passes.scenes_at_once)
        )
        if passes is None or not self.steps_together:
            return
        self._wires = ContactWires(model, form, self.ownership)
        n_lanes = _quickest(passes, n_scenes)
        lanes = range(n_lanes)
        links = [FollowedLinks(self._table, self.line) for _ in lanes]
        self.columns = ForceColumns(
            self.comm, model, self._wires, self.line, links[0], range_of_run
        )
        arrays = passes.arrays_in_lanes(n_lanes)
        x, y, z, *same = arrays.motion
        gains = self.line.motion.gains
        motions = [LineState(x[k:], y[k:], z[k:], gains, *same) for k in lanes]
        self.lanes = [Lane(*own) for own in zip(lanes, motions, links, strict=True)]
        _, droppers, _ = links[0].shown(DROPPERS)
        n, arms = droppers.law.size, model.dofs(model.mesh.steady_arms).astype(np.int64)
        self._rest = np.zeros((links[0].numbers.size, n_lanes))
        rest, *forces = np.zeros((3, n, n_lanes))
        uplift = np.zeros((arms.size, n_lanes))
        self.extremes = native.LineExtremes(arms, droppers, rest, uplift, *forces)
        followed = passes.tracked(links[0].links, links[0].reserve)
        parts = passes.parts._replace(arrays=arrays)
        self._passes = native.ScenePasses(parts)
        self._passes.track(followed, self._rest, [own.reserve for own in links])
        self.native = native.Ensemble(self._passes, self.extremes)
        for lane in self.lanes:
            self.hang(lane, at_rest)

    def takes(self, at_rest: LineAtRest) -> bool:
        """Whether the matrices of a line are these, and the links that are followed."""
        taut = self._taut.of(at_rest)
        return same_matrices(self._model, taut.model) and _same_links(self._table, taut.links)

    def hang(self, lane: Lane, at_rest: LineAtRest) -> None:
        """Put the line of a lane at rest: that of a scene whose matrices are these."""
        self._passes.rest(lane.number)
        links, extremes, number, taut = lane.links, self.extremes, lane.number, lane.taut
        if taut is None or taut.rest is not at_rest.model:
            lane.taut = taut = self._taut.of(at_rest)
            model = taut.model
            lane.wires = ContactWires(model, taut.form, self.ownership)
            lane.wires_at_rest = ContactWires(model, at_rest.form, self.ownership)
            for name in ("begin", "at", "width"):
                lane.wires.nodes[name] = self._wires.nodes[name]
            links.take_law(taut.links.arrays.law)
            self._rest[:, number] = links.links.law["rest"]
            extremes.rest[:, number] = links.shown(DROPPERS)[1].law["rest"]
        read = lane.motion.read
        # Without velocity and acceleration displacements are a share of x.
        read.x[:: len(self.lanes)] = taut.moved / read.shares[0]
        extremes.uplift[:, number] = taut.moved[extremes.arms]
        force = at_rest.form.dropper_force
        extremes.least[:, number] = extremes.largest[:, number] = force

    def uplift(self, lane: Lane) -> np.ndarray:
        """Largest displacement at arms from the line at rest (n_arms,) [m]."""
        assert lane.taut is not None
        extremes = self.extremes
        return extremes.uplift[:, lane.number] - lane.taut.moved[extremes.arms]

    def destroy(self) -> None:
        """Free all PETSc objects."""
        self.line.destroy()


def _quickest(passes: StationPasses, n_scenes: int) -> int:
    """Number of lanes in which a step of ``n_scenes`` takes least time a scene on this processor.

    It is measured: eight lanes halve the time where vectors and caches of the processor are wide
    enough, and take a third longer than four where not. Motions are the same.
    """
    numbers = passes.scenes_at_once

    def time_of(n: int) -> float:
        parts = passes.parts._replace(arrays=passes.arrays_in_lanes(n))
        steps = native.ScenePasses(parts)
        no_links = passes.tracked(NO_LINKS, np.zeros(0))
        steps.track(no_links, np.zeros((0, n)), [np.zeros(0)] * n)
        least = math.inf
        for _ in range(_TRIALS):
            begin = time.perf_counter()
            steps.step()
            least = min(least, time.perf_counter() - begin)
        return least / min(n, n_scenes)

    return numbers[0] if len(numbers) == 1 else min(numbers, key=time_of)


def _same_links(one: LinkTable, other: LinkTable) -> bool:
    """Whether links are the same but for their reserves at rest."""
    if one.arrays.law.size != other.arrays.law.size:
        return False
    law = other.arrays.law.copy()
    law["rest"] = one.arrays.law["rest"]
    mine, others = (
        (links.arrays.unknowns, links.arrays.weights, links.broken, links.leader, links.bent)
        for links in (one, other)
    )
    return np.array_equal(one.arrays.law, law) and all(map(np.array_equal, mine, others))


def why_alone(problem: Problem) -> str:
    """Reason why scenes of a problem's line cannot step side by side, "" if they can."""
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


class SceneHistory(NamedTuple):
    """Record of a scene's march.

    Attributes
    ----------
    number : of the scene
    at_rest : the line at rest of the scene, with its problem
    n_steps : that were taken
    is_left : whether the forces of the step after them were not found
    position, contact_force, head_height, wire_height : (n_steps + 1, n_pantographs), the first row
        before the first step [m], [N]
    uplift : (n_arms,) largest displacement of the wires at steady arms [m]
    dropper_force : (2, n_droppers) smallest and largest force [N]
    """

    number: int
    at_rest: LineAtRest
    n_steps: int
    is_left: bool
    position: np.ndarray
    contact_force: np.ndarray
    head_height: np.ndarray
    wire_height: np.ndarray
    uplift: np.ndarray
    dropper_force: np.ndarray


@dataclass
class _OnItsWay:
    """A scene in a lane."""

    number: int
    at_rest: LineAtRest
    n: int
    rows: np.ndarray
    n_steps: int


def march_side_by_side(
    shared: SharedLine, scenes: Iterable[tuple[int, LineAtRest]]
) -> Iterator[SceneHistory | tuple[int, CatenaryError]]:
    """March scenes to their ends, in the order in which they come there. Not collective.

    A scene whose train cannot be placed on the line, or which Python steps, gives its number and
    the error.

    Parameters
    ----------
    shared : SharedLine
        The line of all scenes.
    scenes : iterable of tuple
        Numbers, problems and lines at rest of the scenes, which have the matrices of the
        shared line.
    """
    left = iter(scenes)
    marches: list[_OnItsWay | None] = [None] * len(shared.lanes)
    while True:
        for lane in shared.lanes:
            while marches[lane.number] is None:
                number, at_rest = next(left, (0, None))
                if at_rest is None:
                    break
                try:
                    marches[lane.number] = _begin(shared, lane, number, at_rest)
                except CatenaryError as error:
                    yield number, error
        if not any(marches):
            return
        with flushed():
            shared.native.take(_MOST_STEPS)
        for place, march in enumerate(marches):
            if march is None:
                continue
            taken, is_left = shared.native.at(place)
            if is_left or taken == march.n_steps:
                marches[place] = None
                yield _ended(shared, place, march, taken, is_left)


def _begin(shared: SharedLine, lane: Lane, number: int, at_rest: LineAtRest) -> _OnItsWay:
    """Begin the march of a scene in a lane."""
    problem, model, form, lift = at_rest
    model = replace(model, problem=problem, simulated=simulated(problem))
    laws, train = model.simulated, problem.train
    shared.hang(lane, at_rest)
    height = nominal_height_rule(problem, laws, lane.wires_at_rest, lift)
    pantographs = Pantographs(shared.comm, problem, laws, lane.wires_at_rest, height)
    for one in pantographs.models:
        stepped_by_kernels(one)  # an error of another would end a step of all lanes
    interaction = ForcesOnLine(
        shared.comm,
        model,
        form,
        lane.wires,
        shared.line,
        lane.links,
        shared.columns,
        pantographs.candidates,
        train.speed,
        uses_rate(laws.contact),
        pantographs.across,
        pantographs.work,
        lane.motion,
    )
    scheme = one_solve(shared.comm, problem, model, interaction, pantographs)
    make_room(scheme)
    if pantographs.lateral:
        interaction.locate()
        find_crossings(interaction, pantographs, 0.0)
    n_steps = steps_of(problem)
    steps, rows = _steps(scheme, n_steps, problem.numerics.dt)
    shared.native.begin(lane.number, steps, n_steps)
    return _OnItsWay(number, at_rest, pantographs.n, rows, n_steps)


def _steps(scheme: OneSolve, n_steps: int, dt: float) -> tuple[native.Steps, np.ndarray]:
    """Compiled steps of a scheme, and the rows (n_steps + 1, n_outputs) that they fill, the first
    one before the first step."""
    pantographs = scheme.pantographs
    times = np.arange(1, n_steps + 1) * dt
    drives = np.zeros((n_steps, pantographs.n, drive_width(pantographs.most_contacts)))
    heads, _ = pantographs.heads_in_loop()
    pantographs.fill_drives(times, drives)
    rows = np.zeros((n_steps + 1, pantographs.outputs.size))
    rows[0] = pantographs.outputs
    parts = step_parts(scheme, heads, free=None, loads=[], shown=None, channels=[])
    block = native.Block(
        times=times,
        drives=drives,
        rows=rows[1:],
        now=np.zeros(2, dtype=np.int64),
        behind=np.zeros((0, 2), dtype=np.int64),
        kept=None,
        counts=np.zeros(1, dtype=native.COUNTS),
    )
    return native.Steps(parts, block), rows


def _ended(
    shared: SharedLine, lane: int, march: _OnItsWay, taken: int, is_left: bool
) -> SceneHistory:
    """Record of a scene that is at its end, or left."""
    n, extremes = march.n, shared.extremes
    # Each column is read as a whole.
    columns = np.ascontiguousarray(march.rows[: taken + 1, : 4 * n].T)
    position, force, head, wire = (columns[k * n : (k + 1) * n].T for k in range(4))
    return SceneHistory(
        march.number,
        march.at_rest,
        taken,
        is_left,
        position,
        force,
        head,
        wire,
        shared.uplift(shared.lanes[lane]),
        np.stack([extremes.least[:, lane], extremes.largest[:, lane]]),
    )
