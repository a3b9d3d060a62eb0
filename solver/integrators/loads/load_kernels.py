"""Loads in time as compiled loops evaluate them, on what a rank solves for. Not collective."""

from __future__ import annotations

import numpy as np

from catenary.solver.base.kernels.compiled import addressed, called, compiled
from catenary.solver.base.kernels.pointers import held_at
from catenary.solver.integrators.loads.memory_kernels import remember
from catenary.solver.model.loads import CONSTANT, TABLE


@called
def factor_at(time, kind, numbers):
    """The function of time that ``TimeFunction`` holds."""
    if kind == CONSTANT:
        return numbers[0]
    if kind == TABLE:
        n = numbers.size // 2
        times, values = numbers[:n], numbers[n:]
        if time <= times[0]:
            return values[0]
        if time >= times[n - 1]:
            return values[n - 1]
        i = np.searchsorted(times, time)
        share = (time - times[i - 1]) / (times[i] - times[i - 1])
        return (1.0 - share) * values[i - 1] + share * values[i]
    total = numbers[0]
    for i in range(1, numbers.size, 3):
        total += numbers[i + 1] * np.cos(numbers[i] * time + numbers[i + 2])
    return total


@called
def add_samples(time, sampled, values):
    """Add what is linear in time between slices; ``sampled`` as in ``evaluate``."""
    bounds, held, times, places, samples = sampled
    for s in range(held.size):
        first, last, begin, at = bounds[s]
        n, own = last - first, times[begin : begin + held[s]]
        i = max(0, np.searchsorted(own, time, side="right") - 1)
        here = samples[at + i * n : at + (i + 1) * n]
        if i + 1 == held[s] or own[i] >= time:
            for j in range(n):
                values[places[first + j]] += here[j]
            continue
        share = (time - own[i]) / (own[i + 1] - own[i])
        then = samples[at + (i + 1) * n : at + (i + 2) * n]
        for j in range(n):
            values[places[first + j]] += (1.0 - share) * here[j] + share * then[j]


@compiled
def evaluate(clock, values, constant, changing, shapes, functions, sampled, memories):
    """Make ``values`` those at the time ``clock[0]`` [s].

    Parameters
    ----------
    constant : what stays, as ``values``
    changing : (m,) places of what changes
    shapes : rows of a sparse matrix, of those places: begins (m + 1,), terms and forces
    functions : of each term kind and begins of ``numbers`` (n + 1,), numbers, and room (n,)
    sampled : of each field first and last of its places, begin of its times and of its samples
        (s, 4); slices that are held (s,); times, places and samples of all
    memories : what ``memory_kernels.remember`` takes after the clock and the values
    """
    begins, terms, forces = shapes
    kinds, bounds, numbers, factors = functions
    for k in range(kinds.size):
        factors[k] = factor_at(clock[0], kinds[k], numbers[bounds[k] : bounds[k + 1]])
    for j in range(changing.size):
        total = constant[changing[j]]
        for e in range(begins[j], begins[j + 1]):
            total += factors[terms[e]] * forces[e]
        values[changing[j]] = total
    add_samples(clock[0], sampled, values)
    places, accelerations, tables = memories
    if places[0].size > 0:
        remember(clock, values, places, accelerations, tables)


@addressed
def evaluate_held(place):
    """``evaluate`` for compiled loops."""
    clock, values, constant, changing, shapes, functions, sampled, memories = held_at(place)
    evaluate(clock, values, constant, changing, shapes, functions, sampled, memories)
