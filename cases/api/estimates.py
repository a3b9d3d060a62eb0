"""Uncertainty from tables of sweeps."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catenary.base.errors import InputError
from catenary.scenes import plain_value

if TYPE_CHECKING:
    import pandas as pd

    from catenary.cases.studies.sampling.tables import SamplingTable
    from catenary.cases.studies.uncertainty.evaluation import Uncertainty as Evaluated


class Uncertainty:
    """Estimates from a table of runs, with bounds of 95 % confidence: what ``uncertainty`` gives.

    Bounds are columns with the end ``_low`` and ``_high``, NaN where too few runs leave them open.
    ``pantograph`` is empty for statistics of the line.

    Examples
    --------
    >>> table = {"variant": ["a", "b", "c"], "outcome": "done", "std_N": [25.0, 27.0, 32.0]}
    >>> catenary.uncertainty(table)
    <catenary.Uncertainty: 3 runs>
    """

    def __init__(self, found: Evaluated) -> None:
        self._found = found

    @property
    def statistics(self) -> pd.DataFrame:
        """Mean and standard deviation of each statistic with bounds, and its extremes.

        Examples
        --------
        >>> table = {"variant": ["a", "b", "c"], "outcome": "done", "std_N": [25.0, 27.0, 32.0]}
        >>> catenary.uncertainty(table).statistics["mean"].tolist()
        [28.0]
        """
        return _frame(self._found.statistics)

    @property
    def quantiles(self) -> pd.DataFrame:
        """Quantiles of each statistic, with bounds by order statistics.

        Examples
        --------
        >>> table = {"variant": ["a", "b", "c"], "outcome": "done", "std_N": [25.0, 27.0, 32.0]}
        >>> quantiles = catenary.uncertainty(table).quantiles
        >>> quantiles[quantiles.probability == 0.5].value.tolist()
        [27.0]
        """
        return _frame(self._found.quantiles)

    @property
    def probabilities(self) -> pd.DataFrame:
        """Probability that each acceptance criterion fails, with Clopper-Pearson bounds.

        Examples
        --------
        >>> table = {"variant": ["a", "b"], "failed": [[], ["arcing NQ"]], "passed": [True, False]}
        >>> catenary.uncertainty(table).probabilities["probability"].tolist()
        [0.5, 0.5]
        """
        return _frame(self._found.probabilities)

    @property
    def sensitivity(self) -> pd.DataFrame:
        """Sensitivity indices of each statistic and key; ``method`` says of which kind.

        Examples
        --------
        >>> table = {"variant": ["a", "b", "c"], "outcome": "done", "std_N": [25.0, 27.0, 32.0]}
        >>> catenary.uncertainty(table).sensitivity.empty
        True
        """
        return _frame(self._found.sensitivity)

    @property
    def method(self) -> str:
        """Which sensitivity indices these are.

        Examples
        --------
        >>> table = {"variant": ["a", "b", "c"], "outcome": "done", "std_N": [25.0, 27.0, 32.0]}
        >>> catenary.uncertainty(table).method
        'first-order indices from given data (RBD-FAST with the correction of Tissot and Prieur)'
        """
        return self._found.method

    @property
    def notes(self) -> list[str]:
        """Sentences on what is left out.

        Examples
        --------
        >>> table = {"variant": ["a", "b"], "outcome": ["done", "broke"], "std_N": [25.0, None]}
        >>> catenary.uncertainty(table).notes
        ['1 run of 2 did not end; estimates are of the others']
        """
        return list(self._found.notes)

    def __repr__(self) -> str:
        return f"<catenary.Uncertainty: {self._found.n_done} runs>"


def uncertainty(
    table: pd.DataFrame | Mapping[str, Any] | str | Path,
    sample: Mapping[str, Any] | str | Path | None = None,
) -> Uncertainty:
    """Evaluate the table of a sweep. Not collective.

    Parameters
    ----------
    table : DataFrame, mapping, str or Path
        What ``catenary.sweep`` returns, or columns like its; the folder of a sweep; or such a table
        as a file, ``.csv`` or ``.parquet``.
    sample : mapping, str or Path, optional
        The sampling file of the table, or its tables; of a folder the one that is in it. Without
        one the columns between ``variant`` and ``outcome`` are the inputs.

    Returns
    -------
    Uncertainty

    Raises
    ------
    InputError
        If it is no table of runs.

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

    sampling = None if sample is None else sampling_like(sample)[0]
    if isinstance(table, str | Path):
        found = read_run_table(Path(table))
        if sampling is not None:
            found = run_table(found.frame, sampling, str(table))
    else:
        found = run_table(_columns(pd, table), sampling)
    return Uncertainty(evaluate(found))


def sampling_like(sample: Mapping[str, Any] | str | Path) -> tuple[SamplingTable, str]:
    """The checked tables of a sampling, and where they were written, for sentences.

    Parameters
    ----------
    sample : mapping, str or Path
        The tables as nested dictionaries, or the file.
    """
    from catenary.cases.studies.sampling.tables import read_sampling, sampling_of

    if isinstance(sample, Mapping):
        where = "the table given as sample"
        return sampling_of(plain_value(sample, "sample"), where), where
    return read_sampling(Path(sample)), str(sample)


def _columns(pd: Any, table: Any) -> pd.DataFrame:
    try:
        return pd.DataFrame(table)
    except ValueError as error:
        raise InputError(f"the table has columns of several lengths: {error}") from error


def _frame(rows: list[dict[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    return pd.DataFrame(rows)
