"""A part of the gusts along a line, as a random field that is made anew wherever it is needed.

The field is a sum of waves in time, one for each narrow band of its spectrum. Their amplitudes are
random and differ from place to place: those of one frequency n are a first-order Gauss-Markov
process along the line, whose correlation exp(-C n d / U) is the coherence wanted (A. G. Davenport).
Posts stand along the line; between two of them the process is made with both given, which is exact.
So any stretch and any time follow from the seed alone, and memory does not grow with either.
"""

from __future__ import annotations

from collections import OrderedDict

import numpy as np

from catenary.solver.kernels import native
from catenary.solver.problem.wind import Wind
from catenary.solver.wind.spectra import variance_below

# Bands: below this frequency [Hz] so many to a factor of ten, from there on so wide [Hz].
_EVEN_FROM, _PER_DECADE, _WIDTH = 0.1, 30, 0.01
# Points from post to post, and stretches between posts that are kept.
POSTS, _KEPT = 64, 96
# Slices in a period of the highest frequency. Linear between them, a wave loses part of itself.
_SLICES = 5


class GustField:
    """One part of the gusts at points along the line. Not collective; the same on all ranks.

    Parameters
    ----------
    wind : with gusts
    part : ALONG, ACROSS or UPWARD
    points : (n,) places [m], ascending
    spread : distance [m] of points between which a load is linear: the coherence of loads over
        longer lengths is then that of the gusts themselves. None for the gusts at a point

    Attributes
    ----------
    interval : between slices of time [s]
    frequencies, deviations : (k,) [Hz] and standard deviations [m/s] of the waves; the sum of the
        squares is the variance of the spectrum from the lowest to the highest frequency
    """

    def __init__(
        self, wind: Wind, part: int, points: np.ndarray, spread: float | None = None
    ) -> None:
        gusts = wind.gusts
        assert gusts is not None
        self.interval = 1.0 / (_SLICES * gusts.highest)
        self._points, self._seed, self._growth = points, (gusts.seed, part), gusts.growth
        edges = _edges(gusts.lowest, gusts.highest)
        random = np.random.default_rng([*self._seed, 0])
        share = random.uniform(size=edges.size - 1)
        self.frequencies = edges[:-1] + share * np.diff(edges)
        self.deviations = np.sqrt(np.diff(variance_below(wind, part)(edges)))
        # Between slices the field is linear, which takes this of a wave.
        self._raised = self.deviations / np.sinc(self.frequencies * self.interval) ** 2
        rates = gusts.decay[part] * self.frequencies / wind.mean
        if spread is not None:
            self._raised *= np.sqrt(narrowed(0.5 * rates * spread))
        # Each wave has two amplitudes, of its cosine and of its sine.
        self._rates = np.tile(rates, 2)
        self._posts = self._first_chain(random)
        self._kept: OrderedDict[int, np.ndarray] = OrderedDict()

    def fill(self, first: int, part: slice, slices: np.ndarray) -> None:
        """Fill ``slices`` (m, k) [m/s] at the points of ``part``, at (first + i) ``interval``."""
        times = self.interval * (first + np.arange(slices.shape[0]))
        phases = 2.0 * np.pi * times[:, None] * self.frequencies
        waves = np.concatenate([np.cos(phases), np.sin(phases)], axis=1)
        if self._growth > 0.0:
            grown = np.clip(times / self._growth, 0.0, 1.0)
            waves *= (0.5 - 0.5 * np.cos(np.pi * grown))[:, None]
        slices[:] = 0.0
        begin = part.start
        while begin < part.stop:
            post = begin // POSTS
            end = min(part.stop, (post + 1) * POSTS)
            own = self._between(post)[:, begin - post * POSTS : end - post * POSTS]
            # A block of its own, as slices may be any part of a larger array.
            made = np.zeros((slices.shape[0], end - begin))
            native.add_waves(waves, np.ascontiguousarray(own), made)
            slices[:, begin - part.start : end - part.start] = made
            begin = end

    def _first_chain(self, random: np.random.Generator) -> np.ndarray:
        """Amplitudes at the posts (p, 2 k), one more than there are stretches."""
        last = self._points.size - 1
        numbers = np.minimum(np.arange(0, last + POSTS + 1, POSTS), last)
        steps = np.diff(self._points[numbers])
        chain = random.standard_normal((numbers.size, self._rates.size))
        for post, step in enumerate(steps, start=1):
            kept = np.exp(-self._rates * step)
            chain[post] *= np.sqrt(-np.expm1(-2.0 * self._rates * step))
            chain[post] += kept * chain[post - 1]
        return chain

    def _between(self, post: int) -> np.ndarray:
        """Amplitudes times deviations (2 k, m) at the m points from a post to before the next."""
        if post in self._kept:
            self._kept.move_to_end(post)
            return self._kept[post]
        first, stop = post * POSTS, min((post + 1) * POSTS, self._points.size - 1)
        inner = max(stop - first - 1, 0)
        values = np.empty((inner + 1, self._rates.size))
        values[0] = self._posts[post]
        if inner:
            normals = np.random.default_rng([*self._seed, 1 + post]).standard_normal(
                (inner, self._rates.size)
            )
            steps = np.diff(self._points[first : stop + 1])
            ends = self._posts[post], self._posts[post + 1]
            native.bridge(*ends, self._rates, steps, normals, values[1:])
        if stop == self._points.size - 1 and stop < (post + 1) * POSTS and stop > first:
            values = np.concatenate([values, self._posts[post + 1][None]])
        made = np.ascontiguousarray(values.T * np.tile(self._raised, 2)[:, None])
        self._kept[post] = made
        if len(self._kept) > _KEPT:
            self._kept.popitem(last=False)
        return made


def narrowed(half: np.ndarray) -> np.ndarray:
    """Factor on the power of a gust process, for a field that is linear between points [-].

    The process has the correlation exp(-a d), the points are h apart, ``half`` is a h / 2. The
    factor is 2 / a over the sum of h exp(-a h |j|) over all j: over lengths beyond h the load has
    the power of the process. Shape as ``half``.
    """
    return np.asarray(np.tanh(half) / half)


def _edges(lowest: float, highest: float) -> np.ndarray:
    """Edges of the bands [Hz]."""
    middle = min(max(_EVEN_FROM, lowest), highest)
    edges = [np.array([lowest])]
    if middle > lowest:
        n = max(1, round(_PER_DECADE * np.log10(middle / lowest)))
        edges.append(np.geomspace(lowest, middle, n + 1)[1:])
    if highest > middle:
        n = max(1, round((highest - middle) / _WIDTH))
        edges.append(np.linspace(middle, highest, n + 1)[1:])
    return np.concatenate(edges)
