"""Optimisation and tolerances of scenes."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from catenary.base.process import alone
from catenary.callers import ending_as_python, folder_of, n_at_once, saying
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.studies.optimise.task import OptimiseTask
from catenary.cases.studies.records import held_study
from catenary.cases.studies.scene_sets import workers
from catenary.cases.studies.task_files import read_task
from catenary.cases.studies.tolerance.errors import ToleranceTask
from catenary.scenes import Scene, SceneLike, draft_of, scene_of, tables_or_file

if TYPE_CHECKING:
    import pandas as pd

    from catenary.cases.scene.load import Draft
    from catenary.cases.studies.optimise.study import Optimum as Found
    from catenary.cases.studies.optimise.study import Plan

logger = logging.getLogger("catenary.study")

Task = str | Path | Mapping[str, Any]


@dataclass(frozen=True, eq=False)
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
        Sentences on figures that get worse in any check; empty if none does.
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
        Folder for the files that ``catenary optimise -o`` writes. Runs that are kept
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
        If the task, or one of its scenes, is wrong.

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
    given, say = scene_of(scene), saying(progress)
    with ending_as_python():
        made = optima(lambda: (draft_of(given), task), out, jobs=jobs, force=force, say=say)
    return [_optimum(given, made.plan, found) for found in made.found]


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
        If the task, or one of its scenes, is wrong.

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

    from catenary.cases.studies.tolerance.output import table_of

    say = saying(progress)
    with ending_as_python():
        made = tolerances(lambda: (draft_of(scene), task), out, jobs=jobs, force=force, say=say)
    rows: Sequence[Mapping[str, Any]] = table_of(made.found).records()
    return pd.DataFrame(rows)


class Made(NamedTuple):
    """A study over a set of scenes: plan, what was found, what the program prints, its files."""

    plan: Any
    found: Any
    text: str
    files: list[Path]


def optima(read: Callable[[], tuple[Draft, Task]], out: str | Path | None, **how: Any) -> Made:
    """The optima of a task, for ``optimise`` and its verb, as of ``_made``. Not collective."""
    from catenary.cases.studies.optimise import output, study

    own = OptimiseTask, study.make_plan, study.optimise, output, output.RECORD
    return _made(*own, read, out, **how)


def tolerances(read: Callable[[], tuple[Draft, Task]], out: str | Path | None, **how: Any) -> Made:
    """The tolerances of a task, for ``tolerance`` and its verb, as of ``_made``. Not collective."""
    from catenary.cases.studies.tolerance import output, study

    own = ToleranceTask, study.make_plan, study.find_tolerances, output, output.TABLE
    return _made(*own, read, out, **how)


def _made(
    model: Any,
    make_plan: Callable[[Draft, Any], Any],
    find: Callable[..., Any],
    output: Any,
    table: str,
    read: Callable[[], tuple[Draft, Task]],
    out: str | Path | None,
    *,
    command: str = "a study of a Python program",
    jobs: int = 1,
    force: bool = False,
    warn: Callable[[str], None] = logger.warning,
    say: Callable[[str], None],
) -> Made:
    """Plan a study, find what it looks for, and leave what its ``output`` writes. Not collective.

    ``read`` gives the case and the task, a table as ``model`` has it, once it is known that ``out``
    can be taken and has no ``table`` of an earlier study. ``command`` says to others that want the
    folder what this process does; ``warn`` gets sentences on the task, ``say`` lines on progress.
    A signal raises ``Interrupted``; other errors are those of ``optimise``.
    """
    n_jobs, folder = n_at_once(jobs), folder_of(out)
    refuse_table(folder, table, force)
    draft, task = read()
    plan = make_plan(draft, read_task(tables_or_file(task, "task"), model))
    for sentence in plan.warnings:
        warn(sentence)
    with held_study(folder, alone(), command, force) as held, workers(n_jobs) as pool:
        found = find(plan, pool, held.kept, say)
        files = held.write(lambda: output.files_of(plan, found))
    return Made(plan, found, output.as_text(plan, found), files)
