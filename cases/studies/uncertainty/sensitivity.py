"""Sensitivity indices by SALib, from Saltelli's samples or from any table."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd

from catenary.cases.studies.sampling.design import problem_of
from catenary.cases.studies.sampling.distributions import ChoicesTable, SeedTable
from catenary.cases.studies.sampling.samples import sample_name
from catenary.cases.studies.sampling.tables import SALTELLI, SamplingTable
from catenary.cases.studies.uncertainty.estimates import CONFIDENCE
from catenary.cases.studies.uncertainty.run_table import RunTable

SOBOL = "Sobol indices (Saltelli et al. 2010; Jansen's total-order index)"
GIVEN_DATA = (
    "first-order indices from given data (RBD-FAST with the correction of Tissot and Prieur)"
)
_SEED = 1  # of resamples
# Fewer runs leave no harmonics to tell from noise, in half of which bounds are estimated.
_FEWEST, _MANY = 100, 500
_HARMONICS = 4, 10
# Resamples for bounds, of up to _MOST runs and of more: those have small bounds, at a greater cost.
_RESAMPLES, _MOST = (100, 25), 5000
# Half width beyond which a bound of an index, a number from 0 to 1, is none.
_WIDEST = 10.0


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
    for statistic in table.statistics:
        for pantograph, own in table.of(statistic).items():
            y = own.set_index("variant")[statistic].reindex(names).to_numpy(float)
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
                    problem_of(sampling.columns),
                    whole.ravel(),
                    calc_second_order=sampling.second_order,
                    conf_level=CONFIDENCE,
                    seed=_SEED,
                )
            here = {"statistic": statistic, "pantograph": pantograph}
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
    for statistic in table.statistics:
        for pantograph, own in table.of(statistic).items():
            known = own[own[statistic].notna()]
            y = known[statistic].to_numpy(float)
            if len(y) < _FEWEST:
                few = True
                continue
            if np.ptp(y) == 0.0:
                continue
            x = known[keys].to_numpy(float)
            found = _rbd_fast(keys, x, y)
            ranks = known[keys].rank().corrwith(known[statistic].rank())
            here = {"statistic": statistic, "pantograph": pantograph}
            for i, key in enumerate(keys):
                row = {name: float(found[name][i]) for name in ("S1", "S1_conf")}
                rows.append({**here, "key": key, **row, "rank_correlation": float(ranks[key])})
    if few:
        notes.append(f"first-order indices need at least {_FEWEST} runs")
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
                problem_of(keys),
                x,
                y,
                M=_HARMONICS[len(y) >= _MANY],
                num_resamples=_RESAMPLES[len(y) > _MOST],
                conf_level=CONFIDENCE,
                seed=_SEED,
            )
    finally:
        np.random.set_state(before)
    return found
