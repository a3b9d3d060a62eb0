"""Filters for contact forces: 20 Hz low-pass and the bands 0-5 and 5-20 Hz, without phase shift.

Source: EN 50317 (20 Hz, Butterworth, 6th order) and EN 50318 (bands). Each filter runs forward
and backward over the record, which cancels its phase and squares its gain: at the cut-off the
gain is 1/2 (-6 dB), at frequency f of a low-pass 1 / (1 + (tan(pi f dt)/tan(pi fc dt))^12).

The filters are ``scipy.signal.butter`` and ``sosfiltfilt``, to rounding. That package, with which
SciPy's statistics load, takes longer to import than a report takes to evaluate.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg.blas import dtbsv

from catenary.solver.base.errors import InputError

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
    return _both_ways(_low_pass_sections(cut_off * dt), values, dt, cut_off)


def band_0_5(values: np.ndarray, dt: float) -> np.ndarray:
    """Part of ``values`` up to 5 Hz, the mean included: a 5 Hz low-pass."""
    return low_pass(values, dt, BAND_LIMIT)


def band_5_20(values: np.ndarray, dt: float) -> np.ndarray:
    """Part of ``values`` between 5 and 20 Hz, free of the mean: a band-pass of 6th-order edges."""
    check_sampling(dt, CUT_OFF)
    sections = _band_pass_sections(BAND_LIMIT * dt, CUT_OFF * dt)
    return _both_ways(sections, values, dt, BAND_LIMIT)


class _Section(NamedTuple):
    """Second-order section: (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2)."""

    b0: float
    b1: float
    b2: float
    a1: float
    a2: float

    def at(self, z: complex) -> complex:
        """Its transfer function."""
        above = self.b0 + self.b1 / z + self.b2 / z**2
        return above / (1.0 + self.a1 / z + self.a2 / z**2)


def _prototype() -> np.ndarray:
    """Poles of the analogue Butterworth low-pass for 1 rad/s in the upper half plane."""
    k = np.arange(ORDER // 2)
    return np.exp(1j * np.pi * (2 * k + ORDER + 1) / (2 * ORDER))


def _sections(
    poles: np.ndarray, zeros: tuple[float, float, float], passed: complex
) -> tuple[_Section, ...]:
    """Sections of analogue ``poles`` and their conjugates by the bilinear transform, s = (z - 1) /
    (z + 1), with the numerator ``zeros`` each and a gain of 1 at z = ``passed``."""
    found = []
    for pole in (1.0 + poles) / (1.0 - poles):
        below = -2.0 * float(pole.real), float(abs(pole)) ** 2
        section = _Section(*zeros, *below)
        b0, b1, b2 = (zero / abs(section.at(passed)) for zero in zeros)
        found.append(section._replace(b0=b0, b1=b1, b2=b2))
    return tuple(found)


@lru_cache(maxsize=16)
def _low_pass_sections(cut_off: float) -> tuple[_Section, ...]:
    """The low-pass for a cut-off in cycles a record."""
    return _sections(np.tan(np.pi * cut_off) * _prototype(), (1.0, 2.0, 1.0), 1.0)


@lru_cache(maxsize=16)
def _band_pass_sections(low: float, high: float) -> tuple[_Section, ...]:
    """The band-pass for edges in cycles a record."""
    below, above = np.tan(np.pi * low), np.tan(np.pi * high)
    half = 0.5 * (above - below) * _prototype()
    root = np.sqrt(half**2 - below * above)
    both = np.concatenate([half + root, half - root])
    middle = 1j * np.sqrt(below * above)
    # Of each pair of conjugates the pole in the upper half plane.
    return _sections(both.real + 1j * abs(both.imag), (1.0, 0.0, -1.0), (1 + middle) / (1 - middle))


def _both_ways(
    sections: tuple[_Section, ...], values: np.ndarray, dt: float, slowest: float
) -> np.ndarray:
    """``values`` filtered forward and backward along the first axis.

    It takes the memory of one more record: a record is filtered in place, in blocks, each of which
    goes on from the state that the one before has left.
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
    columns = extended.reshape(len(extended), -1)
    for column in range(columns.shape[1]):
        _in_place(sections, columns[:, column])
        _in_place(sections, columns[::-1, column])
    return extended[padding : padding + n]


def _in_place(sections: tuple[_Section, ...], record: np.ndarray) -> None:
    """Filter a record (n,) from the steady state of its first value on."""
    level = float(record[0])
    bands, states = [], []
    rows = min(record.size, _BLOCK)
    for section in sections:
        # y[n] + a1 y[n-1] + a2 y[n-2] = x is a banded triangular system; BLAS solves it.
        band = np.empty((3, rows), order="F")
        band[0], band[1], band[2] = 1.0, section.a1, section.a2
        bands.append(band)
        passed = level * section.at(1.0).real
        states.append((level, level, passed, passed))
        level = passed
    for start in range(0, record.size, _BLOCK):
        block = np.ascontiguousarray(record[start : start + _BLOCK])
        for number, (section, band) in enumerate(zip(sections, bands, strict=True)):
            block, states[number] = _filtered(section, band[:, : block.size], block, states[number])
        record[start : start + _BLOCK] = block


def _filtered(
    section: _Section, band: np.ndarray, x: np.ndarray, state: tuple[float, float, float, float]
) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """A block (n,) behind a section, and the last two values before and behind it."""
    x1, x2, y1, y2 = state  # the last values and those before them
    before = np.concatenate([[x2, x1], x])
    right = section.b0 * x + section.b1 * before[1:-1] + section.b2 * before[:-2]
    right[0] -= section.a1 * y1 + section.a2 * y2
    if x.size > 1:
        right[1] -= section.a2 * y1
    y = dtbsv(2, band, right, lower=1, diag=1, overwrite_x=1)
    behind = np.concatenate([[y2, y1], y[-2:]])
    return y, (float(before[-1]), float(before[-2]), float(behind[-1]), float(behind[-2]))
