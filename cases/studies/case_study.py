"""The study of a case: many variants, and verdicts on the statements of the case's source.

A case folder may hold a ``study.py`` with three functions:

- ``variants(scene, shortened)`` gives the ``StudyVariant`` s; it starts neither MPI nor PETSc;
- ``measure(results)`` takes plain figures from each run's result file;
- ``conclude(runs)`` turns the runs by name into a ``postproc.report.study_report.Study``.

It is a program, unlike the scene: it runs with ``--study`` only, after a line that names it.
"""

from __future__ import annotations

import importlib.util
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

from catenary.base.errors import CatenaryError, InputError
from catenary.base.parallel import on_root
from catenary.cases.scene.input.case_files import find_case
from catenary.cases.scene.load import load_scene
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.sweep.jobs import (
    AS_USUAL,
    Ended,
    Job,
    Part,
    RunOptions,
    interrupted,
    make_jobs,
)
from catenary.cases.studies.sweep.variants import Variant, slug
from catenary.postproc.report.study_table import write_files

if TYPE_CHECKING:
    from catenary.postproc.read.results import Results

STUDY_FILE = "study.py"
RUNS = "runs"
_FUNCTIONS = ("variants", "measure", "conclude")


@dataclass(frozen=True)
class StudyVariant:
    """A run of a study; ``keep_results`` keeps its result file for the figures."""

    variant: Variant
    keep_results: bool = False


@dataclass(frozen=True)
class Plan:
    """A study that is to be run: the case's name, its ``study.py``, all jobs."""

    case: str
    path: Path
    jobs: Sequence[Job]


class StudyRun(NamedTuple):
    """A run of a study, as given to ``conclude``: how it ended, its scene, its results' folder."""

    ended: Ended
    scene: Scene
    folder: Path


def find_study(case: str) -> Path:
    """The ``study.py`` of a case.

    Raises
    ------
    InputError
        If there is no such case, or if it has no study.
    """
    path = find_case(case).absolute().with_name(STUDY_FILE)
    if not path.is_file():
        raise InputError(
            f"{case} has no study: there is no {STUDY_FILE} beside its {find_case(case).name}; "
            "leave --study away, or vary keys with `catenary sweep`"
        )
    return path


def make_plan(case: str, overrides: Sequence[str] = (), shortened: bool = False) -> Plan:
    """All checked runs of a case's study. Not collective.

    Parameters
    ----------
    case : name, file or folder
    overrides : ``key=value`` each, for all runs; the study's own changes come after them
    shortened : apply the case's ``[test]`` table and run the short form of the study

    Raises
    ------
    InputError
        If the case has no study, if that makes no runs, or if a scene of it is wrong.
    """
    path = find_study(case)
    module = _load(path)
    scene = load_scene(case, overrides, shortened)
    planned: list[StudyVariant] = list(_said(path, module.variants, scene, shortened) or ())
    if not planned or not all(isinstance(one, StudyVariant) for one in planned):
        raise InputError(f"variants of {path} must give a list of StudyVariant, one at least")
    jobs = make_jobs(case, [each.variant for each in planned], overrides, shortened)
    kept = [
        replace(job, keep_results=each.keep_results)
        for job, each in zip(jobs, planned, strict=True)
    ]
    return Plan(scene.case.name, path, kept)


def run(
    plan: Plan, out_dir: Path, comm: Any, options: RunOptions = AS_USUAL, part: Part | None = None
) -> tuple[str | None, list[Ended]]:
    """Run what is not done yet, write the study's report; returns its text and the runs.

    Collective. An interrupted study has no text, nor has a ``part`` of it, whose runs alone are
    made. Runs that broke are left out of the report, whose verdicts then say what cannot be
    decided.

    Raises
    ------
    InputError
        If ``out_dir`` holds other results and ``options.force`` is not given.
    """
    from catenary.cases.studies.sweep.run_jobs import run_jobs

    begin = time.perf_counter()
    jobs = plan.jobs if part is None else part.of(plan.jobs)
    ended = run_jobs(jobs, out_dir / RUNS, comm, options, measure=partial(_measured, plan.path))
    if part is not None or interrupted(ended):
        return None, ended
    text = on_root(comm, lambda: _conclude(plan, out_dir, ended, begin), takes_long=True)
    return text, ended


def _measured(path: Path, results: Results) -> dict[str, Any]:
    """Figures that ``measure`` of a ``study.py`` takes from a result file; other processes load the
    program again, as no package has it."""
    measured: dict[str, Any] = _said(path, _load(path).measure, results)
    return measured


def _conclude(plan: Plan, out_dir: Path, ended: Sequence[Ended], begin: float) -> str:
    from catenary.cases.studies.sweep import output as sweep_output
    from catenary.postproc.report.study_report import Study, verdict_text, write_study

    runs = {
        one.variant.name: StudyRun(one, job.scene, out_dir / RUNS / one.variant.name)
        for one, job in zip(ended, plan.jobs, strict=True)
    }
    study = _said(plan.path, _load(plan.path).conclude, runs)
    if not isinstance(study, Study):
        raise InputError(f"conclude of {plan.path} must give a Study, of catenary.postproc.report")
    table = sweep_output.table_of(ended)
    wall = sum(one.wall for one in ended)
    facts = {
        "runs": f"{len(ended)}, of which {sum(not one.done for one in ended)} broke",
        "time of all runs": f"{wall:.0f} s",
        "time of this call": f"{time.perf_counter() - begin:.0f} s, "
        f"{sum(one.skipped for one in ended)} of the runs had been done before",
    }
    files = write_study(study, out_dir, table.records(), facts)
    files += write_files(out_dir, {"study.csv": table})
    fact_lines = [f"{name}: {value}" for name, value in facts.items()]
    listed = [str(path) for path in files if path.stem == "study"]
    remarks = sweep_output.remarks_of(ended)
    return "\n".join([verdict_text(study), "", *fact_lines, *remarks, "", *listed])


def _said(path: Path, function: Callable[..., Any], *given: Any) -> Any:
    """What a function of a ``study.py`` returns.

    Raises
    ------
    InputError
        If it fails.
    """
    try:
        return function(*given)
    except CatenaryError:
        raise
    except Exception as error:  # whatever a person's own file does wrong
        frames = traceback.extract_tb(error.__traceback__)
        own = [one.lineno for one in frames if one.filename == str(path)]
        line = f" in line {own[-1]}" if own else ""
        raise InputError(
            f"{function.__name__} of {path} fails{line}: {type(error).__name__}: {error}"
        ) from error


def _load(path: Path) -> ModuleType:
    """The module of a ``study.py``.

    Raises
    ------
    InputError
        If it cannot be loaded or lacks one of the three functions.
    """
    name = f"catenary_study_{slug(path.parent.name).replace('-', '_').replace('.', '_')}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None  # a file that ends in .py has a loader
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever a person's own file does wrong
        raise InputError(f"{path} cannot be loaded: {type(error).__name__}: {error}") from error
    missing = [function for function in _FUNCTIONS if not callable(getattr(module, function, None))]
    if missing:
        raise InputError(f"{path} has no function {missing[0]}; a study needs all of "
                         f"{', '.join(_FUNCTIONS)}")  # fmt: skip
    return module
