"""The loop of a regulated lift, compiled by Numba: filter, samples, gains, limits, delay."""

from __future__ import annotations

from catenary.mbs.control.control_arrays import (
    ACTING,
    DT,
    ERROR,
    FILTERED,
    HEIGHT,
    INTEGRAL,
    LEAST,
    MOST,
    NEXT,
    PART,
    SAMPLE,
    SAMPLES,
    TARGET,
    TIME,
    WAITING,
)
from catenary.solver.base.kernels.compiled import called, in_line, inner

# Part of a step by which a sample may come early: times are sums.
_EARLY = 1e-6


@called
def gains_at(gains, x):
    """The three gains where ``x`` is measured, those of the ends beyond the table."""
    n = gains.shape[0]
    i = 0
    while i < n - 2 and gains[i + 1, 0] <= x:
        i += 1
    last = min(i + 1, n - 1)
    part = 0.0
    if last > i:
        part = min(max((x - gains[i, 0]) / (gains[last, 0] - gains[i, 0]), 0.0), 1.0)
    return (
        gains[i, 1] + part * (gains[last, 1] - gains[i, 1]),
        gains[i, 2] + part * (gains[last, 2] - gains[i, 2]),
        gains[i, 3] + part * (gains[last, 3] - gains[i, 3]),
    )


@called
def regulate(settings, gains, memory, measured):
    """Take in what is measured at the end of a step; put the added force of the next one.

    The integral stands while the force is at a limit and the error would drive it beyond.
    """
    memory[TIME] += settings[DT]
    if memory[SAMPLES] < 0.0:
        # The first step begins where it is: a filter has no start of its own.
        memory[FILTERED], memory[SAMPLES] = measured, 0.0
    memory[FILTERED] += settings[PART] * (measured - memory[FILTERED])
    if memory[TIME] < memory[NEXT] - _EARLY * settings[DT]:
        return
    memory[NEXT] += settings[SAMPLE]
    error = settings[TARGET] - memory[FILTERED]
    by_error, by_integral, by_rate = gains_at(gains, memory[FILTERED])
    rate = 0.0 if memory[SAMPLES] == 0.0 else (error - memory[ERROR]) / settings[SAMPLE]
    integral = memory[INTEGRAL] + settings[SAMPLE] * error
    wanted = by_error * error + by_integral * integral + by_rate * rate
    if settings[LEAST] <= wanted <= settings[MOST]:
        memory[INTEGRAL] = integral
    else:
        beyond = wanted - min(max(wanted, settings[LEAST]), settings[MOST])
        if beyond * by_integral * error <= 0.0:
            memory[INTEGRAL] = integral
    wanted = min(max(wanted, settings[LEAST]), settings[MOST])
    memory[ERROR] = error
    n_waiting = memory.size - WAITING
    if n_waiting == 0:
        memory[ACTING] = wanted
    else:
        at = WAITING + int(memory[SAMPLES]) % n_waiting
        memory[ACTING] = memory[at]
        memory[at] = wanted
    memory[SAMPLES] += 1.0


@in_line
def watch(control, head, contact_force):
    """Take in the end of a step, whose ``contact_force`` (s,) is that of a pantograph [N]."""
    settings, gains, memory = control
    regulate(settings, gains, memory, measure(settings, head, contact_force))


@inner
def measure(settings, head, contact_force):
    """What a controller sees at the end of a step: mean height of the strips, or their force."""
    n, s = head.state.size // 3, contact_force.size
    total = 0.0
    for j in range(s):
        if settings[HEIGHT] != 0.0:
            for k in range(n):
                total += head.touch[0, j, k] * head.state[k] / s
        else:
            total += contact_force[j]
    return total
