"""Filters for contact forces: 20 Hz low-pass and the bands 0-5 and 5-20 Hz, without phase shift.

Source: EN 50317 (20 Hz, Butterworth, 6th order) and EN 50318 (bands). Each filter runs forward
and backward over the record, which cancels its phase and squares its gain: at the cut-off the
gain is 1/2 (-6 dB), at frequency f of a low-pass 1 / (1 + (tan(pi f dt)/tan(pi fc dt))^12).

What `scipy.signal` does is done here by BLAS: it imports `scipy.stats`, as long as all else that a
report is made of takes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import blas

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
    edge = _warped(cut_off, dt)
    squared = edge**2
    sections = [
        _section(edge * pole, (squared, 2.0 * squared, squared)) for pole in _prototype_poles()
    ]
    return _both_ways(sections, values, dt, cut_off)


def band_0_5(values: np.ndarray, dt: float) -> np.ndarray:
    """Part of ``values`` up to 5 Hz, the mean included: a 5 Hz low-pass."""
    return low_pass(values, dt, BAND_LIMIT)


def band_5_20(values: np.ndarray, dt: float) -> np.ndarray:
    """Part of ``values`` between 5 and 20 Hz, free of the mean: a band-pass of 6th-order edges."""
    check_sampling(dt, CUT_OFF)
    low, high = _warped(BAND_LIMIT, dt), _warped(CUT_OFF, dt)
    width = high - low
    # Where s becomes (s^2 + low high) / (width s), each pole becomes two.
    centres = 0.5 * width * _prototype_poles()
    apart = np.sqrt(centres**2 - low * high)
    poles = np.concatenate([centres + apart, centres - apart])
    sections = [_section(pole, (width, 0.0, -width)) for pole in poles]
    return _both_ways(sections, values, dt, BAND_LIMIT)


class _Section(NamedTuple):
    """Two poles of a filter: y_n = b0 x_n + b1 x_(n-1) + b2 x_(n-2) - a1 y_(n-1) - a2 y_(n-2)."""

    b0: float
    b1: float
    b2: float
    a1: float
    a2: float

    @property
    def gain(self) -> float:
        """Of what is constant."""
        return (self.b0 + self.b1 + self.b2) / (1.0 + self.a1 + self.a2)

    @property
    def at_rest(self) -> tuple[float, float]:
        """What is added to the next two values after an input that was always 1."""
        second = self.b2 - self.a2 * self.gain
        return self.b1 - self.a1 * self.gain + second, second


def _warped(frequency: float, dt: float) -> float:
    """|s| of a frequency [Hz] under s = (1 - 1/z) / (1 + 1/z), the bilinear transform."""
    return float(np.tan(np.pi * frequency * dt))


def _prototype_poles() -> np.ndarray:
    """Poles (ORDER / 2,) of Butterworth's low-pass of |s| = 1 that lie above the real axis."""
    angles = np.pi * (0.5 + (np.arange(ORDER // 2) + 0.5) / ORDER)
    return np.exp(1j * angles)


def _section(pole: complex, numerator: tuple[float, float, float]) -> _Section:
    """The digital section of ``pole`` of s and its conjugate; ``numerator`` in powers of 1/z."""
    size, damping = abs(pole) ** 2, -2.0 * pole.real
    first = 1.0 + damping + size
    b0, b1, b2 = (part / first for part in numerator)
    return _Section(b0, b1, b2, 2.0 * (size - 1.0) / first, (1.0 - damping + size) / first)


def _both_ways(
    sections: list[_Section], values: np.ndarray, dt: float, slowest: float
) -> np.ndarray:
    """``values`` filtered forward and backward along the first axis, as by
    ``scipy.signal.sosfiltfilt``.

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
    for record in extended.reshape(len(extended), -1).T:
        _in_place(sections, record)
        _in_place(sections, record[::-1])
    return extended[padding : padding + n]


def _in_place(sections: list[_Section], record: np.ndarray) -> None:
    """Filter a record (n,) from the steady state of its first value on."""
    level = record[0]
    states = []
    for section in sections:
        first, second = section.at_rest
        states.append((level * first, level * second))
        level = level * section.gain
    for start in range(0, record.size, _BLOCK):
        block = record[start : start + _BLOCK]
        passed = block.copy()
        for i, section in enumerate(sections):
            passed, states[i] = _through(section, passed, states[i])
        block[:] = passed


def _through(
    section: _Section, x: np.ndarray, state: tuple[float, float]
) -> tuple[np.ndarray, tuple[float, float]]:
    """A block (n,) after a section, and what it adds to the first two values of the next block.

    The recurrence is a triangular matrix of three diagonals, which BLAS solves from the first row.
    """
    right = section.b0 * x
    right[1:] += section.b1 * x[:-1]
    right[2:] += section.b2 * x[:-2]
    right[:2] += state[: x.size]
    diagonals = np.empty((3, x.size), order="F")
    diagonals[:] = np.array([[1.0], [section.a1], [section.a2]])
    y = blas.dtbsv(2, diagonals, right, lower=1, diag=1, overwrite_x=1)
    second = section.b2 * x[-1] - section.a2 * y[-1]
    first = section.b1 * x[-1] - section.a1 * y[-1]
    if x.size > 1:
        first += section.b2 * x[-2] - section.a2 * y[-2]
    else:
        first += state[1]
    return y, (first, second)
