"""Aligns a measured force with that of a run: shift and drift of places, gain, offset, filter.

Measured samples m at places p are taken for

    m = g S(p - s - k (p - p0)) + o + noise,

S the force of the run, filtered as the file says that its values are, s the shift at the middle p0
of what is compared, k the drift. All shifts with half of the record are looked at, by
cross-correlation; the best are refined by least squares. The noise is what remains: its variance
and its correlation time give the uncertainty of each parameter, so that a model that is not
exact makes it larger. The file's own places are tried too where they share enough with what is
compared: a passage that ends early is no error.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.signal import argrelmin, correlate

from catenary.postproc.measurements.passage import RunForce

# A record has to have so many periods of the cut-off.
LEAST_PERIODS = 20
# Samples of the search in a period of the cut-off; the search takes the better half of shifts with
# at least this part of the record, and refines so many of them.
_SAMPLES, _LEAST_OVERLAP, _MOST_REFINED = 8, 0.5, 12
# Drifts that the search begins from: between two of them ends of a record are off by this part of
# the shortest wave.
_LARGEST_DRIFT, _DRIFT_STEP = 0.02, 0.25
# A force with a gain beyond these is not the force of the run.
_GAINS = (0.3, 3.0)
# Of a longer stretch [m] the middle is searched; the section that is fitted then grows by so much.
_SECTION, _GROWTH = 1500.0, 4.0
# Cut-offs tried for the file's filter, over the stated one; no filter is tried too.
_FACTORS = (0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.125, 1.25, 1.5, 2.0, 3.0)
# Twice the logarithm of a likelihood ratio beyond which the worse model is given up: chance passes
# 20 in 8 of a million cases, with one parameter.
CERTAIN = 20.0
# Correlations of what remains below this count as none.
_UNCORRELATED = 0.05


@dataclass(frozen=True)
class Estimate:
    """A parameter with its standard deviation."""

    value: float
    deviation: float

    def differs(self, from_value: float, by: float) -> bool:
        """Whether it differs from a value by more than ``by``, and than chance."""
        distance = abs(self.value - from_value)
        return distance > by and distance**2 > CERTAIN * self.deviation**2


@dataclass(frozen=True)
class Alignment:
    """Alignment of a measured force with that of a run.

    Attributes
    ----------
    shift : by which the file's places lie too far along the track, at ``middle`` [m]
    drift : by how much the shift grows for each metre [-]
    middle : of the samples that are compared [m], as the file has places
    length : between the first and the last of them [m]
    gain, offset : of the measured force against the run's, the other one being left as it is
    gain_beside_offset : of both together
    filter : cut-off of the filter that the file's values seem to have passed [Hz], None for none
    filter_certainty : twice the logarithm of how much likelier it is than the stated one
    filter_effect : root mean square of what the two filters make differ [N]
    residual : root mean square of what remains [N]
    correlation : of measured and modelled force
    n_independent : samples, as far as what remains is independent
    other_shifts : further shifts that fit as well [m]
    """

    shift: Estimate
    drift: Estimate
    middle: float
    length: float
    gain: Estimate
    offset: Estimate
    gain_beside_offset: Estimate
    gain_certainty: float
    offset_certainty: float
    both_certainty: float
    filter: float | None
    filter_certainty: float
    filter_effect: float
    residual: float
    correlation: float
    n_independent: float
    other_shifts: tuple[float, ...]

    def placed(self, place: np.ndarray) -> np.ndarray:
        """Places (n,) along the track of places of the file [m]."""
        drift = self.drift.value
        return np.asarray(place - self.shift.value - drift * (place - self.middle))


def align(
    place: np.ndarray,
    force: np.ndarray,
    run: RunForce,
    stretch: tuple[float, float],
    cut_off: float,
    is_filtered: bool,
) -> Alignment | None:
    """The alignment of a measured force; None where no shift has enough of the record.

    Parameters
    ----------
    place : ndarray, shape (n,)
        Ascending places of the measured force, as the file has them [m].
    force : ndarray, shape (n,)
        Measured force below the cut-off, filtered by the file or here [N].
    run : RunForce
        Force of the run.
    stretch : tuple of float
        Begin and end of what is compared [m].
    cut_off : float
        Bandwidth of both forces [Hz].
    is_filtered : bool
        Whether the file's values should have passed its filter already.
    """
    fit = _Fit(place, force, run, stretch, cut_off, is_filtered)
    stated = cut_off if is_filtered else None
    chosen, others = fit.chosen(fit.starts(stated), stated)
    if chosen is None:
        return None
    passed, certainty, effect = fit.filter(chosen, stated)
    if passed != stated:
        again, again_others = fit.chosen(fit.starts(passed), passed)
        if again is not None:
            chosen, others = again, again_others
    return fit.alignment(chosen, passed, certainty, effect, others)


@dataclass(frozen=True)
class _Refined:
    """Shift and drift of a fit, its samples, and what remains.

    ``cost`` is the logarithm of the mean square that remains.
    """

    shift: float
    drift: float
    middle: float
    within: np.ndarray
    gradient: np.ndarray  # (n, 4) by shift, drift, gain, offset
    rest: np.ndarray
    cost: float
    n_independent: float

    def certainty_against(self, other: _Refined) -> float:
        """Twice the logarithm of how much likelier this fit is, by the samples that both have."""
        _, own, its = np.intersect1d(
            self.within, other.within, assume_unique=True, return_indices=True
        )
        if own.size < _LEAST_OVERLAP * min(self.rest.size, other.rest.size):
            return self.n_independent * (other.cost - self.cost)
        ratio = np.sum(other.rest[its] ** 2) / max(float(np.sum(self.rest[own] ** 2)), 1e-12)
        return float(self.n_independent * own.size / self.rest.size * np.log(max(ratio, 1e-12)))


class _Fit:
    def __init__(
        self,
        place: np.ndarray,
        force: np.ndarray,
        run: RunForce,
        stretch: tuple[float, float],
        cut_off: float,
        is_filtered: bool,
    ) -> None:
        self._place, self._force, self._run = place, force, run
        self._begin = max(stretch[0], float(run.position[0]))
        self._end = min(stretch[1], float(run.position[-1]))
        self._cut_off, self._is_filtered = cut_off, is_filtered
        self._wave = run.speed / cut_off  # the shortest there is [m]

    def model(self, passed: float | None) -> CubicSpline:
        """The run's force if the file's values have passed a filter, beside the one of ours."""
        return self._run.below(passed, None if self._is_filtered else self._cut_off)

    def _section(self, length: float) -> tuple[float, float]:
        """Begin and end of the middle of the stretch, up to a length [m]."""
        middle = 0.5 * (self._begin + self._end)
        half = 0.5 * min(length, self._end - self._begin)
        return middle - half, middle + half

    # ---- search -------------------------------------------------------------------------------

    def starts(self, passed: float | None) -> list[tuple[float, float]]:
        """Shifts [m] and drifts to begin from, the likeliest first."""
        step = self._wave / _SAMPLES
        own = np.arange(*self._section(_SECTION), step)
        if own.size < 2 * _SAMPLES:
            return []
        modelled = self.model(passed)(own)
        middle = 0.5 * (self._place[0] + self._place[-1])
        length = min(own[-1] - own[0], self._place[-1] - self._place[0])
        n_drifts = int(np.ceil(_LARGEST_DRIFT * 0.5 * length / (_DRIFT_STEP * self._wave)))
        drifts = np.linspace(-_LARGEST_DRIFT, _LARGEST_DRIFT, 2 * n_drifts + 1)
        # Shifts are multiples of a step from the one of the middle on the begin of the section.
        rows: list[tuple[int, np.ndarray]] = []
        for drift in drifts:
            moved = self._place - drift * (self._place - middle)
            first = int(np.ceil((moved[0] - middle) / step))
            last = int(np.floor((moved[-1] - middle) / step))
            grid = middle + step * np.arange(first, last + 1)
            found = _misfits(np.interp(grid, moved, self._force), modelled)
            rows.append((first - own.size + 1, found))
        lowest = min(number for number, _ in rows) - 1
        size = max(number + row.size for number, row in rows) - lowest + 1
        values, which = np.full(size, np.inf), np.zeros(size, dtype=int)
        for number, (first, row) in enumerate(rows):
            part = slice(first - lowest, first - lowest + row.size)
            better = row < values[part]
            values[part][better], which[part][better] = row[better], number
        if not np.isfinite(values).any():
            return []
        minima = argrelmin(np.where(np.isfinite(values), values, 1e300), order=2)[0]
        if not minima.size:
            minima = np.array([int(values.argmin())])
        shifts = middle - own[0] + step * (lowest + minima)
        near = int(np.argmin(np.abs(shifts)))
        order = np.argsort(values[minima], kind="stable")[:_MOST_REFINED]
        chosen = dict.fromkeys([*order.tolist(), near])
        starts = [(float(shifts[i]), float(drifts[which[minima[i]]])) for i in chosen]
        shared = min(self._end, self._place[-1]) - max(self._begin, self._place[0])
        # The file's own places need no half of the record.
        return [*starts, (0.0, 0.0)] if shared >= LEAST_PERIODS * self._wave else starts

    def chosen(
        self, starts: list[tuple[float, float]], passed: float | None
    ) -> tuple[_Refined | None, tuple[float, ...]]:
        """The equally good fit nearest to the file's places, and the shifts of the others [m].

        ``starts`` are shifts [m] and drifts to begin with, ``passed`` as of ``refined``.
        """
        # The second time with the samples that belong to the section.
        lengths = [_SECTION, _SECTION]
        middle = 0.5 * (self._place[0] + self._place[-1])
        alike = _likely(
            self.refined(shift, drift, middle, passed, lengths) for shift, drift in starts
        )
        if self._end - self._begin > _SECTION:
            while lengths[-1] < self._end - self._begin:
                lengths.append(_GROWTH * lengths[-1])
            alike = _likely(
                self.refined(one.shift, one.drift, one.middle, passed, [*lengths[2:], lengths[-1]])
                for one in alike
            )
        if not alike:
            return None, ()
        own = min(alike, key=lambda one: abs(one.shift))
        others = {round(one.shift, 1) for one in alike if abs(one.shift - own.shift) > self._wave}
        return own, tuple(sorted(others, key=abs))

    # ---- refinement ---------------------------------------------------------------------------

    def refined(
        self,
        shift: float,
        drift: float,
        middle: float,
        passed: float | None,
        lengths: Sequence[float],
    ) -> _Refined | None:
        """Least squares in sections of the stretch, one after the other; None if they lead to
        another shift.

        Parameters
        ----------
        shift : float
            Shift to begin with [m].
        drift : float
            Drift to begin with, about ``middle`` [-].
        middle : float
            Place of the file at which the shift counts [m].
        passed : float or None
            Cut-off of the filter that the file's values have passed [Hz], None for none.
        lengths : sequence of float
            Lengths of the sections [m].
        """
        model = self.model(passed)
        for length in lengths:
            begin, end = self._section(length)
            at = self._place - shift - drift * (self._place - middle)
            within = np.flatnonzero((at >= begin) & (at <= end))
            if within.size < 20:
                return None
            place, force = self._place[within], self._force[within]
            shift += drift * (place.mean() - middle)
            middle = float(place.mean())
            found, gradient, rest = _fitted(model, place, force, shift, drift)
            # Another minimum, which is begun from by itself; or a part that does not swing at all.
            if abs(found[0] - shift) > 2.0 * self._wave or not _GAINS[0] < found[2] < _GAINS[1]:
                return None
            shift, drift = float(found[0]), float(found[1])
        square = max(float(rest @ rest) / rest.size, (1e-6 * float(np.std(force)) + 1e-12) ** 2)
        n_independent = rest.size / correlation_time(rest)
        return _Refined(
            shift, drift, middle, within, gradient, rest, float(np.log(square)), n_independent
        )

    # ---- what follows -------------------------------------------------------------------------

    def alignment(
        self,
        own: _Refined,
        passed: float | None,
        certainty: float,
        effect: float,
        others: tuple[float, ...],
    ) -> Alignment:
        """Gain and offset at the places of a fit, ``own``, and all uncertainties.

        ``passed``, ``certainty`` and ``effect`` are those of ``filter``, ``others`` further shifts
        [m].
        """
        force = self._force[own.within]
        place = self._place[own.within]
        at = place - own.shift - own.drift * (place - own.middle)
        modelled = self.model(passed)(at)
        deviations = np.sqrt(
            np.maximum(np.diag(np.linalg.pinv(own.gradient.T @ own.gradient)), 0.0)
            * np.exp(own.cost)
            * own.rest.size
            / own.n_independent
        )
        ones, n = np.ones(force.size), own.n_independent
        alone = float(np.mean((force - modelled) ** 2))
        gain, gain_left = _one_of(modelled, force, n)
        offset, offset_left = _one_of(ones, force - modelled, n)
        both, *_ = np.linalg.lstsq(np.stack([modelled, ones], axis=1), force, rcond=None)
        both_left = float(np.mean((force - both[0] * modelled - both[1]) ** 2))
        floor = float(np.exp(own.cost)) * 1e-6

        def certain(left: float) -> float:
            return float(n * np.log((alone + floor) / (left + floor)))

        return Alignment(
            Estimate(own.shift, float(deviations[0])),
            Estimate(own.drift, float(deviations[1])),
            own.middle,
            float(place[-1] - place[0]),
            gain,
            offset,
            Estimate(float(both[0]), float(deviations[2])),
            certain(gain_left),
            certain(offset_left),
            certain(both_left),
            passed,
            certainty,
            effect,
            float(np.sqrt(np.mean(own.rest**2))),
            float(np.corrcoef(force, modelled)[0, 1]) if force.std() > 0.0 else 0.0,
            n,
            others,
        )

    def filter(self, own: _Refined, stated: float | None) -> tuple[float | None, float, float]:
        """The filter that the file's values have passed most likely, twice the logarithm of how
        much likelier it is than the ``stated`` one, and the difference of the two [N], for the
        places of a fit, ``own``."""
        force, place = self._force[own.within], self._place[own.within]
        at = place - own.shift - own.drift * (place - own.middle)
        candidates = [stated, None, *(factor * self._cut_off for factor in _FACTORS)]
        if stated is None:
            candidates.append(self._cut_off)
        left: dict[float | None, float] = {}
        n_of: dict[float | None, float] = {}
        for passed in candidates:
            basis = np.stack([self.model(passed)(at), np.ones(at.size)], axis=1)
            found, *_ = np.linalg.lstsq(basis, force, rcond=None)
            rest = force - basis @ found
            left[passed] = max(float(np.mean(rest**2)), 1e-12)
            n_of[passed] = rest.size / correlation_time(rest)
        best = min(left, key=lambda one: left[one])
        certainty = n_of[best] * float(np.log(left[stated] / left[best]))
        if certainty <= CERTAIN:
            return stated, certainty, 0.0
        effect = self.model(best)(at) - self.model(stated)(at)
        return best, certainty, float(np.sqrt(np.mean(effect**2)))


def _fitted(
    model: CubicSpline, place: np.ndarray, force: np.ndarray, shift: float, drift: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shift, drift, gain and offset (4,) with which the model is nearest to a force at places (n,),
    from a shift and drift on; derivatives of the force by them (n, 4), and what remains."""
    slope, arm = model.derivative(), place - place.mean()
    scale = max(float(np.abs(arm).max()), 1e-9)  # of the drift, as a shift at an end

    def at(x: np.ndarray) -> np.ndarray:
        return np.asarray(place - x[0] - x[1] / scale * arm)

    def residual(x: np.ndarray) -> np.ndarray:
        return np.asarray(x[2] * model(at(x)) + x[3] - force)

    def jacobian(x: np.ndarray) -> np.ndarray:
        steep = -x[2] * slope(at(x))
        return np.stack([steep, steep * arm / scale, model(at(x)), np.ones(arm.size)], axis=1)

    guess, sizes = np.array([shift, drift * scale, 1.0, 0.0]), np.array([1.0, scale, 1.0, 1.0])
    found = least_squares(residual, guess, jacobian, method="lm", max_nfev=60)
    return found.x / sizes, np.asarray(found.jac) * sizes, -found.fun


def _likely(tried: Iterable[_Refined | None]) -> list[_Refined]:
    """Fits that are as likely as the best."""
    found = [one for one in tried if one is not None]
    if not found:
        return []
    best = min(found, key=lambda one: one.cost)
    return [one for one in found if best.certainty_against(one) < CERTAIN]


def _misfits(measured: np.ndarray, modelled: np.ndarray) -> np.ndarray:
    """Variance of the difference at all lags, infinite where they share too little.

    From the last modelled sample upon the first measured one to the contrary.
    """

    def sums(of_measured: np.ndarray, of_modelled: np.ndarray) -> np.ndarray:
        return np.asarray(correlate(of_measured, of_modelled, method="fft"))

    all_measured, all_modelled = np.ones(measured.size), np.ones(modelled.size)
    n = np.round(sums(all_measured, all_modelled))
    enough = n > _LEAST_OVERLAP * min(measured.size, modelled.size)
    n[~enough] = 1.0
    mean = sums(measured, all_modelled) - sums(all_measured, modelled)
    square = sums(measured**2, all_modelled) + sums(all_measured, modelled**2)
    square -= 2.0 * sums(measured, modelled)
    return np.where(enough, np.maximum(square / n - (mean / n) ** 2, 0.0), np.inf)


def _one_of(basis: np.ndarray, values: np.ndarray, n: float) -> tuple[Estimate, float]:
    """The factor of a function (m,) in values (m,) and the mean square that it leaves; of the
    values ``n`` are independent."""
    size = float(basis @ basis)
    factor = float(basis @ values) / size
    left = float(np.mean((values - factor * basis) ** 2))
    return Estimate(factor, float(np.sqrt(left * values.size / (n * size)))), left


def correlation_time(rest: np.ndarray) -> float:
    """Samples (n,) to one that is independent: one and twice the sum of their correlations up to
    the first that is none."""
    centred = rest - rest.mean()
    power = float(centred @ centred)
    if power == 0.0:
        return 1.0
    found = correlate(centred, centred, method="fft")[centred.size - 1 :] / power
    small = np.flatnonzero(found < _UNCORRELATED)
    last = int(small[0]) if small.size else found.size
    return float(1.0 + 2.0 * found[1:last].sum())
