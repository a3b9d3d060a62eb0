"""Butterworth filters in sections of second order, and records filtered by them.

``scipy.signal`` has both, and takes 0.15 s of processor time to load, as much as everything else of
a summary: it brings ``scipy.stats`` along. The tests compare with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack


class Sections(NamedTuple):
    """Sections one after another: numerators and denominators (n, 3) in powers of 1/z, the latter
    beginning with 1."""

    numerators: np.ndarray
    denominators: np.ndarray


def low_pass(order: int, cut_off: float, dt: float) -> Sections:
    """A low-pass of even order at a step ``dt`` [s], with gain 1/sqrt(2) at ``cut_off`` [Hz]."""
    return _sections(_warped(cut_off, dt) * _prototype(order), dt, (1.0, 2.0, 1.0), 0.0)


def band_pass(order: int, edges: tuple[float, float], dt: float) -> Sections:
    """A band-pass between two edges [Hz], where its gain is 1/sqrt(2), at a step ``dt`` [s].

    ``order`` is that of the low-pass from which it is made, and even.
    """
    low, high = (_warped(edge, dt) for edge in edges)
    # Each pole p of the low-pass becomes both solutions s of s^2 - (high - low) p s + low high = 0.
    half = 0.5 * (high - low) * _prototype(order)
    root = np.sqrt(half**2 - low * high)
    middle = 2.0 * np.arctan(0.5 * dt * np.sqrt(low * high))
    return _sections(np.concatenate([half + root, half - root]), dt, (1.0, 0.0, -1.0), middle)


def filter_in_place(sections: Sections, record: np.ndarray, block: int) -> None:
    """Filter a record (n, ...) along its first axis, as if its first value had always been there.

    Parameters
    ----------
    block : rows that are filtered at once
    """
    rows = record.reshape(record.shape[0], -1)  # a view: only the first axis may be turned about
    size = min(block, rows.shape[0])
    # What has always been there passes as it is; without it round-off is smaller.
    first = rows[:1].copy()
    rows -= first
    gain = 1.0
    for numerator, denominator in zip(*sections, strict=True):
        gain *= numerator.sum() / denominator.sum()
        bands = np.repeat(denominator[:, None], size, axis=1)
        # The two values before a block, of what comes in and of what goes out.
        come = gone = np.zeros((2, rows.shape[1]))
        for start in range(0, rows.shape[0], block):
            part = rows[start : start + block]
            padded = np.concatenate([come, part])
            right = sum(numerator[k] * padded[2 - k : padded.shape[0] - k] for k in range(3))
            right[:1] -= denominator[1] * gone[1] + denominator[2] * gone[0]
            right[1:2] -= denominator[2] * gone[1]
            # The recursion is a triangular system with two bands below its diagonal of ones.
            result, _ = lapack.dtbtrs(bands[:, : len(part)], right, uplo="L", diag="U")
            come = padded[-2:].copy()
            gone = np.concatenate([gone, result])[-2:]
            part[:] = result
    rows += gain * first


def _prototype(order: int) -> np.ndarray:
    """Poles of the low-pass of cut-off 1 rad/s, one of each conjugate pair."""
    return np.exp(0.5j * np.pi * (2.0 * np.arange(order // 2) + order + 1.0) / order)


def _warped(frequency: float, dt: float) -> float:
    """Frequency [rad/s] that the bilinear transform takes to ``frequency`` [Hz]."""
    return float(2.0 / dt * np.tan(np.pi * frequency * dt))


def _sections(
    poles: np.ndarray, dt: float, numerator: tuple[float, float, float], unit_gain_at: float
) -> Sections:
    """Sections of these poles and their conjugates by the bilinear transform.

    Parameters
    ----------
    numerator : of each section, but for a factor
    unit_gain_at : angle on the unit circle where the gain of each section is 1
    """
    z = (2.0 / dt + poles) / (2.0 / dt - poles)
    denominators = np.column_stack([np.ones(z.size), -2.0 * z.real, np.abs(z) ** 2])
    powers = np.exp(-1j * unit_gain_at * np.arange(3))
    gain = np.abs(denominators @ powers) / np.abs(np.dot(numerator, powers))
    return Sections(gain[:, None] * np.array(numerator), denominators)
