"""Runs and sweeps of scenes."""

from __future__ import annotations

import logging
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catenary.base.errors import InputError, RunBroken
from catenary.base.lone_process import alone, world
from catenary.base.parallel import launched_by_mpirun, on_root
from catenary.cases.process.petsc_options import options_of
from catenary.cases.studies.sweep.variants import (
    Variant,
    check_keys,
    product,
    text_of,
    varied_key,
)
from catenary.estimates import sampling_like
from catenary.scenes import SceneLike, checked, draft_of, plain_value

if TYPE_CHECKING:
    import pandas as pd

    from catenary.results import Run

_PROGRESS = "catenary.progress"


def run(
    scene: SceneLike,
    out: str | Path | None = None,
    *,
    force: bool = False,
    progress: bool = False,
    comm: Any = None,
) -> Run:
    """Simulate a scene. Collective under mpirun: all processes call it with the same scene.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The scene, or whatever ``load`` takes for one.
    out : str or Path, optional
        Folder into which all is written that ``catenary run -o`` writes: results, report, pictures,
        snapshots of the moving line. Without it results are kept in memory, without snapshots.
    force : bool
        Whether results that are in ``out`` are replaced, and whether a run may be larger than
        memory and disk have room for.
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
        If the scene is wrong or too large, or if ``out`` cannot be taken.
    RunBroken
        If the run cannot go on. What it recorded up to there is in ``out``, and in the attribute
        ``run`` of the error.
    KeyboardInterrupt
        If a signal ended it. With ``out``, ``catenary restart`` continues it.

    Examples
    --------
    >>> run = catenary.run(catenary.load("en50318_2002", short=True))
    >>> bool(100 < run.statistics.mean_N["pantograph"] < 130)
    True
    """
    tables = checked(scene)
    comm = _communicator(comm)
    with ExitStack() as stack:
        options = stack.enter_context(options_of(tables.petsc.given()))
        stack.enter_context(_shown(progress, comm))
        folder = Path(out) if out is not None else stack.enter_context(_temporary(comm, "run"))
        from catenary.cases.run.runner import on_as_many, run_case

        ended = on_as_many(
            tables,
            comm,
            lambda ranks: run_case(
                tables,
                folder,
                ranks,
                force=force,
                petsc_options=options,
                only_summary=out is None,
            ),
        )
        if ended.outcome == "interrupted":
            raise KeyboardInterrupt
        found = _read(folder, comm, in_memory=out is None)
    if ended.outcome != "done":
        error = RunBroken(ended.outcome)
        error.run = found
        raise error
    return found


def sweep(
    scene: SceneLike,
    vary: Mapping[str, Sequence[Any]] | None = None,
    out: str | Path | None = None,
    *,
    sample: Mapping[str, Any] | str | Path | None = None,
    only_statistics: bool = False,
    histories: Sequence[str] = (),
    jobs: int = 1,
    force: bool = False,
    progress: bool = False,
    comm: Any = None,
) -> pd.DataFrame:
    """Run all combinations of some values, or samples. Collective under mpirun, as ``run``.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        What is varied.
    vary : mapping, optional
        Values by dotted keys, for instance ``{"train.speed_km_h": [250, 275]}``.
    out : str or Path, optional
        Folder into which all is written that ``catenary sweep -o`` writes: a folder for each
        variant, tables and pictures. What is done there already is not run again.
    sample : mapping, str or Path, optional
        In place of ``vary``: a sampling file, or its tables, with a distribution for each key.
        ``catenary.uncertainty`` evaluates the table.
    only_statistics : bool
        Whether nothing but the table is kept, and no result file of a variant: for thousands of
        them. Variants that share a line march side by side.
    histories : sequence of str
        With ``only_statistics`` and ``out``: histories of all variants that are kept in
        ``out/histories.h5``, of contact_force, filtered_force, head_height and wire_height.
    jobs : int
        Runs at the same time, each in a process of its own; 0 for one on each core. Under mpirun
        the number of processes: a run on each.
    force, progress, comm
        As for ``run``.

    Returns
    -------
    pandas.DataFrame
        A row for each variant and pantograph, with the columns of ``sweep.csv``: the varied keys,
        ``outcome`` ("done", or the sentence of what is wrong with a variant), ``pantograph`` and
        the statistics, whose units end their names.

    Raises
    ------
    InputError
        If a key, a value or a distribution is wrong, or if no variant can be run.
    KeyboardInterrupt
        If a signal ended it. With ``out`` the same call goes on.

    Examples
    --------
    >>> scene = catenary.load("en50318_2002", short=True)
    >>> table = catenary.sweep(scene, {"train.speed_km_h": [200, 250]})
    >>> table["train.speed_km_h"].tolist(), bool(table.std_N[1] > table.std_N[0])
    ([200, 250], True)
    """
    import pandas as pd

    if not isinstance(jobs, int) or jobs < 0:
        raise InputError(f"jobs is {jobs!r}; it is a number of runs, or 0 for one on each core")
    from catenary.cases.studies.sweep.jobs import RunOptions, interrupted
    from catenary.cases.studies.sweep.output import table_of
    from catenary.cases.studies.sweep.sweep import run_sweep, sweep_of

    if histories and out is None:
        raise InputError("histories are kept in a file: give the folder out, too")
    draft, comm = draft_of(scene), _communicator(comm)
    if sample is None:
        variants, sampling = _listed(vary), None
    elif vary is not None:
        raise InputError("sample makes all variants itself: give vary or sample, not both")
    else:
        from catenary.cases.studies.sampling.samples import samples

        sampling, where = sampling_like(sample)
        variants = samples(sampling, draft.scene(), where)
    say = _line if progress else _nothing
    with ExitStack() as stack:
        folder = Path(out) if out is not None else stack.enter_context(_temporary(comm, "sweep"))
        made = sweep_of(
            draft,
            variants,
            folder,
            only_statistics=only_statistics,
            histories=histories,
            force=force,
        )
        options = stack.enter_context(options_of(made.first.petsc.given()))
        stack.enter_context(_shown(False, comm))
        plan = RunOptions(force, options, say if comm.rank == 0 else _nothing, jobs)
        program = "a sweep of a Python program"
        ended, _ = run_sweep(made, folder, comm, plan, program, () if sampling is None else None)
        # Times of a rank are its own.
        rows = on_root(comm, lambda: table_of(ended).records())
        if sampling is not None and out is not None:
            from catenary.cases.result_folder.folder_lock import held
            from catenary.cases.studies.uncertainty.output import write_evaluated

            with held(folder, comm, program):
                on_root(comm, lambda: write_evaluated(folder, rows, sampling), takes_long=True)
    if interrupted(ended):
        raise KeyboardInterrupt
    return pd.DataFrame(rows)


def _listed(vary: Mapping[str, Sequence[Any]] | None) -> list[Variant]:
    """The variants of lists of values."""
    if not vary or not all(len(values) for values in vary.values()):
        raise InputError("there is nothing to vary: give at least one key with a value")
    varied = [
        varied_key(
            key, tuple(text_of(plain_value(own, f"{key} in vary")) for own in values), "vary"
        )
        for key, values in vary.items()
    ]
    variants = product(varied, {}, "in vary")
    check_keys(variants, "in vary")
    return variants


def _communicator(comm: Any) -> Any:
    if comm is not None:
        return comm
    return world() if launched_by_mpirun() else alone()


@contextmanager
def _temporary(comm: Any, what: str) -> Iterator[Path]:
    """A folder of rank 0 that all know, removed at the end. Collective."""
    with ExitStack() as stack:

        def make() -> str:
            return stack.enter_context(tempfile.TemporaryDirectory(prefix=f"catenary_{what}_"))

        yield Path(on_root(comm, make))


def _read(folder: Path, comm: Any, in_memory: bool) -> Run:
    """Results of a run that this process has just made. Collective.

    In memory all processes have the file that only rank 0 may be able to see.
    """
    from catenary.postproc.read.results import RESULT_FILE, Results
    from catenary.results import Run

    path = folder / RESULT_FILE
    if not in_memory:
        return Run(Results(path), folder)
    return Run(Results(path, image=on_root(comm, path.read_bytes)))


@contextmanager
def _shown(progress: bool, comm: Any) -> Iterator[None]:
    """While entered, progress is shown on standard error on rank 0, or nowhere. Not collective."""
    logger = logging.getLogger(_PROGRESS)
    before, passed_on = logger.level, logger.propagate
    handler: logging.Handler = logging.NullHandler()
    if progress and comm.rank == 0:
        handler = logging.StreamHandler(sys.stderr)
        handler.setFormatter(logging.Formatter("%(message)s"))
    logger.addHandler(handler)
    logger.setLevel(logging.INFO if progress else logging.WARNING)
    logger.propagate = not progress
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(before)
        logger.propagate = passed_on


def _line(text: str) -> None:
    print(text, file=sys.stderr)


def _nothing(text: str) -> None:
    """Say nothing."""
