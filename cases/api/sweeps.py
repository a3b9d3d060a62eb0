"""Sweeps of scenes, and the uncertainty that their tables tell."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catenary.base.errors import InputError
from catenary.base.parallel import on_root
from catenary.callers import (
    communicator,
    folder_of,
    given_or_temporary,
    listed,
    n_at_once,
    path_of,
    progress_shown,
    refuse_different,
    saying,
)
from catenary.cases.process.petsc_options import options_of
from catenary.cases.scene.input.faults import shown
from catenary.cases.studies.sweep.variants import Variant, check_keys, product, text_of, varied_key
from catenary.scenes import SceneLike, draft_of, plain_value, tables_or_file

if TYPE_CHECKING:
    import pandas as pd

    from catenary.cases.scene.load import Draft
    from catenary.cases.studies.uncertainty import evaluation
    from catenary.cases.studies.uncertainty.run_table import RunTable
    from catenary.cases.studies.uncertainty.sampling import SamplingTable
    from catenary.postproc.report.study_table import Content


@dataclass(frozen=True, eq=False, repr=False)
class Uncertainty:
    """Estimates from a table of runs, with bounds of 95 % confidence, from ``uncertainty``.

    Bounds are columns with the end ``_low`` and ``_high``, NaN where too few runs leave them open.
    ``pantograph`` is empty for statistics of the line. As text it is what the program prints.

    Attributes
    ----------
    statistics : pandas.DataFrame
        Mean and standard deviation of each statistic with bounds, and its extremes.
    quantiles : pandas.DataFrame
        Quantiles of each statistic, with bounds by order statistics.
    probabilities : pandas.DataFrame
        Probability that each acceptance criterion fails, with Clopper-Pearson bounds.
    sensitivity : pandas.DataFrame
        Sensitivity indices of each statistic and key.
    method : str
        Kind and source of the sensitivity indices.
    notes : list of str
        Sentences on data and estimates that are left out.

    Examples
    --------
    >>> found = catenary.uncertainty(
    ...     {
    ...         "variant": ["a", "b", "c"],
    ...         "outcome": ["done", "done", "broke"],
    ...         "std_N": [25.0, 27.0, None],
    ...         "failed": [[], ["arcing NQ"], []],
    ...         "passed": [True, False, None],
    ...     }
    ... )
    >>> found
    <catenary.Uncertainty: 2 runs>
    >>> found.statistics["mean"].tolist(), found.sensitivity.empty
    ([26.0], True)
    >>> found.quantiles[found.quantiles.probability == 0.5].value.tolist()
    [26.0]
    >>> found.probabilities["probability"].tolist()
    [0.5, 0.5]
    >>> found.method
    'first-order indices from given data (RBD-FAST with the correction of Tissot and Prieur)'
    >>> found.notes[0].partition(",")[0]
    '1 run of 3 did not end; estimates are of the others'
    """

    statistics: pd.DataFrame
    quantiles: pd.DataFrame
    probabilities: pd.DataFrame
    sensitivity: pd.DataFrame
    method: str
    notes: list[str]
    _own: evaluation.Uncertainty
    _runs: RunTable

    def __str__(self) -> str:
        from catenary.cases.studies.uncertainty.output import as_text

        return as_text(self._own)

    def __repr__(self) -> str:
        return f"<catenary.Uncertainty: {self._own.n_done} runs>"


def uncertainty(
    table: pd.DataFrame | Mapping[str, Any] | str | Path,
    sample: Mapping[str, Any] | str | Path | None = None,
) -> Uncertainty:
    """Evaluate the table of a sweep. Not collective.

    Parameters
    ----------
    table : DataFrame, mapping, str or Path
        A table as ``catenary.sweep`` returns it, or columns like it; the folder of a sweep; or such
        a table as a file, ``.csv`` or ``.parquet``.
    sample : mapping, str or Path, optional
        The sampling file of the table, or its tables; of a folder the one that is in it. Without
        one the columns between ``variant`` and ``outcome`` are the inputs.

    Returns
    -------
    Uncertainty

    Raises
    ------
    InputError
        If the table is not one of runs.

    Examples
    --------
    >>> sample = {
    ...     "n": 4,
    ...     "keys": {"train.speed_km_h": {"type": "normal", "standard_deviation": 5.0}},
    ... }
    >>> scene = catenary.load("en50318_2002", short=True)
    >>> table = catenary.sweep(scene, sample=sample)
    >>> found = catenary.uncertainty(table, sample)
    >>> row = found.probabilities.set_index("criterion").loc["arcing NQ"]
    >>> print(f"{row.probability:.0f}, at most {row.probability_high:.2f}")
    0, at most 0.60
    """
    import pandas as pd

    from catenary.cases.studies.uncertainty.evaluation import evaluate
    from catenary.cases.studies.uncertainty.run_table import read_run_table, run_table

    where = "the table"
    if isinstance(table, str | Path):
        runs, where = read_run_table(path_of(table, "table")), str(table)
    elif isinstance(table, pd.DataFrame | Mapping):
        try:
            runs = run_table(pd.DataFrame(table))
        except ValueError as error:
            raise InputError(f"the table is no table of columns of one length: {error}") from error
    else:
        raise InputError(f"table is {shown(table)}; it must be a table, or a file or folder of one")
    if sample is not None:
        runs = run_table(runs.frame, sampling_like(sample)[0], where)
    found = evaluate(runs)
    return Uncertainty(
        pd.DataFrame(found.statistics),
        pd.DataFrame(found.quantiles),
        pd.DataFrame(found.probabilities),
        pd.DataFrame(found.sensitivity),
        found.method,
        found.notes,
        found,
        runs,
    )


def estimate_files(found: Uncertainty) -> dict[str, Content]:
    """Estimates and pictures, as ``catenary uncertainty`` writes them. Not collective."""
    from catenary.cases.studies.uncertainty.output import files_of

    return files_of(found._runs, found._own)


def sampling_like(sample: Mapping[str, Any] | str | Path) -> tuple[SamplingTable, str]:
    """The checked tables of a sampling, and where they were written, for sentences."""
    from catenary.cases.studies.uncertainty.sampling import read_sampling, sampling_of

    given, where = tables_or_file(sample, "sample"), "the table given as sample"
    if isinstance(given, Path):
        return read_sampling(given), str(sample)
    return sampling_of(given, where), where


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
    from catenary.cases.studies.sweep.jobs import RunOptions, interrupted
    from catenary.cases.studies.sweep.output import table_of
    from catenary.cases.studies.sweeps import plan_sweep

    if kept and given is None:
        raise InputError("histories are kept in a file: give the folder out, too")
    draft, comm = draft_of(scene), communicator(comm)
    if sample is None:
        variants, sampling = _variants_of(vary), None
    elif vary is not None:
        raise InputError("sample makes all variants itself: give vary or sample, not both")
    else:
        variants, sampling = samples_of(sample, draft)
    refuse_different(comm, draft.raw, variants, given)
    with given_or_temporary(given, comm, "sweep") as folder:
        made = plan_sweep(
            draft,
            variants,
            folder,
            None if given is None else sampling,
            only_statistics=only_statistics,
            histories=kept,
            force=force,
        )
        with options_of(made.own.first.petsc.given()) as petsc, progress_shown(False, comm):
            options = RunOptions(force, petsc, saying(progress and comm.rank == 0), n_jobs)
            drawn = None if given is None else ()
            found = made.run(comm, options, "a sweep of a Python program", drawn)
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
    from catenary.cases.studies.uncertainty.samples import samples

    sampling, where = sampling_like(sample)
    return samples(sampling, draft.scene(), where), sampling


def _variants_of(vary: Mapping[str, Iterable[Any]] | None) -> list[Variant]:
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
