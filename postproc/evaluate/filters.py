"""Filters for contact forces: 20 Hz low-pass and the bands 0-5 and 5-20 Hz, without phase shift.

Source: EN 50317 (20 Hz, Butterworth, 6th order) and EN 50318 (bands). Each filter runs forward
and backward over the record, which cancels its phase and squares its gain: at the cut-off the
gain is 1/2 (-6 dB), at frequency f of a low-pass 1 / (1 + (tan(pi f dt)/tan(pi fc dt))^12).
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from scipy import signal
from scipy.integrate import trapezoid

from catenary.base.errors import InputError

if TYPE_CHECKING:
    from catenary.postproc.read.results import Results

CUT_OFF = 20.0
# A filter leaves 1e-4 of what is beyond a record's end after so many periods of its cut-off: the
# slowest pole decays with sin(pi/12) 2 pi fc. By as much a record is continued at both ends.
SETTLED = 6.0
BAND_LIMIT = 5.0
ORDER = 6
# The filter of contact forces, for files that hold some.
ABOUT = {
    "filter": "low-pass of EN 50317: Butterworth, forward and backward, gain 1/2 at the cut-off",
    "cut_off_Hz": CUT_OFF,
    "order": ORDER,
}
# Frequencies up to so many cut-offs, where the gain is 1e-7, in so many intervals a cut-off.
_UP_TO, _INTERVALS = 4, 500


def check_sampling(dt: float, cut_off: float = CUT_OFF) -> None:
    """Raise InputError if a time step ``dt`` [s] is too long for a filter at ``cut_off`` [Hz]."""
    if 1.0 / dt <= 2.0 * cut_off:
        raise InputError(
            f"numerics.dt_s = {dt:g} s records at {1.0 / dt:.4g} Hz, too slowly for the "
            f"{cut_off:g} Hz filter of the contact force: it must be below {0.5 / cut_off:g} s"
        )


def low_pass(values: np.ndarray, dt: float, cut_off: float = CUT_OFF) -> np.ndarray:
    """``values`` without what is faster than ``cut_off``, shape as ``values``. Not collective.

    Parameters
    ----------
    values : ndarray, shape (n,) or (n, columns)
        Whole record, equidistant in time.
    dt : float
        Time between two records [s].
    cut_off : float, optional
        Frequency at which the gain is 1/2 [Hz].

    Raises
    ------
    InputError
        If the record is sampled at no more than twice the cut-off.
    """
    check_sampling(dt, cut_off)
    return _both_ways(_sections("low", (cut_off,), dt), values, dt, cut_off)


def contact_force(results: Results, index: int) -> np.ndarray:
    """Contact force of a pantograph below 20 Hz, (n,) [N], as the file has it. Not collective.

    It is filtered anew where the file has none, such as that of a run that is not done; the digits
    are the same.

    Parameters
    ----------
    results : Results
        Results of the run.
    index : int
        Number of the pantograph, from zero.

    Raises
    ------
    InputError
        If the time step is too long for the filter.
    """
    stored = results.stored_filtered_force(index)
    if stored is not None and stored[1] == ABOUT:
        return stored[0]
    return low_pass(results.column("contact_force", index), results.dt)


def band_0_5(values: np.ndarray, dt: float) -> np.ndarray:
    """Part of ``values``, ``dt`` [s] apart, up to 5 Hz, the mean included: a 5 Hz low-pass."""
    return low_pass(values, dt, BAND_LIMIT)


def band_5_20(values: np.ndarray, dt: float) -> np.ndarray:
    """Part of ``values``, ``dt`` [s] apart, between 5 and 20 Hz, free of the mean: a band-pass of
    6th-order edges."""
    check_sampling(dt, CUT_OFF)
    sections = _sections("bandpass", (BAND_LIMIT, CUT_OFF), dt)
    return _both_ways(sections, values, dt, BAND_LIMIT)


def kept_variance(cut_off: float, dt: float) -> float:
    """Part of the variance of independent samples, ``dt`` [s] apart, that the low-pass at
    ``cut_off`` [Hz] leaves."""
    frequency, gain_squared = power_kept(cut_off, dt)
    return float(2.0 * dt * trapezoid(gain_squared, frequency))


def power_kept(cut_off: float, dt: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (n,) [Hz], and the power that ``low_pass`` leaves of each.

    Parameters
    ----------
    cut_off : float
        Frequency at which the gain is 1/2 [Hz].
    dt : float or None
        Time between the samples that are filtered [s]; None if they are very dense.
    """
    most = _UP_TO * cut_off if dt is None else min(_UP_TO * cut_off, 0.5 / dt * (1.0 - 1e-9))
    frequency = np.linspace(0.0, most, _UP_TO * _INTERVALS + 1)
    if dt is None:
        ratio = frequency / cut_off
    else:
        ratio = np.tan(np.pi * frequency * dt) / np.tan(np.pi * cut_off * dt)
    return frequency, 1.0 / (1.0 + ratio ** (2 * ORDER)) ** 2


@lru_cache(maxsize=64)
def _sections(kind: str, edges: tuple[float, ...], dt: float) -> np.ndarray:
    """Second-order sections of a filter; cached, as sweeps use it in each run."""
    found = signal.butter(ORDER, np.squeeze(edges), btype=kind, fs=1.0 / dt, output="sos")
    return np.asarray(found)


def _both_ways(sections: np.ndarray, values: np.ndarray, dt: float, slowest: float) -> np.ndarray:
    """Values filtered along the first axis, continued at both ends as they are turned about their
    end points."""
    values = np.asarray(values, dtype=float)
    if not len(values):
        return values.copy()
    padding = min(len(values) - 1, int(np.ceil(SETTLED / (slowest * dt))))

    def filtered(column: np.ndarray) -> np.ndarray:
        return np.asarray(signal.sosfiltfilt(sections, column, padlen=padding))

    # One column after the other: SciPy's filter needs three times the memory of what it filters.
    return np.apply_along_axis(filtered, 0, values)
