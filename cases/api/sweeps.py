"""Sweeps of scenes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catenary.base.errors import InputError
from catenary.base.parallel import on_root
from catenary.callers import (
    communicator,
    folder_of,
    listed,
    n_at_once,
    progress_shown,
    refuse_different,
    say_nothing,
    say_on_error_stream,
    temporary_folder,
)
from catenary.cases.process.petsc_options import options_of
from catenary.cases.scene.input.faults import shown
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

    from catenary.cases.scene.load import Draft
    from catenary.cases.studies.sampling.tables import SamplingTable


def sweep(
    scene: SceneLike,
    vary: Mapping[str, Iterable[Any]] | None = None,
    out: str | Path | None = None,
    *,
    sample: Mapping[str, Any] | str | Path | None = None,
    only_statistics: bool = False,
    histories: str | Iterable[str] = (),
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
        Folder for the files that ``catenary sweep -o`` writes: a folder for each
        variant, tables and pictures. What is done there already is not run again.
    sample : mapping, str or Path, optional
        In place of ``vary``: a sampling file, or its tables, with a distribution for each key.
        ``catenary.uncertainty`` evaluates the table.
    only_statistics : bool
        Whether nothing but the table is kept, and no result file of a variant: for thousands of
        them. Variants that share a line march side by side.
    histories : str or sequence of str
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
        If a key, a value or a distribution is wrong, if no variant can be run, or if processes
        differ in what they give.
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

    n_jobs, given, kept = n_at_once(jobs), folder_of(out), listed(histories, "histories")
    from catenary.cases.studies.planned_sweep import plan_sweep
    from catenary.cases.studies.sweep.jobs import RunOptions, interrupted
    from catenary.cases.studies.sweep.output import table_of

    if kept and given is None:
        raise InputError("histories are kept in a file: give the folder out, too")
    draft, comm = draft_of(scene), communicator(comm)
    if sample is None:
        variants, sampling = _listed(vary), None
    elif vary is not None:
        raise InputError("sample makes all variants itself: give vary or sample, not both")
    else:
        variants, sampling = samples_of(sample, draft)
    refuse_different(comm, draft.raw, variants, given)
    say = say_on_error_stream if progress else say_nothing
    with ExitStack() as stack:
        folder = given or stack.enter_context(temporary_folder(comm, "sweep"))
        made = plan_sweep(
            draft,
            variants,
            folder,
            None if given is None else sampling,
            only_statistics=only_statistics,
            histories=kept,
            force=force,
        )
        options = stack.enter_context(options_of(made.own.first.petsc.given()))
        stack.enter_context(progress_shown(False, comm))
        plan = RunOptions(force, options, say if comm.rank == 0 else say_nothing, n_jobs)
        drawn = None if given is None else ()
        found = made.run(comm, plan, "a sweep of a Python program", drawn)
    if interrupted(found.ended):
        raise KeyboardInterrupt
    # Of rank 0: times of a rank are its own.
    return pd.DataFrame(on_root(comm, lambda: table_of(found.ended).records()))


def samples_of(
    sample: Mapping[str, Any] | str | Path, draft: Draft
) -> tuple[list[Variant], SamplingTable]:
    """The variants that a sampling, its tables or its file, makes of a case; its checked tables.

    Not collective.
    """
    from catenary.cases.studies.sampling.samples import samples

    sampling, where = sampling_like(sample)
    return samples(sampling, draft.scene(), where), sampling


def _listed(vary: Mapping[str, Iterable[Any]] | None) -> list[Variant]:
    """The variants of lists of values."""
    if vary is not None and not isinstance(vary, Mapping):
        raise InputError(f"vary is {shown(vary)}; it must be a table of lists of values by keys")
    varied = []
    for key, values in (vary or {}).items():
        if isinstance(values, str | Mapping) or not isinstance(values, Iterable):
            raise InputError(f"{key} in vary is {shown(values)}; it must be a list of values")
        texts = tuple(text_of(plain_value(own, f"{key} in vary")) for own in values)
        if texts:
            varied.append(varied_key(str(key), texts))
    if not varied or len(varied) < len(vary or {}):
        raise InputError("there is nothing to vary: give at least one key with a value")
    variants = product(varied, {}, "in vary")
    check_keys(variants, "in vary")
    return variants
