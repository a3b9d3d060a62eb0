"""The compiled loops of links near the train: which of them may switch within a step.

Not collective; see `base.compiled` for how loops are compiled.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.base.kernels.compiled import inner
from catenary.solver.integrators.state_kernels import Riders, reserve_of_many
from catenary.solver.model.switching_links import LinkArrays


class Followed(NamedTuple):
    """Links that a rank follows: their ``numbers`` (n,) in the line, ``links`` (``LinkArrays``) and
    ``reserve`` (n,) [N], as a free step leaves it; which of them may switch, ``moving`` (2,); their
    ``riders``, of numbers ``riding`` (m,)."""

    numbers: np.ndarray
    links: LinkArrays
    reserve: np.ndarray
    moving: np.ndarray
    riders: Riders
    riding: np.ndarray


@inner
def n_beyond(reserve, moving, margin):
    """How many reserves of ``moving`` links are below a margin, or not finite."""
    count = 0
    for d in range(moving[0], moving[1]):
        count += not (margin <= reserve[d] < np.inf)
    return count


@inner
def spread(link, links, answer):
    """Stretch of a link in an answer (n_local,)."""
    unknowns, weights, _ = links
    link = np.uint64(link)
    total = weights[link, 0] * answer[np.uint64(unknowns[link, 0])]
    total += weights[link, 1] * answer[np.uint64(unknowns[link, 1])]
    for k in range(2, unknowns.shape[1]):
        total += weights[link, k] * answer[unknowns[link, k]]
    return total


@inner
def put_row(rows, at, of_link, links, link, answers, gains):
    """Make row ``at`` that of one of ``links``; ``of_link`` are its number and its reserve."""
    by_force, by_slope = answers
    law, uses_rate = links.law[link], by_slope.shape[1] > 0
    per_acceleration = law.stiffness * gains.position + law.damping * gains.velocity
    rows.number[at], rows.reserve[at] = of_link
    for i in range(by_force.shape[0]):
        apart = spread(link, links, by_force[i])
        rows.reaction[at, i] = per_acceleration * apart
        rows.lift[at, i] = gains.position * apart
        rows.rise[at, i] = 0.0
        if uses_rate:
            along = spread(link, links, by_slope[i])
            rows.rise[at, i] = gains.velocity * apart + gains.train_speed * gains.position * along


@inner
def watch(motion, followed, bounds, touches, answers, gains, rows):
    """Number of links that may switch within ``bounds``, riders included; a row each, as far as
    they fit, those of riders behind those of their masters.

    ``followed`` links stand in the order along the track, with their reserve without contact
    forces. Contacts touch those within reach. -1 if a reserve is not finite.
    """
    numbers, links, reserve, moving, riders, riding = followed
    by_force = answers.by_force
    laws, margin = links.law, bounds.loss[0]
    count, n = 0, touches.size
    low, high = touches[0].x, touches[0].x
    for i in range(1, n):
        low, high = min(low, touches[i].x), max(high, touches[i].x)
    first = np.searchsorted(laws.place, low - gains.reach)
    last = np.searchsorted(laws.place, high + gains.reach, side="right")
    first, last = max(first, moving[0]), min(last, moving[1])
    # Mostly none is near its margin by itself: then those beyond reach are not looked at.
    begin, end = first, last
    if n_beyond(reserve, moving, margin):
        begin, end = moving[0], moving[1]
    for d in range(begin, end):
        # Also true for NaN.
        candidate = not (margin <= reserve[d] < np.inf)
        if not (candidate or first <= d < last):
            continue
        if not np.isfinite(reserve[d]):
            return -1
        law = laws[d]
        if law.released == 0.0:
            continue
        per_acceleration = law.stiffness * gains.position + law.damping * gains.velocity
        if not candidate:
            left = reserve[d]
            for i in range(n):
                if touches[i].present != 0.0 and abs(law.place - touches[i].x) <= gains.reach:
                    change = per_acceleration * spread(d, links, by_force[i])
                    left += min(change * bounds.push[i], -change * bounds.pull[i])
            candidate = left < margin
        if not candidate:
            continue
        if count < rows.number.size:
            put_row(rows, count, (numbers[d], reserve[d]), links, d, answers, gains)
        count += 1
        for r in range(riders.begin[d], riders.begin[d + 1]):
            if count < rows.number.size:
                own = riders.links
                vectors, shares = motion[:3], motion[3]
                left = reserve_of_many(vectors, shares, own.unknowns, own.weights, own.law[r], r)
                put_row(rows, count, (riding[r], left), own, r, answers, gains)
            count += 1
    return count
