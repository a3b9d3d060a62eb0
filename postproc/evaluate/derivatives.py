"""Derivatives of the statistics of a contact force and of an uplift by parameters.

With the filtered force F of n records and its derivative F' by a parameter, which is filtered in
the same way as filters are linear,

    mean' = mean(F'),    sigma' = mean((F - mean) (F' - mean')) / sigma,

and an extreme changes as the record in which it stands.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.postproc.evaluate import filters

# Standard deviations from the mean to statistical extremes.
_STATISTICAL = 3.0


class ForceDerivatives(NamedTuple):
    """Derivatives (m,) by m parameters of the statistics of a contact force [N], named as in
    ``PantographStatistics``."""

    mean: np.ndarray
    std: np.ndarray
    maximum: np.ndarray
    minimum: np.ndarray
    stat_max: np.ndarray
    stat_min: np.ndarray


def of_force(
    force: np.ndarray,
    by_force: np.ndarray,
    within: np.ndarray,
    dt: float,
    by_place: np.ndarray | None = None,
) -> ForceDerivatives:
    """Derivatives of the statistics of a contact force. Not collective.

    Parameters
    ----------
    force : ndarray, shape (n,)
        Force of all records [N].
    by_force : ndarray, shape (n, m)
        Its derivatives by m parameters.
    within : ndarray, shape (n,), dtype bool
        Records in the evaluated stretch.
    dt : float
        Time between two records [s].
    by_place : ndarray, shape (n, m), optional
        Derivatives of the pantograph's position over the train's speed [s], where
        parameters change either: the stretch stays, so that records are compared at equal
        places.

    Raises
    ------
    InputError
        If the records are too far apart for the 20 Hz filter.
    """
    filtered = filters.low_pass(force, dt)
    changes = filters.low_pass(by_force, dt)
    if by_place is not None and by_place.any():
        changes = changes - _slope(filtered, dt)[:, None] * by_place
    filtered, changes = filtered[within], changes[within]
    mean, std = changes.mean(axis=0), filtered.std()
    about = filtered - filtered.mean()
    by_std = about @ (changes - mean) / (filtered.size * std) if std > 0.0 else np.zeros(mean.size)
    return ForceDerivatives(
        mean,
        by_std,
        changes[int(np.argmax(filtered))],
        changes[int(np.argmin(filtered))],
        mean + _STATISTICAL * by_std,
        mean - _STATISTICAL * by_std,
    )


def of_largest(values: np.ndarray, by_values: np.ndarray) -> np.ndarray:
    """Derivatives (m,) of the largest of ``values`` (n, k), whose own are ``by_values`` (n, m, k);
    NaN if there are none."""
    if not values.size:
        return np.full(by_values.shape[1], np.nan)
    record, column = np.unravel_index(int(np.argmax(values)), values.shape)
    return np.asarray(by_values[record, :, column])


def _slope(values: np.ndarray, dt: float) -> np.ndarray:
    """Rate of change of records, by differences of the fourth order, of the second at both ends."""
    slope = np.gradient(values, dt)
    if values.size > 4:
        inner = 8.0 * (values[3:-1] - values[1:-3]) - (values[4:] - values[:-4])
        slope[2:-2] = inner / (12.0 * dt)
    return np.asarray(slope)
