"""Marches of scenes on a shared line: lanes are filled as scenes come to their ends."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from catenary.base.errors import CatenaryError
from catenary.mbs.head.head_arrays import drive_width
from catenary.solver.contact.forces_on_line import ForcesOnLine
from catenary.solver.contact.pantographs import Pantographs, nominal_height_rule
from catenary.solver.effects.all_effects import simulated
from catenary.solver.ensemble.shared_line import Lane, SharedLine
from catenary.solver.kernels import native
from catenary.solver.kernels.flush_to_zero import flushed
from catenary.solver.problem.contact_laws import uses_rate
from catenary.solver.problem.problem import steps_of
from catenary.solver.schemes.make_scheme import one_solve
from catenary.solver.schemes.one_solve import OneSolve
from catenary.solver.schemes.scheme import find_crossings
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.time_loop.compiled_steps import step_parts
from catenary.solver.time_loop.prepared_line import make_room, stepped_by_kernels

# Steps between two looks at signals.
_MOST_STEPS = 4096


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
