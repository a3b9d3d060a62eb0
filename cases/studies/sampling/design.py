"""Designs: points of the unit cube, and the rank correlation of their coordinates."""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.studies.sampling.tables import SALTELLI, SamplingTable

# No coordinate is nearer to 0 or 1: a normal quantity stays within 7 standard deviations.
_EDGE = 1e-12


def points(sampling: SamplingTable) -> np.ndarray:
    """Points of the open unit cube, one a sample, uniform and with the wanted correlation.

    Sobol points are scrambled (Owen 1998); with them, and with random ones, a larger ``n`` begins
    with the same points. Samples of ``saltelli`` stand in the order of SALib: a base sample, those
    in which one coordinate is another's, the other base sample.

    Returns
    -------
    ndarray, shape (sampling.n_samples, number of sampling.columns)
    """
    from scipy.stats import qmc

    n, d, seed = sampling.n, len(sampling.columns), sampling.seed
    if sampling.method == SALTELLI:
        from SALib.sample import sobol

        found = sobol.sample(
            problem_of(sampling.columns), n, calc_second_order=sampling.second_order, seed=seed
        )
    elif sampling.method == "sobol":
        # A power of 2 keeps the balance of the sequence, and its first points are the same.
        found = qmc.Sobol(d, seed=seed).random_base2(math.ceil(math.log2(n)))[:n]
    elif sampling.method == "latin_hypercube":
        found = qmc.LatinHypercube(d, seed=seed).random(n)
    else:
        found = np.random.default_rng(seed).random((n, d))
    found = np.clip(found, _EDGE, 1.0 - _EDGE)
    return _correlated(found, sampling) if sampling.correlations else found


def problem_of(columns: Sequence[str]) -> dict[str, object]:
    """Inputs as SALib takes them, uniform in the unit cube."""
    bounds = [[0.0, 1.0] for _ in columns]
    return {"num_vars": len(columns), "names": list(columns), "bounds": bounds}


def _correlated(uniform: np.ndarray, sampling: SamplingTable) -> np.ndarray:
    """Coordinates under a Gaussian copula.

    Normal quantities with the correlation r have the rank correlation rho = 6/pi asin(r/2)
    (Kruskal 1958, J. Am. Stat. Assoc. 53, eq. 6.3), so that r = 2 sin(pi rho/6).
    """
    from scipy.special import ndtr, ndtri

    matrix = np.eye(uniform.shape[1])
    columns = sampling.columns
    for one in sampling.correlations:
        i, j = (columns.index(key) for key in one.keys)
        matrix[i, j] = matrix[j, i] = 2.0 * math.sin(math.pi * one.rank / 6.0)
    try:
        factor = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError as error:
        raise InputError(
            "the correlations of the sampling contradict each other: no quantities have all of "
            "them (their matrix is not positive definite)"
        ) from error
    return np.clip(ndtr(ndtri(uniform) @ factor.T), _EDGE, 1.0 - _EDGE)


def normal_rows(seed: int, name: str, realisations: Sequence[int], n: int) -> np.ndarray:
    """Independent standard normal numbers, a row for each realisation.

    A row depends on seed, name and realisation only, so that the same one always comes again.

    Parameters
    ----------
    seed : of the sampling
    name : of the field
    realisations : whole numbers
    n : length of a row
    """
    # A counter-based generator (Salmon et al. 2011) is set to a key in no time.
    philox = np.random.Philox(key=0)
    generator, state = np.random.Generator(philox), philox.state
    mark = zlib.crc32(name.encode())
    rows = np.empty((len(realisations), n))
    for row, number in zip(rows, realisations, strict=True):
        state["state"]["key"][:] = (seed << 32 | mark, number)
        philox.state = state
        generator.standard_normal(out=row)
    return rows
