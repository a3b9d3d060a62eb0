"""Marches many scenes in this process and keeps their statistics.

Scenes that differ in train, pantographs, contact and evaluation alone share their line: its rest,
factors and columns are found once, and they step side by side. Others march one by one. All give
what their own runs write as ``summary.json``.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import CatenaryError
from catenary.base.lone_process import alone
from catenary.cases.run.describe.arrivals import arrival_facts
from catenary.cases.run.describe.pantographs import header_words
from catenary.cases.run.header import header_of
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.problem import problem_of, resolved
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.ensemble.keeper import Keeper
from catenary.postproc.channels.facts import facts_of
from catenary.postproc.channels.header import Header
from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.files.run_schema import DONE
from catenary.postproc.read.marched_results import MarchedFile
from catenary.postproc.read.results import Results
from catenary.postproc.record.run_watch import RunWatch, watch_cadence, watched
from catenary.postproc.report.report import judge
from catenary.postproc.report.summary import summarise
from catenary.solver.ensemble.marches import SceneHistory, march_side_by_side
from catenary.solver.ensemble.shared_line import SharedLine, why_alone
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.statics.stability_of_rest import refuse_lost_wire
from catenary.solver.time_loop.march import March

# Tables of a scene that its line, and how that is stepped, do not depend on.
_OF_THE_TRAIN = ("case", "train", "pantographs", "contact", "evaluation", "output", "test")
# How far columns of a shared line reach beyond a run [m]: trains that come later may be longer.
_BEYOND = 60.0


class Marched(NamedTuple):
    """How a scene ended: its ``summary``, as its own run writes one, or the sentence of what broke
    in ``outcome``, which else is "done"."""

    number: int
    outcome: str
    summary: dict[str, Any]


def march_scenes(scenes: Sequence[Scene]) -> Iterator[Marched]:
    """March scenes, as they come to their ends. Not collective: in this process alone.

    Parameters
    ----------
    scenes : checked ones, of any lines
    """
    groups: dict[str, list[tuple[int, Scene]]] = {}
    for number, scene in enumerate(scenes):
        groups.setdefault(_key_of_line(scene), []).append((number, scene))
    for members in groups.values():
        yield from _march_on_a_line(members)


def _key_of_line(scene: Scene) -> str:
    """What the line of a scene depends on, as text."""
    tables = {name: own for name, own in resolved(scene).items() if name not in _OF_THE_TRAIN}
    return json.dumps(tables, sort_keys=True)


class _Line:
    """A line that scenes share, at rest, and the head of their results.

    Parameters
    ----------
    scene, problem : of one of the scenes
    range_of_run : what contact wires their trains touch [m]
    """

    def __init__(
        self, scene: Scene, problem: Problem, range_of_run: tuple[float, float] | None
    ) -> None:
        at_rest = line_at_rest(problem, mesh_of(scene))
        refuse_lost_wire(at_rest.model, at_rest.form)
        self.at_rest = at_rest
        head, mesh = header_of(scene, problem, at_rest, ()), at_rest.mesh
        points, lateral = mesh.points.copy(), at_rest.form.lateral
        points[:, 2] = at_rest.form.height
        if lateral is not None:
            points[:, 1] = lateral.y
        places = {
            "line/arm_x": mesh.x(mesh.steady_arms),
            "line/dropper_x": mesh.x(mesh.droppers[:, 1]),
            "line/node_points": points,
        }
        self._header = replace(head, datasets={**head.datasets, **places})
        self.shared = None if range_of_run is None else SharedLine(at_rest, range_of_run)

    def header(self, scene: Scene, problem: Problem) -> Header:
        """The head of a scene's results."""
        words = header_words(scene, problem)
        of_scene = {
            "case": scene.case.name,
            "title": scene.case.title,
            "system": scene.evaluation.system,
            "edition": scene.evaluation.edition,
            "pantographs": words,
            "arrivals": arrival_facts(scene, problem),
            "config": {},
        }
        range_path = "line/evaluation_range"
        return Header(
            {**self._header.attributes, **of_scene},
            {**self._header.datasets, range_path: np.array(problem.evaluation)},
            facts_of(problem, self.at_rest.mesh, self.at_rest.model.dropper_lengths),
        )

    def rest_of(self, problem: Problem) -> LineAtRest:
        """The line at rest for a march of a scene by itself."""
        return self.at_rest._replace(problem=replace(self.at_rest.problem, **_of_train(problem)))


def _of_train(problem: Problem) -> dict[str, Any]:
    names = ("train", "contact", "evaluation")
    return {name: getattr(problem, name) for name in names}


def _march_on_a_line(members: Sequence[tuple[int, Scene]]) -> Iterator[Marched]:
    """March scenes that share a line."""
    problems: dict[int, Problem] = {}
    scenes = dict(members)
    for number, scene in members:
        try:
            problems[number] = problem_of(scene)
        except CatenaryError as error:
            yield Marched(number, str(error), {})
    if not problems:
        return
    first = next(iter(problems))
    together = len(problems) > 1 and not why_alone(problems[first])
    range_of_run = None
    if together:
        range_of_run = (
            min(_begin_of(problem) for problem in problems.values()),
            max(problem.train.end for problem in problems.values()) + _BEYOND,
        )
    try:
        line = _Line(scenes[first], problems[first], range_of_run)
    except CatenaryError as error:
        yield from (Marched(number, str(error), {}) for number in problems)
        return
    try:
        left = dict(problems)
        if line.shared is not None:
            for ended in march_side_by_side(line.shared, problems.items()):
                if isinstance(ended, SceneHistory) and not ended.is_left:
                    del left[ended.number]
                    head = line.header(scenes[ended.number], problems[ended.number])
                    yield Marched(ended.number, DONE, _summary(head, *_tables(ended), DONE))
        # Alone a march says why a step has no forces.
        for number, problem in left.items():
            yield _alone(line, number, scenes[number], problem)
    finally:
        if line.shared is not None:
            line.shared.destroy()


def _begin_of(problem: Problem) -> float:
    """Where the last strip starts [m], or before."""
    train = problem.train
    return float(train.start - max(place.behind for place in train.placements) - _BEYOND)


def _tables(history: SceneHistory) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Tables and extremes of a march side by side."""
    dt = history.problem.numerics.dt
    tables = {
        "time": np.arange(history.n_steps + 1) * dt,
        "channels/contact_position": history.position,
        "channels/contact_force": history.contact_force,
        "channels/head_height": history.head_height,
        "channels/wire_height": history.wire_height,
    }
    uplift = np.stack([np.full(history.uplift.size, np.nan), history.uplift])
    return tables, {"arm_uplift": uplift, "dropper_force": history.dropper_force}


def _alone(line: _Line, number: int, scene: Scene, problem: Problem) -> Marched:
    """March a scene by itself."""
    rest = line.rest_of(problem)
    keeper, dt = Keeper(), problem.numerics.dt
    try:
        with March(alone(), *rest) as march:
            watch = RunWatch(alone(), watched(rest, True), watch_cadence(dt))
            outcome = march.run([watch, keeper])
    except CatenaryError as error:
        return Marched(number, str(error), {})
    if outcome.outcome != DONE:
        return Marched(number, outcome.outcome, {})
    head = line.header(scene, problem)
    head = replace(head, attributes={**head.attributes, "watched": watch.facts()})
    summary = _summary(head, keeper.tables(), keeper.extremes(), outcome.outcome)
    return Marched(number, outcome.outcome, summary)


def _summary(
    head: Header, tables: dict[str, np.ndarray], extremes: dict[str, np.ndarray], outcome: str
) -> dict[str, Any]:
    """What a run of the scene writes as its summary."""
    results = Results.of(MarchedFile(head, tables, extremes, outcome))
    statistics = stats.evaluate(results)
    return summarise(results, statistics, judge(results, statistics))
