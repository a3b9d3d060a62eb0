"""Passages of single pantographs: droppers that slacken in them, uplift that begins before."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from catenary.postproc.read.results import Results, in_stretch

# A pantograph moves the wire before it arrives: what a dropper does from here on, three dropper
# spacings ahead of the head, counts as that pantograph's passage [m].
AHEAD = 20.0
# An uplift has begun when it has reached this share of its largest value.
BEGUN = 0.05
MID_SPAN = 2  # droppers nearest to mid-span that stand for it, as an even number of them has two


def measure(results: Results) -> dict[str, Any]:
    """Slack droppers by passage, onset of the arms' uplift, wave and train speed: plain values."""
    return {
        "slack": slack_droppers(results),
        "onset_m": uplift_onset(results),
        "wave_speed_m_per_s": results.fact("wave_speed"),
        "train_speed_m_per_s": results.fact("speed"),
        "span_m": float(np.diff(results.line("support_x"))[results.reference_span]),
    }


def slack_droppers(results: Results) -> dict[str, dict[str, int]]:
    """Counts of evaluated droppers that were slack: ``leading`` before the last pantograph's
    passage, ``trailing`` in or after it, ``any`` time, out of ``of``; of those next to mid-span
    (``mid``) and of all (``all``). With one pantograph its passage is the leading one."""
    x = results.line("dropper_x")
    evaluated = in_stretch(x, *results.evaluation)
    leading, trailing = np.zeros(x.size, dtype=bool), np.zeros(x.size, dtype=bool)
    last = np.full(results.n_steps + 1, -np.inf)
    if results.n_pantographs > 1:
        positions = (results.column("contact_position", p) for p in range(results.n_pantographs))
        last = functools.reduce(np.minimum, positions)
    last = last[:: results.line_record.every]
    for part, columns, force in results.written_blocks("dropper_force"):
        slack = force <= 0.0
        after = last[part, None] >= x[columns] - AHEAD
        leading[columns] |= (slack & ~after).any(axis=0)
        trailing[columns] |= (slack & after).any(axis=0)
    groups = {"mid": evaluated & mid_span(results), "all": evaluated}
    return {
        name: {
            "leading": int((leading & chosen).sum()),
            "trailing": int((trailing & chosen).sum()),
            "any": int(((leading | trailing) & chosen).sum()),
            "of": int(chosen.sum()),
        }
        for name, chosen in groups.items()
    }


def mid_span(results: Results) -> np.ndarray:
    """Whether a dropper is one of the two nearest to the middle of its span, (n_droppers,)."""
    x, span = results.line("dropper_x"), results.line("dropper_span")
    masts = results.line("support_x")
    away = np.abs(x - 0.5 * (masts[span] + masts[span + 1]))
    near = np.zeros(x.size, dtype=bool)
    for number in np.unique(span):
        inside = np.flatnonzero(span == number)
        near[inside[np.argsort(away[inside], kind="stable")[:MID_SPAN]]] = True
    return near


def uplift_onset(results: Results) -> float | None:
    """Distance of the leading head before an evaluated arm when the arm's uplift has begun [m].

    The smallest value of all arms; negative if an arm moves only after the head has passed. None
    without arms in the stretch.
    """
    x = results.line("arm_x")
    lead = leading_position(results)[:: results.line_record.every]
    largest = results.extremes("arm_uplift")[1]
    ahead = []
    for arm in np.flatnonzero(in_stretch(x, *results.evaluation)):
        begun = results.column("arm_uplift", int(arm)) >= BEGUN * largest[arm]
        if begun.any():  # it has begun outside of what is recorded otherwise
            ahead.append(float(x[arm] - lead[int(np.argmax(begun))]))
    return min(ahead) if ahead else None


def leading_position(results: Results) -> np.ndarray:
    """Place of the foremost pantograph at each record, (n,) [m]."""
    foremost = int(np.argmax(results.first_position))
    return results.column("contact_position", foremost)
