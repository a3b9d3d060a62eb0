"""Runs ``catenary accuracy``: all settings once, short runs again for their time, then rows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from catenary.cases.studies.accuracy.analysis import Found, Row, compare, separate, uncertainties
from catenary.cases.studies.accuracy.axes import Level
from catenary.cases.studies.accuracy.plan import Plan, PlannedAxis, again
from catenary.cases.studies.sweep.jobs import AS_USUAL, Ended, RunOptions, all_ended
from catenary.cases.studies.sweep.run_jobs import run_jobs
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.statistics import covers
from catenary.postproc.read.results import Results
from catenary.postproc.read.validation import is_number

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
    plan: Plan,
    out_dir: Path,
    comm: Any,
    options: RunOptions = AS_USUAL,
) -> tuple[Measured, list[Ended]]:
    """Run what is not done yet; returns what was found and all runs. Collective.

    Repeats go through all settings before any is timed again, so that a disturbance does not
    fall on a single one. They are made one at a time also where first runs are made several at a
    time, whose times then count for long runs alone.

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
        runs = run_jobs([again(job, number) for job in short], folder, comm, alone)
        repeated = all_ended(runs)
        every += repeated
        for job, one in zip(short, repeated, strict=True):
            if one.done:
                times[job.variant.name].append(_cost(one))
    return evaluate(plan, ended, times, sum(one.wall for one in every)), every


def evaluate(
    plan: Plan, ended: Sequence[Ended], times: Mapping[str, Sequence[float]], wall: float
) -> Measured:
    """Rows of all axes from their runs. Not collective."""
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
        return Row(*head, f"not possible: {planned.refused[name]}", dict(level.sizes))
    one = runs[planned.runs[name]]
    found, reference = _found(one), _found(runs[planned.reference])
    if found is None or reference is None:
        outcome = one.outcome if found is None else "its reference broke"
        return Row(*head, outcome, dict(level.sizes))
    errors, percent = compare(found, reference)
    fine = planned.step_alone.get(name)
    by_step, by_mesh = separate(found, None if fine is None else _found(runs[fine]), reference)
    summary, costs = one.summary, times[one.variant.name]
    counted, estimates = summary["inner_iterations"], summary["indicators"]["time_step"]
    # The largest of the pantographs' estimated errors [N].
    told = [value for value in estimates["force_error_N"] if value is not None]
    return Row(
        *head,
        one.outcome,
        dict(level.sizes),
        errors,
        percent,
        cost=min(costs) / summary["simulated_s"],
        timings=len(costs),
        estimate=max(told, default=math.nan),
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
    uplift = one.summary["supports"]["max_uplift_mm"]
    return Found(one.summary["pantographs"], uplift, histories)


def _cost(one: Ended) -> float:
    """Processor time of a march [s], which other work of the machine disturbs little; wall time of
    a run of a version that did not tell it."""
    told: Any = one.summary.get("march_cpu_s")
    if not is_number(told, 0.0):
        told = one.summary["march_wall_s"]
    return float(told)
