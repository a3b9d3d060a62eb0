"""Sweeps of scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catenary.base.errors import InputError
from catenary.base.parallel import on_root
from catenary.callers import (
    communicator,
    progress_shown,
    say_nothing,
    say_on_error_stream,
    temporary_folder,
)
from catenary.cases.process.petsc_options import options_of
from catenary.cases.studies.sweep.variants import (
    Variant,
    check_keys,
    product,
    text_of,
    varied_key,
)
from catenary.estimates import sampling_like
from catenary.scenes import SceneLike, draft_of, plain_value

if TYPE_CHECKING:
    import pandas as pd


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
    draft, comm = draft_of(scene), communicator(comm)
    if sample is None:
        variants, sampling = _listed(vary), None
    elif vary is not None:
        raise InputError("sample makes all variants itself: give vary or sample, not both")
    else:
        from catenary.cases.studies.sampling.samples import samples

        sampling, where = sampling_like(sample)
        variants = samples(sampling, draft.scene(), where)
    say = say_on_error_stream if progress else say_nothing
    with ExitStack() as stack:
        folder = (
            Path(out) if out is not None else stack.enter_context(temporary_folder(comm, "sweep"))
        )
        made = sweep_of(
            draft,
            variants,
            folder,
            only_statistics=only_statistics,
            histories=histories,
            force=force,
        )
        options = stack.enter_context(options_of(made.first.petsc.given()))
        stack.enter_context(progress_shown(False, comm))
        plan = RunOptions(force, options, say if comm.rank == 0 else say_nothing, jobs)
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
