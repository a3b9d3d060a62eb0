"""Evaluation of a table of runs of a line with uncertain keys."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from catenary.cases.studies.sampling.samples import sample_name
from catenary.cases.studies.sampling.tables import SALTELLI, SamplingTable
from catenary.cases.studies.uncertainty.estimates import (
    QUANTILES,
    deviation,
    mean,
    named,
    quantile,
    share,
)
from catenary.cases.studies.uncertainty.run_table import DONE, RunTable
from catenary.cases.studies.uncertainty.sensitivity import indices
from catenary.postproc.evaluate.wording import counted

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
    sensitivity : rows of ``sensitivity.indices``
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
    for name in table.statistics:
        for pantograph, rows in independent.of(name).items():
            x = rows[name].dropna().to_numpy(float)
            if len(x) < 2:
                continue
            here = {"statistic": name, "pantograph": pantograph, "n": len(x)}
            ends = {"minimum": float(x.min()), "maximum": float(x.max())}
            estimated = named("mean", mean(x)) | named("standard_deviation", deviation(x)) | ends
            statistics.append({**here, **estimated})
            quantiles += [
                {**here, "probability": p, **named("value", quantile(x, p))} for p in QUANTILES
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
    kept = table.frame["variant"].isin(base_samples(sampling))
    return table._replace(frame=table.frame[kept])


def base_samples(sampling: SamplingTable) -> set[str]:
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
    return {**head, **named("probability", share(failed, n))}
