"""Marches many scenes in this process and keeps their statistics.

Scenes that differ in train, pantographs, contact and evaluation alone share their line: its rest,
factors and columns are found once, and they step side by side. Others march one by one. All give
what their own runs write as ``summary.json``.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any, NamedTuple, TypeVar

import numpy as np

from catenary.base.errors import CatenaryError
from catenary.base.process import alone
from catenary.cases.run.header import header_of, scene_attributes, train_attributes
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.keys.keys import OF_THE_TRAIN
from catenary.cases.scene.scene import Scene, problem_of, resolved
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate.verdict import criteria_of
from catenary.postproc.files.committed_rows import FILTERED_FORCE
from catenary.postproc.files.facts import facts_of
from catenary.postproc.files.header import Header, static_datasets
from catenary.postproc.files.run_schema import DONE
from catenary.postproc.read.result_tables import MarchedFile
from catenary.postproc.read.results import Results
from catenary.postproc.record.recorder import take_extremes
from catenary.postproc.record.run_watch import RunWatch
from catenary.postproc.report.summary import short_summary
from catenary.solver.ensemble import SceneHistory, SharedLine, march_side_by_side, why_alone
from catenary.solver.model.model import Model
from catenary.solver.problem.problem import EXACT, Problem, WindowChoice
from catenary.solver.statics.line_at_rest import (
    LineAtRest,
    SoundLine,
    line_at_rest,
    refuse_lost_wire,
    sound_line,
)
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.observers import NEVER, Observer, Stage, StepView

T = TypeVar("T")
_OF_LINE = ("arm_uplift", "dropper_force")


class Keeper(Observer):
    """Keeps histories of the train, and extremes of arms and droppers, in memory. One rank only."""

    def start(self, stage: Stage) -> None:
        """Forget everything."""
        self._times: list[np.ndarray] = []
        self._rows: list[np.ndarray] = []
        self._columns: dict[str, np.ndarray] = {}
        self._moving, sizes = stage.moving, (stage.arm_x.size, stage.dropper_x.size)
        self._extremes = {
            name: np.repeat([[np.inf], [-np.inf]], size, axis=1)
            for name, size in zip(_OF_LINE, sizes, strict=True)
        }

    def next_state(self, step: int) -> int:
        """Rows will do."""
        return NEVER

    def observe(self, view: StepView) -> None:
        """Keep the steps of a view."""
        if not self._columns:
            every = np.arange(view.rows.shape[1])
            own = {name: every[part] for name, part in view.columns.items() if _is_of_train(name)}
            self._columns = {name: columns for name, columns in own.items() if columns.size}
            self._read = np.concatenate([*self._columns.values()])
        self._times.append(view.times.copy())
        self._rows.append(view.rows[:, self._read])
        for name, kept in self._extremes.items():
            moved = self._moving.columns(name)
            take_extremes(view.rows[:, view.columns[name]][:, moved], kept[:, moved])

    def tables(self) -> dict[str, np.ndarray]:
        """Histories by their paths in a result file, ``time`` among them."""
        rows = np.concatenate(self._rows)
        ends = np.cumsum([columns.size for columns in self._columns.values()])[:-1]
        parts = zip(self._columns, np.split(rows, ends, axis=1), strict=True)
        joined = {f"channels/{name}": np.ascontiguousarray(part) for name, part in parts}
        return {"time": np.concatenate(self._times), **joined}

    def extremes(self) -> dict[str, np.ndarray]:
        """Smallest and largest value of each column of a channel of the line, (2, columns)."""
        return self._extremes


def _is_of_train(name: str) -> bool:
    return name in channels.CHANNELS and not channels.CHANNELS[name].of_line


# Changes the line at rest, but not its matrices.
_OF_THE_REST = "dropper_lengths"
# Lanes have no watch of energies and motions. A march by itself is watched, and is made of scenes
# where that may have something to say: of an uplift at an arm [m], a contact force [N], a share of
# the time without contact.
_UPLIFT, _FORCE, _LOST = 0.25, 1000.0, 0.1
# Steps take on what waves have reached: forces are those of the whole line to round-off.
_REACHED = WindowChoice(EXACT, optional=True)
# Length of a shared line's columns beyond runs [m]: trains that come later may be longer.
_BEYOND = 60.0


class Marched(NamedTuple):
    """Result of a scene.

    Attributes
    ----------
    number : of the scene
    outcome : "done", or the sentence of what broke
    results : as its own run leaves them, None unless done
    tables : histories of the train by their paths in a result file, ``time`` among them, likewise
    """

    number: int
    outcome: str
    results: Results | None = None
    tables: Mapping[str, np.ndarray] = {}

    def summary(self) -> dict[str, Any]:
        """The part of its run's summary that tables read, empty unless done."""
        if self.results is None:
            return {}
        statistics = stats.evaluate(self.results)
        return short_summary(self.results, statistics, criteria_of(self.results, statistics))


class Marches:
    """Marches scenes in this process alone; keeps the line of the latest for those to come.

    A scene marches side by side with others that it comes with, or by itself: whether those before
    it had its line changes no digit, so that processes may share scenes as they like.
    """

    def __init__(self) -> None:
        self._key = ""
        self._line: _Line | None = None

    def of(self, scenes: Sequence[Scene]) -> Iterator[Marched]:
        """March scenes, as they come to their ends. Not collective.

        Parameters
        ----------
        scenes : checked ones, of any lines
        """
        groups: dict[str, list[tuple[int, Scene]]] = {}
        for number, scene in enumerate(scenes):
            groups.setdefault(key_of_line(scene), []).append((number, scene))
        for key, members in groups.items():
            yield from self._on_a_line(key, dict(members))

    def destroy(self) -> None:
        """Give the line back."""
        if self._line is not None:
            self._line.destroy()
        self._key, self._line = "", None

    def _on_a_line(self, key: str, scenes: dict[int, Scene]) -> Iterator[Marched]:
        """March scenes that share a line."""
        problems: dict[int, Problem] = {}
        for number, scene in scenes.items():
            try:
                problems[number] = problem_of(scene)
            except CatenaryError as error:
                yield Marched(number, str(error))
        if not problems:
            return
        try:
            line = self._line_for(key, scenes, problems)
        except CatenaryError as error:
            yield from (Marched(number, str(error)) for number in problems)
            return
        left = dict.fromkeys(problems)
        if line.shared is not None and len(problems) > 1:
            marched = march_side_by_side(line.shared, line.fitting(problems))
            for ended in _by_lots(marched, len(line.shared.lanes)):
                # A march by itself says why a train has no place, and why a step has no forces.
                if not isinstance(ended, SceneHistory) or ended.is_left or _is_unusual(ended):
                    continue
                number = ended.number
                del left[number]
                head = line.header(scenes[number], problems[number], ended.at_rest)
                yield _done(number, head, *_tables(ended))
        for number in left:
            try:
                at_rest = line.rest_of(problems[number])
            except CatenaryError as error:
                yield Marched(number, str(error))
            else:
                yield _alone(line, number, scenes[number], problems[number], at_rest)

    def _line_for(self, key: str, scenes: dict[int, Scene], problems: dict[int, Problem]) -> _Line:
        first = next(iter(problems))
        together = not why_alone(problems[first]) and len(problems) > 1
        trains = [problem.train for problem in problems.values()]
        # The last strip starts behind this place.
        begin = min(one.start - max(place.behind for place in one.placements) for one in trains)
        end = max(one.end for one in trains)
        if self._line is None or key != self._key or not self._line.serves(begin, end, together):
            self.destroy()
            range_of_run = (begin - _BEYOND, end + _BEYOND) if together else None
            self._line = _Line(scenes[first], problems[first], range_of_run, len(problems))
            self._key = key
        return self._line


def key_of_line(scene: Scene) -> str:
    """All keys of the line of a scene as text, without errors of the droppers' lengths: scenes with
    the same text may march side by side."""
    tables = {name: own for name, own in resolved(scene).items() if name not in OF_THE_TRAIN}
    if _OF_THE_REST in tables.get("irregularities", {}):
        tables["irregularities"] = {**tables["irregularities"], _OF_THE_REST: "some"}
    return json.dumps(tables, sort_keys=True)


class _Line:
    """A line that scenes share, and the head of their results.

    Attributes
    ----------
    shared : SharedLine, None if its scenes march by themselves

    Parameters
    ----------
    scene, problem : of one of the scenes
    range_of_run : stretch that their trains touch the wire in [m], None if they march by themselves
    n_scenes : so many march at once
    """

    def __init__(
        self,
        scene: Scene,
        problem: Problem,
        range_of_run: tuple[float, float] | None,
        n_scenes: int,
    ) -> None:
        self._mesh = mesh_of(scene)
        self._errors = problem.irregularities.lengths
        self._sound: SoundLine | None = None
        self._rest: LineAtRest | None = None
        self._latest: tuple[Model, dict[str, np.ndarray]] | None = None
        at_rest = self.rest_of(problem)
        self._header = header_of(scene, problem, at_rest, (), with_lengths=False)
        self._range = range_of_run
        self.shared: SharedLine | None = None
        if range_of_run is not None:
            shared = SharedLine(at_rest, range_of_run, n_scenes)
            if shared.steps_together:
                self.shared = shared
            else:
                shared.destroy()

    def serves(self, begin: float, end: float, together: bool) -> bool:
        """Whether trains may run from ``begin`` to ``end`` [m], with ``together`` side by side."""
        if self._range is None:
            return not together
        return self._range[0] <= begin and end <= self._range[1]

    def destroy(self) -> None:
        """Free all PETSc objects."""
        if self.shared is not None:
            self.shared.destroy()

    def rest_of(self, problem: Problem) -> LineAtRest:
        """The line at rest in a scene.

        Raises
        ------
        InputError
            If there is none.
        """
        errors = problem.irregularities.lengths
        if self._rest is None or errors != self._errors:
            if errors is not None and self._sound is None:
                self._sound = sound_line(problem, self._mesh)
            # Without errors a line is found by itself, whichever scenes came before.
            at_rest = line_at_rest(problem, self._mesh, None if errors is None else self._sound)
            refuse_lost_wire(at_rest.model, at_rest.form)
            self._errors, self._rest = errors, at_rest
        hung = self._rest.problem
        of_train = {name: getattr(problem, name) for name in ("train", "contact", "evaluation")}
        return self._rest._replace(problem=replace(hung, **of_train))

    def fitting(self, problems: Mapping[int, Problem]) -> Iterator[tuple[int, LineAtRest]]:
        """Numbers of the scenes whose lines hang, with the matrices of the shared line, and these
        lines at rest."""
        assert self.shared is not None
        for number, problem in problems.items():
            try:
                at_rest = self.rest_of(problem)
            except CatenaryError:
                continue
            if self.shared.takes(at_rest):
                yield number, at_rest

    def header(self, scene: Scene, problem: Problem, at_rest: LineAtRest) -> Header:
        """The head of the results of a scene, of its problem and its line at rest."""
        attributes = {
            **self._header.attributes,
            **scene_attributes(scene, problem),
            **train_attributes(scene, problem),
            "config": {},
        }
        if self._latest is None or self._latest[0] is not at_rest.model:
            self._latest = at_rest.model, self._datasets(at_rest)
        return Header(
            attributes,
            {**self._latest[1], "line/evaluation_range": np.array(problem.evaluation)},
            facts_of(
                replace(problem, line=at_rest.problem.line),
                at_rest.mesh,
                at_rest.model.dropper_lengths,
            ),
        )

    def _datasets(self, at_rest: LineAtRest) -> dict[str, np.ndarray]:
        """Datasets of the head of results, but for what depends on the train."""
        mesh, form = at_rest.mesh, at_rest.form
        points = mesh.points.copy()
        points[:, 2] = form.height
        if form.lateral is not None:
            points[:, 1] = form.lateral.y
        return {
            **self._header.datasets,
            "line/arm_x": mesh.x(mesh.steady_arms),
            "line/dropper_x": mesh.x(mesh.droppers[:, 1]),
            "line/node_points": points,
            **static_datasets(at_rest.problem.line, mesh, form, at_rest.lift),
        }


def _by_lots(items: Iterator[T], size: int) -> Iterator[T]:
    """Items as they come, so many at once: in between a march takes the caches
    of the processor from what evaluates them."""
    while lot := list(islice(items, size)):
        yield from lot


def _is_unusual(history: SceneHistory) -> bool:
    """Whether a watch may have something to say of a march."""
    force = history.contact_force
    return (
        float(history.uplift.max(initial=0.0)) > _UPLIFT
        or float(force.max()) > _FORCE
        or float((force <= 0.0).mean(axis=0).max()) > _LOST
    )


def _tables(history: SceneHistory) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Tables and extremes of a march side by side."""
    dt = history.at_rest.problem.numerics.dt
    tables = {
        "time": np.arange(history.n_steps + 1) * dt,
        "channels/contact_position": history.position,
        "channels/contact_force": history.contact_force,
        "channels/head_height": history.head_height,
        "channels/wire_height": history.wire_height,
        FILTERED_FORCE: filters.low_pass(history.contact_force, dt),
    }
    uplift = np.stack([np.full(history.uplift.size, np.nan), history.uplift])
    return tables, {"arm_uplift": uplift, "dropper_force": history.dropper_force}


def _alone(line: _Line, number: int, scene: Scene, problem: Problem, rest: LineAtRest) -> Marched:
    """March a scene by itself, only the part of its line that waves have reached."""
    keeper, dt = Keeper(), problem.numerics.dt
    if not rest.problem.window.moves:
        rest = rest._replace(problem=replace(rest.problem, window=_REACHED))
    try:
        with March(alone(), *rest) as march:
            watch = RunWatch(alone(), rest)
            outcome = march.run([watch, keeper])
    except CatenaryError as error:
        return Marched(number, str(error))
    if outcome.outcome != DONE:
        return Marched(number, outcome.outcome)
    head = line.header(scene, problem, rest)
    head = replace(head, attributes={**head.attributes, "watched": watch.facts()})
    tables = keeper.tables()
    tables[FILTERED_FORCE] = filters.low_pass(tables["channels/contact_force"], dt)
    return _done(number, head, tables, keeper.extremes())


def _done(
    number: int, head: Header, tables: dict[str, np.ndarray], extremes: dict[str, np.ndarray]
) -> Marched:
    file = MarchedFile(head, tables, extremes, {FILTERED_FORCE: filters.ABOUT})
    return Marched(number, DONE, Results.of(file), tables)
