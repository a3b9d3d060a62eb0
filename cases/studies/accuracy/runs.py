"""Runs of ``catenary accuracy``: each setting once, short ones again for their time; then rows."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import find_case
from catenary.cases.scene.load import load_scene
from catenary.cases.scene.scene import Scene, resolved
from catenary.cases.studies.accuracy.analysis import Found, Row, compare, separate, uncertainties
from catenary.cases.studies.accuracy.axes import Axis, Level
from catenary.cases.studies.sweep.jobs import (
    AS_USUAL,
    Ended,
    Job,
    RunOptions,
    all_ended,
    statistics_of,
)
from catenary.cases.studies.sweep.run_jobs import run_jobs
from catenary.cases.studies.sweep.variants import Variant, slug
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.statistics import covers
from catenary.postproc.files.disk import plain
from catenary.postproc.read.results import Results
from catenary.postproc.read.validation import is_number

# Nothing but channels is recorded, so that what is timed is the march.
_ALWAYS = ("output.field_every_s=0", "output.energy_every_s=0")
AS_IT_IS = Level("as_it_is", ())
# Tables that say how finely a scene is computed and what is told of it.
_HOW = ("case", "mesh", "numerics", "output")


@dataclass(frozen=True)
class PlannedAxis:
    """An axis with its levels and their runs.

    Attributes
    ----------
    axis, levels : the axis and its levels
    runs : name of the run of each possible level, by the level's name
    refused : reason why a level is not possible, by the level's name
    reference : name of the run that levels are compared with
    chains : names of the runs of each chain, see ``Axis``; empty for models
    step_alone : name of the run with the reference's step, by the level's name, see ``Axis``
    """

    axis: Axis
    levels: Sequence[Level]
    runs: dict[str, str]
    refused: dict[str, str]
    reference: str
    chains: tuple[tuple[str, ...], ...] = ()
    step_alone: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Plan:
    """Plan of a study.

    Attributes
    ----------
    case : name of the case
    axes : axes with something to vary
    jobs : all runs
    repeats : number of timings of a short run
    quick : whether levels are those of the short form
    overrides : assignments of the command line, for all runs
    asked : names of the requested axes, some of which may have nothing to vary
    scene : what is computed, without its discretisation, see ``physics_of``
    """

    case: str
    axes: Sequence[PlannedAxis]
    jobs: Sequence[Job]
    repeats: int
    quick: bool = False
    overrides: Sequence[str] = ()
    asked: Sequence[str] = ()
    scene: Mapping[str, Any] = field(default_factory=dict)


@dataclass
class _Jobs:
    """Collects jobs; settings that make the same scene share one."""

    case: str
    overrides: Sequence[str]
    shortened: bool
    jobs: list[Job] = field(default_factory=list)
    known: dict[str, str] = field(default_factory=dict)

    def add(self, axis: str, level: Level) -> str:
        """The name of the run of a level; raises InputError if it makes no scene."""
        scene = load_scene(self.case, [*self.overrides, *level.assignments], self.shortened)
        content = json.dumps(plain(resolved(scene)), sort_keys=True)
        if content not in self.known:
            name = slug(f"{axis}__{level.name}")
            self.known[content] = name
            job = Job(Variant(name, level.assignments), scene, keep_results=False)
            self.jobs.append(job)
        return self.known[content]


def make_plan(
    case: str,
    axes: Sequence[Axis],
    overrides: Sequence[str] = (),
    shortened: bool = False,
    *,
    quick: bool = False,
    repeats: int = 3,
) -> Plan:
    """All checked runs. Not collective.

    Parameters
    ----------
    case : name, file or folder
    overrides : ``key=value`` each, for all runs
    shortened : apply the case's ``[test]`` table
    quick : few levels, a coarser reference
    repeats : how often a short run is timed, at least 1

    Raises
    ------
    InputError
        If the case itself or a reference is wrong. A level that is not possible for it is left
        out, and reported.
    """
    all_of_them = [*overrides, *_ALWAYS]
    scene = load_scene(case, all_of_them, shortened)
    collected = _Jobs(case, all_of_them, shortened)
    planned = [one for axis in axes for one in _planned(axis, scene, collected, quick)]
    if not planned:
        raise InputError(
            f"the axes {', '.join(axis.name for axis in axes)} have nothing to vary in "
            f"{scene.case.name}" + (", whose mesh is the user's own" if scene.mesh.file else "")
        )
    asked, physics = [axis.name for axis in axes], physics_of(scene)
    return Plan(
        scene.case.name, planned, collected.jobs, repeats, quick, tuple(overrides), asked, physics
    )


def physics_of(scene: Scene) -> dict[str, Any]:
    """All keys of a scene that decide what is computed, not how finely or what is recorded and
    judged, plain for JSON. Not collective."""
    found: dict[str, Any] = plain(resolved(scene))
    judged = found.pop("evaluation")
    del found["train"]["end_m"]  # a run that is longer is the same up to there
    stretch = {name: judged[name] for name in ("from_m", "to_m")}
    return {"evaluation": stretch} | {name: own for name, own in found.items() if name not in _HOW}


def _planned(axis: Axis, scene: Scene, jobs: _Jobs, quick: bool) -> Iterator[PlannedAxis]:
    """The axis with its runs; nothing if the scene has nothing to vary there."""
    levels = axis.chosen(scene, quick)
    if not levels:
        return
    both = axis.chains(quick) if axis.chains is not None else ()
    reference = jobs.add(axis.name, both[0][0] if both else AS_IT_IS)
    chains = tuple(tuple(jobs.add(axis.name, one) for one in chain) for chain in both)
    runs, refused, step_alone = {}, {}, {}
    file = find_case(jobs.case).absolute()  # a study is read by others, elsewhere
    for level in levels:
        try:
            runs[level.name] = jobs.add(axis.name, level)
            if axis.step_alone is not None:
                step_alone[level.name] = jobs.add(axis.name, axis.step_alone(level))
        except InputError as error:
            refused[level.name] = str(error).replace(f" in {file}", "")
    yield PlannedAxis(axis, levels, runs, refused, reference, chains, step_alone)


RUNS = "runs"
# Distance at which histories are compared [m]: 20 Hz are waves of 0.25 m at 18 km/h.
_SPACING = 0.25
# Marches of more steps times unknowns than this, some five seconds, are timed once: disturbances
# are short beside them.
_LONG = 2e8


@dataclass(frozen=True)
class Measured:
    """Result of an accuracy study.

    Attributes
    ----------
    plan : of the runs
    rows : all levels, axis by axis
    uncertainty : by axis name, of the reference itself (percent by quantity, infinite where it is
        not known), only of discretisation axes
    wall : time of all runs [s]
    remarks : by name of a run, of levels and references, sentences about what decides its results
    """

    plan: Plan
    rows: Sequence[Row]
    uncertainty: Mapping[str, dict[str, float]]
    wall: float
    remarks: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def rows_of(self, axis: str) -> list[Row]:
        """The rows of an axis."""
        return [row for row in self.rows if row.axis == axis]


def measure(results: Results) -> dict[str, Any]:
    """Forces below 20 Hz at common positions of the evaluation stretch, by pantograph [N].

    A pantograph without statistics has none. Not collective.
    """
    start, end = results.evaluation
    places = np.linspace(start, end, 1 + math.ceil((end - start) / _SPACING))
    histories: list[list[float]] = []
    for p in range(results.n_pantographs):
        position = results.column("contact_position", p)
        if not covers(position, (start, end)):
            histories.append([])
            continue
        curve = CubicSpline(position, filters.contact_force(results, p))
        histories.append(np.round(curve(places), 4).tolist())
    return {"histories": histories}


def run(
    plan: Plan, out_dir: Path, comm: Any, options: RunOptions = AS_USUAL
) -> tuple[Measured, list[Ended]]:
    """Run what is not done yet; returns the measurements and all runs. Collective.

    Each repetition times all settings in turn, so that a disturbance does not fall on a single one.
    Repetitions run one at a time. If first runs are made several at a time, their times count for
    long runs alone.

    Raises
    ------
    InputError
        If ``out_dir`` holds other results and ``options.force`` is not given.
    Interrupted
        If a signal came.
    """
    folder = out_dir / RUNS
    ended = all_ended(run_jobs(plan.jobs, folder, comm, options, measure=measure))
    every = list(ended)
    times = {one.variant.name: [_cost(one)] for one in ended if one.done}
    work = {
        one.variant.name: float(one.summary["n_steps"]) * float(one.summary["n_dofs"])
        for one in ended
        if one.done
    }
    short = [job for job in plan.jobs if work.get(job.variant.name, _LONG) < _LONG]
    alone = options._replace(n_jobs=1)
    if options.n_jobs != 1 and plan.repeats > 1:  # several runs at a time disturb each other
        times |= {job.variant.name: [] for job in short}
    for number in range(2, plan.repeats + 1):
        round_of = f"no. {number} of {plan.repeats}"
        options.progress(f"again, for their time, {round_of}: {len(short)} short runs")
        short.reverse()  # whatever else the machine does now and then meets others
        again = [
            replace(job, variant=replace(job.variant, name=f"{job.variant.name}__again_{number}"))
            for job in short
        ]
        repeated = all_ended(run_jobs(again, folder, comm, alone))
        every += repeated
        for job, one in zip(short, repeated, strict=True):
            if one.done:
                times[job.variant.name].append(_cost(one))
    return evaluate(plan, ended, times, sum(one.wall for one in every)), every


def evaluate(
    plan: Plan, ended: Sequence[Ended], times: Mapping[str, Sequence[float]], wall: float
) -> Measured:
    """Rows of all axes from their runs. Not collective.

    Parameters
    ----------
    plan : of the study
    ended : how each run ended
    times : by name of a run, processor time of its march in each round [s]
    wall : wall time of all runs together [s]
    """
    runs = {one.variant.name: one for one in ended}
    rows: list[Row] = []
    uncertainty: dict[str, dict[str, float]] = {}
    for planned in plan.axes:
        rows += [_row(planned, level, runs, times) for level in planned.levels]
        if planned.chains:
            chains = [[_found(runs[name]) for name in chain] for chain in planned.chains]
            uncertainty[planned.axis.name] = uncertainties(_found(runs[planned.reference]), chains)
    remarks = {one.variant.name: one.remarks for one in ended}
    return Measured(plan, rows, uncertainty, wall, remarks)


def _row(
    planned: PlannedAxis,
    level: Level,
    runs: Mapping[str, Ended],
    times: Mapping[str, Sequence[float]],
) -> Row:
    name, head = level.name, (planned.axis.name, level.name)
    if name in planned.refused:
        return Row(*head, f"not possible: {planned.refused[name]}", level.sizes)
    one = runs[planned.runs[name]]
    found, reference = _found(one), _found(runs[planned.reference])
    if found is None or reference is None:
        outcome = one.outcome if found is None else "its reference broke"
        return Row(*head, outcome, level.sizes)
    errors, percent = compare(found, reference)
    fine = planned.step_alone.get(name)
    by_step, by_mesh = separate(found, None if fine is None else _found(runs[fine]), reference)
    summary, costs = one.summary, times[one.variant.name]
    counted, estimates = summary["inner_iterations"], summary["indicators"]["time_step"]
    # The largest of the pantographs' estimated errors [N].
    known = [value for value in estimates["force_error_N"] if value is not None]
    return Row(
        *head,
        one.outcome,
        level.sizes,
        errors,
        percent,
        cost=min(costs, default=math.nan) / summary["simulated_s"],
        timings=len(costs),
        estimate=max(known, default=math.nan),
        iterations=counted["rounds"] / counted["steps"],
        by_step=by_step,
        by_mesh=by_mesh,
        remarks=one.remarks,
    )


def _found(one: Ended) -> Found | None:
    """Result of a run, None if it broke."""
    if not one.done:
        return None
    histories = [np.array(values) for values in one.measured["histories"]]
    return Found(statistics_of(one.summary), histories)


def _cost(one: Ended) -> float:
    """Processor time of a march [s], which other work of the machine disturbs little; wall time of
    a run of a version that did not tell it."""
    seconds: Any = one.summary.get("march_cpu_s")
    if not is_number(seconds, 0.0):
        seconds = one.summary["march_wall_s"]
    return float(seconds)
