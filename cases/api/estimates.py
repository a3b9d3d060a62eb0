"""Uncertainty from tables of sweeps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catenary.base.errors import InputError
from catenary.callers import path_of
from catenary.cases.scene.input.faults import shown
from catenary.scenes import tables_or_file

if TYPE_CHECKING:
    import pandas as pd

    from catenary.cases.studies.sampling.tables import SamplingTable
    from catenary.cases.studies.uncertainty import evaluation
    from catenary.cases.studies.uncertainty.run_table import RunTable
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
    from catenary.cases.studies.sampling.tables import read_sampling, sampling_of

    given, where = tables_or_file(sample, "sample"), "the table given as sample"
    if isinstance(given, Path):
        return read_sampling(given), str(sample)
    return sampling_of(given, where), where
