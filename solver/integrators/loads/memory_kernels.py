"""Sums over the past as compiled loops take them; see ``end_memory``. Not collective."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.solver.base.kernels.compiled import called, compiled

# Lags below this are summed one by one; a power of two.
NEAR = 128
# Columns of the table of ends.
_WIDTH, _STEPS, _LEVELS, _PAST, _SUMS, _NEAR, _SPECTRA = range(7)

# ends (e, 7) int, of each: m, n steps, levels, and where its past, sums, near numbers and spectra
# begin; time steps (e,) and done steps (e,); past, sums, near, spectra; room, and turns of the
# largest transform
Tables = tuple[np.ndarray, Any, np.ndarray, np.ndarray, np.ndarray, np.ndarray, Any]


def tables_of(ends: list[tuple[np.ndarray, float]]) -> Tables:
    """Tables of ends with numbers Q (n, m, m) of all lags, and the time step [s] of each.

    Rows of components follow each other in the past (m, n) and in the sums (m, n). Near numbers (m,
    m, NEAR) are those of lags from zero on. Spectra are those of two rows of Q as one
    complex one, (m / 2, m, 2 L) for each L.
    """
    table = np.zeros((len(ends), 7), dtype=np.int64)
    near, spectra = [np.zeros(0)], [np.zeros(0, dtype=complex)]
    sizes = np.zeros(4, dtype=np.int64)
    largest = max((_levels_of(numbers.shape[0]) for numbers, _ in ends), default=0)
    longest = NEAR << max(largest - 1, 0)
    turns = np.ones(2 * longest, dtype=complex)
    half = 1
    while half <= longest:
        turns[half : 2 * half] = np.exp(-1j * np.pi * np.arange(half) / half)
        half *= 2
    widest = 0
    for e, (numbers, _) in enumerate(ends):
        n, m, _ = numbers.shape
        levels = _levels_of(n)
        widest = max(widest, m)
        table[e] = m, n, levels, *sizes
        padded = np.zeros((NEAR << levels, m, m))
        padded[: min(n, NEAR << levels)] = numbers[: NEAR << levels]
        padded[0] = 0.0
        near.append(padded[:NEAR].transpose(1, 2, 0).ravel())
        size = 0
        for level in range(levels):
            length = NEAR << level
            part = np.zeros((m, m, 2 * length))
            part[:, :, :length] = padded[length : 2 * length].transpose(1, 2, 0)
            paired = part[0::2].astype(complex)
            paired[: m // 2] += 1j * part[1::2]
            for row in paired.reshape(-1, 2 * length):
                _forth(row, turns)
            # The transform back is divided here.
            spectra.append(paired.ravel() / (2 * length))
            size += paired.size
        sizes += (m * n, m * n, near[-1].size, size)
    room = np.zeros((widest + 1, turns.size), dtype=complex)
    return (
        table,
        (np.array([dt for _, dt in ends], dtype=float), np.zeros(len(ends), dtype=np.int64)),
        np.zeros(sizes[0]),
        np.zeros(sizes[1]),
        np.concatenate(near),
        np.concatenate(spectra),
        (room, turns),
    )


def _levels_of(n: int) -> int:
    """Doubles of NEAR, itself included, that are lags of n steps."""
    levels = 0
    while NEAR << levels < n:
        levels += 1
    return levels


@compiled
def remember(clock, values, places, accelerations, tables):
    """Add the forces of all ends at the time ``clock[0]`` [s] to ``values``.

    The accelerations are those of the step before; a step that is repeated remembers them once.

    Parameters
    ----------
    places : of all ends' unknowns in ``values``, and in the accelerations
    accelerations : latest, known, and shares (2,) of both in those that balance the forces
    """
    into, own = places
    latest, known, shares = accelerations
    ends, (steps, done), past, sums, _, _, _ = tables
    first = 0
    for e in range(steps.size):
        m, n = ends[e, _WIDTH], ends[e, _STEPS]
        step = int(np.round(clock[0] / steps[e]))
        at, to = ends[e, _PAST], ends[e, _SUMS]
        if step > done[e]:
            if step <= n:
                for i in range(m):
                    place = own[first + i]
                    value = shares[0] * latest[place] + shares[1] * known[place]
                    past[at + i * n + step - 1] = value
                fold(tables, e, step)
            done[e] = step
        if step < n:
            for i in range(m):
                values[into[first + i]] -= sums[to + i * n + step]
        first += m


@compiled
def recall(tables, n_steps):
    """Make up for ``n_steps`` whose accelerations are in the past, and for none after these."""
    ends, (steps, done), _, sums, _, _, _ = tables
    sums[:] = 0.0
    for e in range(steps.size):
        for step in range(1, min(n_steps, ends[e, _STEPS]) + 1):
            fold(tables, e, step)
        done[e] = n_steps


@called
def fold(tables, e, step):
    """Add what the last step before ``step`` does by near lags, and blocks of steps that end there
    by far ones, to the sums of those to come."""
    ends, _, past, sums, near, spectra, (room, turns) = tables
    m, n, levels = ends[e, _WIDTH], ends[e, _STEPS], ends[e, _LEVELS]
    at, to, begin = ends[e, _PAST], ends[e, _SUMS], ends[e, _SPECTRA]
    coming = min(NEAR - 1, n - step)
    for i in range(m):
        into = sums[to + i * n + step : to + i * n + step + coming]
        for j in range(m):
            latest = past[at + j * n + step - 1]
            row = ends[e, _NEAR] + (i * m + j) * NEAR + 1
            numbers = near[row : row + coming]
            for k in range(coming):
                into[k] += numbers[k] * latest
    length = NEAR
    for _ in range(levels):
        if step % length:
            return
        size = 2 * length
        for j in range(m):
            row = room[j, :size]
            source = at + j * n + step - length
            for k in range(length):
                row[k] = past[source + k]
                row[length + k] = 0.0
            _forth(row, turns)
        both = room[m, :size]
        coming = min(size, n - step)
        for pair in range((m + 1) // 2):
            both[:] = 0.0
            for j in range(m):
                place = begin + (pair * m + j) * size
                spectrum, row = spectra[place : place + size], room[j, :size]
                for k in range(size):
                    both[k] += spectrum[k] * row[k]
            _back(both, turns)
            target = to + 2 * pair * n + step
            for k in range(coming):
                sums[target + k] += both[k].real
            if 2 * pair + 1 < m:
                for k in range(coming):
                    sums[target + n + k] += both[k].imag
        begin += (m + 1) // 2 * m * size
        length = size


@compiled
def _forth(values, turns):
    """Fourier transform in place, numbers in the order of reversed bits; the length is a power of
    two up to the length of ``turns``, which hold exp(-i pi k / h) at h + k for each power h."""
    half = values.size // 2
    while half >= 1:
        turn = turns[half : 2 * half]
        for start in range(0, values.size, 2 * half):
            near, far = values[start : start + half], values[start + half : start + 2 * half]
            for k in range(half):
                first, second = near[k], far[k]
                near[k] = first + second
                far[k] = (first - second) * turn[k]
        half //= 2


@called
def _back(values, turns):
    """From what ``_forth`` leaves back to the numbers, times their count."""
    half = 1
    while 2 * half <= values.size:
        turn = turns[half : 2 * half]
        for start in range(0, values.size, 2 * half):
            near, far = values[start : start + half], values[start + half : start + 2 * half]
            for k in range(half):
                first, second = near[k], far[k] * turn[k].conjugate()
                near[k] = first + second
                far[k] = first - second
        half *= 2
