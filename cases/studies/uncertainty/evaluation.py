"""Evaluation of a table of runs of a line with uncertain keys: estimates, sensitivity indices.

Mean, deviation, quantiles and probabilities are estimated with confidence bounds from samples,
which are independent values, shape (n,); a mean and a deviation take two of them. SALib has the
sensitivity indices, from Saltelli's samples or from any table.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from catenary.cases.studies.uncertainty.run_table import RunTable
from catenary.cases.studies.uncertainty.samples import salib_problem, sample_name
from catenary.cases.studies.uncertainty.sampling import (
    SALTELLI,
    ChoicesTable,
    SamplingTable,
    SeedTable,
)
from catenary.postproc.evaluate.wording import counted
from catenary.postproc.files.run_schema import DONE

CONFIDENCE = 0.95
QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
_RESAMPLES = 2000
# Of fewer values there are too few different resamples, and no kurtosis; of more resamples need n^2
# numbers.
_FEWEST, _MOST_RESAMPLED = 10, 1000
SOBOL = "Sobol indices (Saltelli et al. 2010; Jansen's total-order index)"
GIVEN_DATA = (
    "first-order indices from given data (RBD-FAST with the correction of Tissot and Prieur)"
)
_SEED = 1  # of resamples
# Fewer runs leave no harmonics to tell from noise, in half of which bounds are estimated.
_FEWEST_RUNS, _MANY_RUNS = 100, 500
_HARMONICS = 4, 10
# Resamples for bounds, of up to so many runs and of more: those have small bounds, at a greater
# cost.
_RESAMPLES_OF_INDICES, _MOST_RUNS = (100, 25), 5000
# Half width beyond which a bound of an index, a number from 0 to 1, is none.
_WIDEST = 10.0
ANY_CRITERION = "any of them"
Row = dict[str, Any]


@dataclass(frozen=True)
class Uncertainty:
    """Estimates from the runs of a table.

    Attributes
    ----------
    n_runs, n_done : runs of the table, and those that came to their end
    statistics : mean and standard deviation of each statistic with bounds, its extremes
    quantiles : of each statistic with bounds
    probabilities : that acceptance criteria fail, with bounds
    method : of the sensitivity indices
    sensitivity : rows of ``indices``
    remarks : remarks on runs, and the number of runs with each, the most frequent first
    notes : sentences on what is left out
    is_sampled : whether the inputs are known to be samples, so that shares are probabilities
    """

    n_runs: int
    n_done: int
    statistics: list[Row]
    quantiles: list[Row]
    probabilities: list[Row]
    method: str
    sensitivity: list[Row]
    remarks: list[Row]
    notes: list[str]
    is_sampled: bool


def evaluate(table: RunTable) -> Uncertainty:
    """Estimates from a table of runs. Not collective.

    Of Saltelli's samples only the two base samples are independent: they alone give quantiles and
    probabilities.
    """
    independent = independent_runs(table)
    statistics, quantiles = [], []
    for here, rows in independent.figures():
        x = rows[here["statistic"]].dropna().to_numpy(float)
        if len(x) < 2:
            continue
        head = {**here, "n": len(x)}
        estimated = _named("mean", mean(x)) | _named("standard_deviation", deviation(x))
        ends = {"minimum": float(x.min()), "maximum": float(x.max())}
        statistics.append({**head, **estimated, **ends})
        quantiles += [
            {**head, "probability": p, **_named("value", quantile(x, p))} for p in QUANTILES
        ]
    runs = table.runs
    n_done = int((runs["outcome"] == DONE).sum())
    method, sensitivity, notes = indices(table)
    probabilities = failing(independent)
    if n_done < len(runs):
        broken = counted(len(runs) - n_done, "run")
        others = "; estimates are of the others" if statistics else ""
        others += ", and no probability counts a run that broke as failed" if probabilities else ""
        notes.insert(0, f"{broken} of {len(runs)} did not end{others}")
    if not statistics:
        notes.insert(0, "there are no estimates, which take figures of at least two runs")
    is_sampled = table.sampling is not None
    if statistics and not is_sampled:
        notes.append(
            "no sampling is known: means, quantiles and shares are those of these runs, and bounds "
            "hold if their inputs are independent samples"
        )
    return Uncertainty(
        len(runs), n_done, statistics, quantiles, probabilities, method, sensitivity,
        _remarks(runs), notes, is_sampled,
    )  # fmt: skip


def _remarks(runs: pd.DataFrame) -> list[Row]:
    if "remarks" not in runs:
        return []
    counts = runs["remarks"].explode().dropna().value_counts()
    return [{"remark": str(text), "n": int(n)} for text, n in counts.items()]


def independent_runs(table: RunTable) -> RunTable:
    """The rows whose inputs are independent samples of their distributions."""
    sampling = table.sampling
    if sampling is None or sampling.method != SALTELLI:
        return table
    kept = table.frame["variant"].isin(_base_samples(sampling))
    return table._replace(frame=table.frame[kept])


def _base_samples(sampling: SamplingTable) -> set[str]:
    """Names of the samples of Saltelli's two base matrices: first and last of each block."""
    block = sampling.block
    return {sample_name(block * i + place) for i in range(sampling.n) for place in (1, block)}


def failing(table: RunTable) -> list[Row]:
    """Probability that each acceptance criterion fails, and that any does.

    A run counts for a criterion that was judged in it. Without a column ``judged`` every criterion
    that fails in some run is taken as judged in all runs with a verdict.
    """
    done = table.done
    if "failed" not in done:
        return []
    # Rows of a run have all its criteria each, or those of their pantograph.
    runs_of = done.groupby("variant", sort=False)
    failed = [_united(own) for _, own in runs_of["failed"]]
    if "judged" in done:
        judged = [
            list(dict.fromkeys([*_united(own), *more]))
            for (_, own), more in zip(runs_of["judged"], failed, strict=True)
        ]
    else:
        every = list(dict.fromkeys(name for own in failed for name in own))
        known = runs_of["passed"].count() > 0 if "passed" in done else [True] * len(failed)
        judged = [every if one else [] for one in known]
    runs = list(zip(judged, failed, strict=True))
    rows = []
    for name in dict.fromkeys(name for own in judged for name in own):
        hits = [name in lost for own, lost in runs if name in own]
        rows.append(_probability(name, sum(hits), len(hits)))
    if rows:
        hits = [bool(lost) for own, lost in runs if own]
        rows.append(_probability(ANY_CRITERION, sum(hits), len(hits)))
    return rows


def _united(lists: Iterable[Sequence[str]]) -> list[str]:
    """The criteria of all rows of a run, each once."""
    return list(dict.fromkeys(name for own in lists for name in own))


def _probability(criterion: str, failed: int, n: int) -> Row:
    head = {"criterion": criterion, "n": n, "failed": failed}
    return {**head, **_named("probability", share(failed, n))}


class Bounded(NamedTuple):
    """An estimate and the bounds of its confidence interval, NaN where there is none."""

    value: float
    low: float
    high: float


def student(x: np.ndarray) -> Bounded:
    """Mean with the bounds of Student's distribution."""
    n, value = len(x), float(np.mean(x))
    half = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, n - 1)) * float(np.std(x, ddof=1)) / np.sqrt(n)
    return Bounded(value, value - half, value + half)


def mean(x: np.ndarray) -> Bounded:
    """Mean with bounds by the bootstrap (BCa, Efron 1987), which stay where values can be.

    They are NaN where values are so alike that resamples show none, and Student's of fewer values
    than ``_FEWEST`` or more than ``_MOST_RESAMPLED``. Resamples of n values scatter by
    sqrt((n - 1)/n) too little and are normal where Student's distribution is wider, so that
    intervals of 95 % would hold the truth in 87 % of ten normal values. They are taken at the
    greater level that mends both (T. Hesterberg, Am. Stat. 69, 2015, 371, the expanded interval).
    """
    n = len(x)
    if np.ptp(x) == 0.0 or not _FEWEST <= n <= _MOST_RESAMPLED:
        return student(x)
    wider = np.sqrt(n / (n - 1.0)) * stats.t.ppf(0.5 + 0.5 * CONFIDENCE, n - 1)
    level = float(2.0 * stats.norm.cdf(wider) - 1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", stats.DegenerateDataWarning)
        found = stats.bootstrap(
            (x,),
            np.mean,
            n_resamples=_RESAMPLES,
            confidence_level=level,
            method="BCa",
            random_state=np.random.default_rng(_SEED),
        ).confidence_interval
    return Bounded(float(np.mean(x)), float(found.low), float(found.high))


def deviation(x: np.ndarray) -> Bounded:
    """Standard deviation s with n - 1 degrees of freedom, and its bounds.

    ln(c s^2) is taken as normal, with c = n/(n - z) and the variance
    c^2 (kurtosis - (n - 3)/n)/(n - 1); the kurtosis is that about a trimmed mean (D. Bonett,
    Comput. Stat. Data Anal. 50, 2006, 775). Fewer than ``_FEWEST`` values have no bounds.
    """
    n, value = len(x), float(np.std(x, ddof=1))
    if np.ptp(x) == 0.0:
        return Bounded(0.0, 0.0, 0.0)
    if n < _FEWEST:
        return Bounded(value, np.nan, np.nan)
    z = float(stats.norm.ppf(0.5 + 0.5 * CONFIDENCE))
    factor = n / (n - z)
    middle = stats.trim_mean(x, 0.5 / np.sqrt(n - 4.0))
    # Over s, so that the fourth power of small values does not underflow.
    kurtosis = n * np.sum(((x - middle) / value) ** 4) / (n - 1.0) ** 2
    half = z * factor * np.sqrt((kurtosis - (n - 3.0) / n) / (n - 1.0))
    low, high = value * np.sqrt(factor) * np.exp(0.5 * half * np.array([-1.0, 1.0]))
    return Bounded(value, float(low), float(high))


def quantile(x: np.ndarray, probability: float) -> Bounded:
    """A quantile with bounds by order statistics, whatever the distribution.

    The number of values below the quantile is binomial, so that between the values of ranks l and
    u lies the quantile with at least the wanted confidence (David and Nagaraja 2003, sec. 7.1). A
    bound is NaN if there are too few values for it. The ``probability`` of the quantile is in
    (0, 1).
    """
    ordered, n = np.sort(x), len(x)
    rest = 0.5 * (1.0 - CONFIDENCE)
    lower = int(stats.binom.ppf(rest, n, probability))
    upper = int(stats.binom.ppf(1.0 - rest, n, probability)) + 1
    return Bounded(
        float(np.quantile(ordered, probability)),
        float(ordered[lower - 1]) if lower >= 1 else np.nan,
        float(ordered[upper - 1]) if upper <= n else np.nan,
    )


def share(hits: int, n: int) -> Bounded:
    """A probability from a number of hits among n, with bounds of Clopper and Pearson (1934)."""
    # The probability of the test, which is not asked for, underflows with thousands of runs.
    with np.errstate(all="ignore"):
        interval = stats.binomtest(hits, n).proportion_ci(CONFIDENCE, method="exact")
    return Bounded(hits / n, float(interval.low), float(interval.high))


def _named(name: str, one: Bounded) -> dict[str, Any]:
    """An estimate as three cells of a row."""
    return {name: one.value, f"{name}_low": one.low, f"{name}_high": one.high}


def indices(table: RunTable) -> tuple[str, list[dict[str, Any]], list[str]]:
    """Sensitivity indices of all statistics: their method, rows, and notes on what is left out.

    Rows have ``statistic``, ``pantograph``, ``key``, ``S1``, ``S1_conf`` (half width of the 95 %
    interval, NaN if there is none) and, with Saltelli's samples, ``ST``, ``ST_conf``, or, of a
    second-order index, ``with``, ``S2``, ``S2_conf``. ``rank_correlation`` is Spearman's.
    """
    sampling = table.sampling
    if sampling is not None and sampling.method == SALTELLI:
        return SOBOL, *_sobol(table, sampling)
    return GIVEN_DATA, *_given_data(table)


def _sobol(table: RunTable, sampling: SamplingTable) -> tuple[list[dict[str, Any]], list[str]]:
    from SALib.analyze import sobol

    names = [sample_name(number + 1) for number in range(sampling.n_samples)]
    rows: list[dict[str, Any]] = []
    notes: dict[str, None] = {}
    for here, own in table.figures():
        y = own.set_index("variant")[here["statistic"]].reindex(names).to_numpy(float)
        blocks = y.reshape(sampling.n, sampling.block)
        whole = blocks[np.isfinite(blocks).all(axis=1)]
        if len(whole) < 2:
            notes["no base sample is complete: there are no Sobol indices"] = None
            continue
        if len(whole) < sampling.n:
            lost = sampling.n - len(whole)
            notes[f"{lost} of {sampling.n} base samples are incomplete and left out"] = None
        if np.ptp(whole) == 0.0:
            continue  # nothing varies
        with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # resamples without variance
            found = sobol.analyze(
                salib_problem(sampling.columns),
                whole.ravel(),
                calc_second_order=sampling.second_order,
                conf_level=CONFIDENCE,
                seed=_SEED,
            )
        for i, key in enumerate(sampling.columns):
            row = {name: float(found[name][i]) for name in ("S1", "S1_conf", "ST", "ST_conf")}
            rows.append({**here, "key": key, **_with_bounds(row)})
        pairs = combinations(enumerate(sampling.columns), 2) if sampling.second_order else ()
        for (i, key), (j, other) in pairs:
            row = {name: float(found[name][i, j]) for name in ("S2", "S2_conf")}
            rows.append({**here, "key": key, "with": other, **_with_bounds(row)})
    return rows, list(notes)


def _with_bounds(row: dict[str, float]) -> dict[str, float]:
    """NaN for half widths that say nothing: of resamples that hardly vary."""
    empty = {name: np.nan for name in row if name.endswith("_conf") and row[name] > _WIDEST}
    return row | empty


def ranked_inputs(table: RunTable) -> list[str]:
    """Inputs whose values have an order: numbers that are no seeds and number no realisations."""
    sampling, done = table.sampling, table.done
    numbers = [
        name
        for name in table.inputs
        if pd.api.types.is_numeric_dtype(done[name])
        and not pd.api.types.is_bool_dtype(done[name])
        and done[name].nunique() > 1
    ]
    if sampling is None:
        return numbers
    return [
        name
        for name in numbers
        if name in sampling.keys and not isinstance(sampling.keys[name], SeedTable | ChoicesTable)
    ]


def _given_data(table: RunTable) -> tuple[list[dict[str, Any]], list[str]]:
    keys = ranked_inputs(table)
    others = [name for name in table.inputs if name not in keys]
    alike = [name for name in others if table.done[name].map(str).nunique() < 2]
    without = [name for name in others if name not in alike]
    notes: list[str] = []
    if alike:
        notes.append(f"{', '.join(alike)} without an index: no two runs differ in it")
    if without:
        notes.append(
            f"{', '.join(without)} without an index: seeds, fields and choices have one with "
            'method = "saltelli" only'
        )
    rows: list[dict[str, Any]] = []
    if not keys:
        return rows, notes
    few = False
    for here, own in table.figures():
        known = own[own[here["statistic"]].notna()]
        statistic = known[here["statistic"]]
        y = statistic.to_numpy(float)
        if len(y) < _FEWEST_RUNS:
            few = True
            continue
        if np.ptp(y) == 0.0:
            continue
        found = _rbd_fast(keys, known[keys].to_numpy(float), y)
        ranks = known[keys].rank().corrwith(statistic.rank())
        for i, key in enumerate(keys):
            row = {name: float(found[name][i]) for name in ("S1", "S1_conf")}
            rows.append({**here, "key": key, **row, "rank_correlation": float(ranks[key])})
    if few:
        notes.append(f"first-order indices need at least {_FEWEST_RUNS} runs")
    together = table.sampling.correlations if table.sampling is not None else []
    for one in together if rows else ():
        notes.append(f"the indices of {' and '.join(one.keys)} also hold what these share")
    return rows, notes


def _rbd_fast(keys: Sequence[str], x: np.ndarray, y: np.ndarray) -> Mapping[str, Any]:
    """First-order indices of inputs (n, m), by their keys, of a statistic (n,)."""
    from SALib.analyze import rbd_fast

    # SALib seeds NumPy's global generator: it is put back as it was.
    before = np.random.get_state()
    try:
        # Of a statistic that is zero in most runs all values of a resample may be the same: its
        # index, and with it the bounds, are no numbers.
        with np.errstate(divide="ignore", invalid="ignore"):
            found: Mapping[str, Any] = rbd_fast.analyze(
                salib_problem(keys),
                x,
                y,
                M=_HARMONICS[len(y) >= _MANY_RUNS],
                num_resamples=_RESAMPLES_OF_INDICES[len(y) > _MOST_RUNS],
                conf_level=CONFIDENCE,
                seed=_SEED,
            )
    finally:
        np.random.set_state(before)
    return found
