"""Optimisation and tolerances of scenes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catenary.callers import say_nothing, say_on_error_stream
from catenary.cases.studies.optimise.task import OptimiseTask
from catenary.cases.studies.records import KeptRows
from catenary.cases.studies.task_files import read_task
from catenary.cases.studies.tolerance.task import ToleranceTask
from catenary.scenes import Scene, SceneLike, draft_of, plain_value, scene_of

if TYPE_CHECKING:
    import pandas as pd

    from catenary.cases.studies.optimise.study import Optimum as Found
    from catenary.cases.studies.optimise.study import Plan

Task = str | Path | Mapping[str, Any]


@dataclass(frozen=True)
class Optimum:
    """Result of a method of ``optimise``: the better scene, and its comparison with the given one.

    As text it is what ``catenary optimise`` prints of it.

    Attributes
    ----------
    method : str
        "gradient" or "cma".
    scene : Scene
        With the optimum's values.
    shipped, objective : float
        The objective over the set as the scene was and at the optimum, in its statistic's unit.
    constraints_kept : bool
        Whether all constraints are kept.
    not_improved : list of str
        Sentences on what gets worse somewhere; empty if nothing does in any check.
    checks : pandas.DataFrame
        A row for each pantograph of each scene under each check, as in ``checks_*.csv``.
    droppers : pandas.DataFrame
        A row for each dropper, as in ``droppers_*.csv``: lengths and their changes [mm].

    Examples
    --------
    >>> task = {
    ...     "set": {"directions": ["forward"]},
    ...     "variables": [{"key": "contact.stiffness_N_per_m", "change": [-2e4, 0.0]}],
    ...     "search": {"most_runs": 2},
    ...     "checks": {"n_seeds": 0},
    ... }
    >>> (best,) = catenary.optimise(catenary.load("en50318_2002", short=True), task)
    >>> sorted(set(best.checks.check)), bool((best.droppers.change_mm == 0.0).all())
    (['as it is', 'mesh x 2', 'step / 2'], True)
    """

    method: str
    scene: Scene
    shipped: float
    objective: float
    constraints_kept: bool
    not_improved: list[str]
    checks: pd.DataFrame
    droppers: pd.DataFrame
    _text: str

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return f"<catenary.Optimum {self.method}: {self.shipped:.4g} to {self.objective:.4g}>"


def optimise(
    scene: SceneLike,
    task: Task,
    out: str | Path | None = None,
    *,
    jobs: int = 1,
    force: bool = False,
    progress: bool = False,
) -> list[Optimum]:
    """Choose numbers of a scene for the best contact force over a set of scenes. Not collective.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        What is optimised.
    task : str, Path or mapping
        Variables, objective, constraints and scenes: the file that ``catenary optimise`` takes, or
        its tables.
    out : str or Path, optional
        Folder into which all is written that ``catenary optimise -o`` writes. Runs that are kept
        there are not made again.
    jobs : int
        Processes that share the runs, 0 for one on each core.
    force : bool
        Whether results in ``out`` are replaced.
    progress : bool
        Whether better values are shown on standard error as they are found.

    Returns
    -------
    list of Optimum
        One for each method of the task.

    Raises
    ------
    InputError
        If the task or a scene of it is wrong.

    Examples
    --------
    >>> scene = catenary.load("en50318_2002", short=True)
    >>> task = {
    ...     "variables": [{"key": "line.contact_wire.tension_N", "change": [0.0, 4000.0]}],
    ...     "search": {"most_runs": 3},
    ...     "checks": {"n_seeds": 0},
    ... }
    >>> (best,) = catenary.optimise(scene, task)
    >>> best.objective < best.shipped
    True
    """
    from catenary.cases.result_folder.output_folder import refuse_table
    from catenary.cases.studies.optimise import output, study

    scene = scene_of(scene)
    if out is not None:
        refuse_table(Path(out) / output.RECORD, force)
    plan = study.make_plan(draft_of(scene), _task(task, OptimiseTask))
    found = _found(plan, study.optimise, output, out, jobs, force, progress)
    return [_optimum(scene, plan, one) for one in found]


def _optimum(scene: Scene, plan: Plan, found: Found) -> Optimum:
    import pandas as pd

    from catenary.cases.studies.optimise import output

    return Optimum(
        found.method,
        scene.replace(found.values),
        found.shipped.value,
        found.found.value,
        not found.found.violation,
        found.remarks,
        pd.DataFrame(output.checks_table(found.rows).records()),
        pd.DataFrame(found.droppers.records()),
        output.as_text(plan, [found]),
    )


def tolerance(
    scene: SceneLike,
    task: Task,
    out: str | Path | None = None,
    *,
    jobs: int = 1,
    force: bool = False,
    progress: bool = False,
) -> pd.DataFrame:
    """Find the tolerances of an installation for each criterion to hold. Not collective.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The line, its train and criteria.
    task : str, Path or mapping
        Errors, criteria and scenes: the file that ``catenary tolerance`` takes, or its tables.
    out, jobs, force, progress
        As for ``optimise``.

    Returns
    -------
    pandas.DataFrame
        A row for each error and criterion, as in ``tolerance.csv``: the tolerance ``level`` in
        ``unit``, samples that keep the criterion there, and tolerances in the worst case.

    Raises
    ------
    InputError
        If the task or a scene of it is wrong.

    Examples
    --------
    >>> task = {
    ...     "set": {"directions": ["forward"]},
    ...     "errors": [{"name": "tension", "kind": "tension", "level": 2.0, "most": 4.0}],
    ...     "criteria": [{"statistic": "std_N", "at_most": 35.0}],
    ...     "samples": {"probability": 0.6, "confidence": 0.6, "worst_case": False},
    ... }
    >>> table = catenary.tolerance(catenary.load("en50318_2002", short=True), task)
    >>> table.level.tolist()
    [4.0]
    """
    import pandas as pd

    from catenary.cases.result_folder.output_folder import refuse_table
    from catenary.cases.studies.tolerance import output, study

    if out is not None:
        refuse_table(Path(out) / output.TABLE, force)
    plan = study.make_plan(draft_of(scene), _task(task, ToleranceTask))
    found = _found(plan, study.find_tolerances, output, out, jobs, force, progress)
    rows: Sequence[Mapping[str, Any]] = output.table_of(found).records()
    return pd.DataFrame(rows)


def _found(
    plan: Any,
    find: Callable[..., Any],
    output: Any,
    out: str | Path | None,
    jobs: int,
    force: bool,
    progress: bool,
) -> Any:
    """Run a planned study, write its result with ``output``, and return it.

    Raises
    ------
    KeyboardInterrupt
        If a signal ends the study.
    """
    from catenary.cases.process.interrupts import Interrupted
    from catenary.cases.studies.scene_sets import workers

    kept = KeptRows(None if out is None else Path(out), force)
    try:
        with workers(jobs) as pool:
            found = find(plan, pool, kept, say_on_error_stream if progress else say_nothing)
    except Interrupted as stopped:
        raise KeyboardInterrupt from stopped
    if out is not None:
        output.write(Path(out), plan, found)
        kept.forget()
    return found


def _task(task: Task, model: Any) -> Any:
    """A checked task."""
    if isinstance(task, Mapping):
        return read_task(plain_value(task, "the task"), model)
    return read_task(Path(task), model)
