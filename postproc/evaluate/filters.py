"""Filters for contact forces: 20 Hz low-pass and the bands 0-5 and 5-20 Hz, without phase shift.

Source: EN 50317 (20 Hz, Butterworth, 6th order) and EN 50318 (bands). Each filter runs forward
and backward over the record, which cancels its phase and squares its gain: at the cut-off the
gain is 1/2 (-6 dB), at frequency f of a low-pass 1 / (1 + (tan(pi f dt)/tan(pi fc dt))^12).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.linalg.lapack import dtbtrs

from catenary.base.errors import InputError

CUT_OFF = 20.0
BAND_LIMIT = 5.0
ORDER = 6
# The slowest pole of the 6th-order low-pass decays with sin(pi/12) 2 pi fc, thus to 1e-4 in
# 5.7 / fc; the record is continued by that much at both ends before it is filtered.
_PADDING_PERIODS = 6.0
# Rows that are filtered at once.
_BLOCK = 1 << 16


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
    values : (n,) or (n, columns), equidistant in time, the whole record
    dt : time between two records [s]
    cut_off : where the gain is 1/2 [Hz]

    Raises
    ------
    InputError
        If the record is sampled at no more than twice the cut-off.
    """
    check_sampling(dt, cut_off)
    return _both_ways(_sections((cut_off,), dt), values, dt, cut_off)


def band_0_5(values: np.ndarray, dt: float) -> np.ndarray:
    """Part of ``values`` up to 5 Hz, the mean included: a 5 Hz low-pass."""
    return low_pass(values, dt, BAND_LIMIT)


def band_5_20(values: np.ndarray, dt: float) -> np.ndarray:
    """Part of ``values`` between 5 and 20 Hz, free of the mean: a band-pass of 6th-order edges."""
    check_sampling(dt, CUT_OFF)
    sections = _sections((BAND_LIMIT, CUT_OFF), dt)
    return _both_ways(sections, values, dt, BAND_LIMIT)


@lru_cache(maxsize=64)
def _sections(edges: tuple[float, ...], dt: float) -> np.ndarray:
    """Second-order sections (n, 6) of a Butterworth filter: b0, b1, b2, 1, a1, a2 of each.

    A low-pass with one edge [Hz], a band-pass with two. By the bilinear transform of the analogue
    prototype (Oppenheim & Schafer, Discrete-Time Signal Processing, 7.1). Written here because
    ``scipy.signal`` loads ``scipy.stats``, which takes longer than all other modules of a run.
    """
    warped = np.tan(np.pi * np.array(edges) * dt)
    prototype = np.exp(0.5j * np.pi * (1.0 + (2.0 * np.arange(ORDER) + 1.0) / ORDER))
    if len(edges) == 1:
        poles, zeros, middle = warped[0] * prototype, (1.0, 2.0, 1.0), 1.0 + 0.0j
    else:
        half, squared = 0.5 * (warped[1] - warped[0]) * prototype, warped[0] * warped[1]
        root = np.sqrt(half**2 - squared)
        poles, zeros = np.concatenate([half + root, half - root]), (1.0, 0.0, -1.0)
        middle = (1.0 + 1j * np.sqrt(squared)) / (1.0 - 1j * np.sqrt(squared))
    at = (1.0 + poles) / (1.0 - poles)
    at = at[at.imag > 0.0]  # the other ones are their conjugates
    below = np.stack([np.ones(at.size), -2.0 * at.real, np.abs(at) ** 2], axis=1)
    # In the middle of what passes each section has the gain 1.
    powers = middle ** np.array([2, 1, 0])
    gain = np.abs(below @ powers) / np.abs(zeros @ powers)
    return np.hstack([gain[:, None] * zeros, below])


def _both_ways(sos: np.ndarray, values: np.ndarray, dt: float, slowest: float) -> np.ndarray:
    """Like ``scipy.signal.sosfiltfilt`` along the first axis.

    It takes the memory of one more record, not of five: a record is filtered in place, in blocks,
    each of which goes on from the state that the one before has left.
    """
    values = np.asarray(values, dtype=float)
    n = values.shape[0]
    if n == 0:
        return values.copy()
    padding = min(n - 1, int(np.ceil(_PADDING_PERIODS / (slowest * dt))))
    # Continued at both ends by the record itself, turned about its end points.
    extended = np.empty((n + 2 * padding, *values.shape[1:]))
    extended[padding : padding + n] = values
    if padding:
        extended[:padding] = 2.0 * values[:1] - values[padding:0:-1]
        extended[padding + n :] = 2.0 * values[-1:] - values[-2 : -padding - 2 : -1]
    _in_place(sos, extended)
    _in_place(sos, extended[::-1])
    return extended[padding : padding + n]


def _in_place(sos: np.ndarray, record: np.ndarray) -> None:
    """Filter a record along its first axis, from the steady state of its first value on."""
    # The last two rows before each section, and behind the last one.
    before = [np.stack([record[0], record[0]])]
    for section in sos:
        before.append(before[-1] * (section[:3].sum() / section[3:].sum()))
    for start in range(0, record.shape[0], _BLOCK):
        block = record[start : start + _BLOCK]
        x = np.concatenate([before[0], block])
        for k, section in enumerate(sos):
            y = _passed(section, x, before[k + 1])
            before[k] = x[-2:].copy()
            x = y
        before[-1] = x[-2:].copy()
        block[:] = x[2:]


def _passed(section: np.ndarray, x: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Output of a section, y_n = b0 x_n + b1 x_n-1 + b2 x_n-2 - a1 y_n-1 - a2 y_n-2.

    It is a triangular system of three bands.

    Parameters
    ----------
    x : (n + 2, ...) input
    before : (2, ...) the first two rows of the output
    """
    b0, b1, b2, _, a1, a2 = section
    y = np.empty_like(x)
    y[:2] = before
    np.multiply(x[2:], b0, out=y[2:])
    for factor, earlier in ((b1, x[1:-1]), (b2, x[:-2])):
        if factor:
            y[2:] += factor * earlier
    y[2] -= a1 * before[1] + a2 * before[0]
    y[3:4] -= a2 * before[1]
    bands = np.tile(section[3:], (len(x) - 2, 1)).T
    y[2:], _ = dtbtrs(bands, y[2:], uplo="L", diag="U")
    return y
