"""Runs of scenes, and runs that go on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.base.options import option
from catenary.base.parallel import on_root
from catenary.callers import (
    communicator,
    folder_of,
    given_or_temporary,
    number_of,
    path_of,
    progress_shown,
    refuse_different,
)
from catenary.cases.process.petsc_options import options_of
from catenary.cases.result_folder.output_folder import (
    refuse_impossible,
    refuse_no_folder,
    run_folder,
)
from catenary.scenes import SceneLike, checked, draft_of, scene_of

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene as CheckedScene
    from catenary.results import Run


def run(
    scene: SceneLike,
    out: str | Path | None = None,
    *,
    force: bool = False,
    report: bool = True,
    progress: bool = False,
    comm: Any = None,
) -> Run:
    """Simulate a scene. Collective under mpirun: all processes call it with the same scene.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The scene, or whatever ``load`` takes for one.
    out : str or Path, optional
        Folder for the files that ``catenary run -o`` writes: results, report, pictures,
        snapshots of the moving line. Without it results are kept in memory, without snapshots.
    force : bool
        Whether results that are in ``out`` are replaced, and whether a run may be larger than
        memory and disk have room for.
    report : bool
        Whether ``out`` gets a report with its pictures and tables, which takes half of the time of
        a short run. Without it there are results and ``summary.json``, and ``catenary report``
        makes the rest later.
    progress : bool
        Whether phases and time left are shown on standard error, as the program does.
    comm : mpi4py communicator, optional
        Processes that share the run; all of them under mpirun, else this one.

    Returns
    -------
    Run
        On every process.

    Raises
    ------
    InputError
        If the scene is wrong or too large, if ``out`` cannot be taken, or if processes differ in
        them.
    RunBroken
        If the run cannot go on. What it recorded up to there is in ``out``, and in the attribute
        ``run`` of the error.
    KeyboardInterrupt
        If a signal ended it. With ``out``, ``restart`` continues it.

    Examples
    --------
    >>> run = catenary.run(catenary.load("en50318_2002", short=True))
    >>> bool(100 < run.statistics.mean_N["pantograph"] < 130)
    True
    """
    own, given, comm = scene_of(scene), folder_of(out), communicator(comm)
    tables = checked(own)
    refuse_different(comm, draft_of(own).raw, given)
    in_memory = given is None
    with (
        _set_up(tables, progress, comm) as options,
        given_or_temporary(given, comm, "run") as folder,
    ):
        only_summary = in_memory or not report
        made = run_into(folder, tables, comm, options, force=force, only_summary=only_summary)
        return _returned(made, comm, in_memory)


def restart(
    folder: str | Path,
    until_m: float | None = None,
    evaluate: Sequence[float] | np.ndarray | None = None,
    *,
    force: bool = False,
    report: bool = True,
    progress: bool = False,
    comm: Any = None,
) -> Run:
    """Continue a run that was interrupted or broke, or prolong one that is done.

    Collective under mpirun, as ``run``. Any number of processes may continue a run.

    Parameters
    ----------
    folder : str or Path
        The folder of the run, whose last state it goes on from, or its ``run.h5``.
    until_m : float, optional
        Where the leading pantograph is to stop [m], if that is later than the run says.
    evaluate : sequence of two floats, optional
        With ``until_m``: begin and end of the stretch to evaluate [m].
    force : bool
        Whether to continue even without room for all results.
    report, progress, comm
        As for ``run``.

    Returns
    -------
    Run
        The whole run, on every process.

    Raises
    ------
    InputError
        If there is nothing to continue, if a ``Run`` of this program still reads the file to
        continue, or if the end is not later.
    RunBroken, KeyboardInterrupt
        As of ``run``.

    Examples
    --------
    >>> made = catenary.run(catenary.load("en50318_2002", short=True), folder / "longer")
    >>> end = made.scene["train.end_m"]
    >>> longer = catenary.restart(folder / "longer", until_m=end + 10.0)
    >>> longer.outcome, bool(longer.force.position.max() > end + 9.0)
    ('done', True)
    """
    own, comm, stretch = run_folder(path_of(folder, "folder")), communicator(comm), None
    until = None if until_m is None else number_of(until_m, "until_m")
    if evaluate is not None:
        places: Any = evaluate if np.ndim(evaluate) else [evaluate]
        stretch = ":".join(map(str, places))
    refuse_different(comm, own, until, stretch)

    tables = on_root(comm, lambda: scene_to_continue(own, until, stretch), takes_long=True)
    with _set_up(tables, progress, comm) as options:
        made = run_into(
            own,
            tables,
            comm,
            options,
            goes_on=True,
            force=force,
            extends=until is not None,
            only_summary=not report,
        )
        return _returned(made, comm)


def run_into(
    folder: Path,
    scene: CheckedScene,
    comm: Any,
    petsc_options: Sequence[str],
    *,
    goes_on: bool = False,
    **how: Any,
) -> Run:
    """A run into a folder, however it ends, of which no file is open. Collective.

    A run that is there ``goes_on`` with what ``scene_to_continue`` gave. PETSc was started with
    ``petsc_options``; ``how`` and errors are those of ``cases.run.runner.run_case``, or of
    ``restart_case``. The ``outcome`` of the run says how the march ended.
    """
    from catenary.cases.run.runner import restart_case, run_case

    march: Any = restart_case if goes_on else run_case
    ended = march(scene, folder, comm, petsc_options=petsc_options, **how)
    from catenary.results import Run  # reads results, which no march needs

    return Run(None, folder, ended)


def scene_to_continue(folder: Path, until_m: float | None, evaluate: str | None) -> CheckedScene:
    """The checked scene with which the run in a folder goes on. Not collective.

    ``until_m`` is where the leading pantograph is to stop [m], ``evaluate`` FROM:TO [m]; None for
    both as they are. InputError if there is no run, or as ``cases.run.continuing.extended_scene``.
    """
    from catenary.cases.run.continuing import EVALUATE, UNTIL, extended_scene
    from catenary.postproc.read.guard import examined
    from catenary.postproc.read.results import Results

    refuse_impossible(folder)
    refuse_no_folder(folder)
    if evaluate is not None and until_m is None:
        raise InputError(f"{option(*EVALUATE)} belongs to {option(*UNTIL)}")
    with Results(folder, examined(folder)) as results:
        config = results.attributes["config"]
    return extended_scene(config, str(results.path), until_m, evaluate)


@contextmanager
def _set_up(scene: CheckedScene, progress: bool, comm: Any) -> Iterator[list[str]]:
    """PETSc with the options of a scene, as words, and progress as it is wanted. Collective."""
    with options_of(scene.petsc.given()) as options, progress_shown(progress, comm):
        yield options


def _returned(made: Run, comm: Any, in_memory: bool = False) -> Run:
    """A run that is done, with its file open, or in memory on all ranks, of which only rank 0 may
    be able to see the file. Collective. Raises what ``run`` says unless it is done."""
    from catenary.results import held

    if made.outcome == "interrupted":
        raise KeyboardInterrupt
    # What broke is opened when it is asked for, as a file that is open cannot be continued.
    opens = in_memory or made.outcome == "done"
    own = held(made, comm, in_memory) if opens else made
    if own.outcome != "done":
        error = RunBroken(own.outcome)
        error.run = own
        raise error
    return own
