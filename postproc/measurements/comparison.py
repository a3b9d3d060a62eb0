"""Comparison of a measured passage with a run: alignment, figures of both, tolerances.

The alignment of the measured force with that of the run shows errors of the measurement: of
positions, sign, unit, gain, offset and filter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from catenary.base.errors import InputError
from catenary.postproc.evaluate.compare import STATISTICS, differences, span_sums
from catenary.postproc.evaluate.wording import counted
from catenary.postproc.files.header import in_sentence
from catenary.postproc.measurements.alignment import (
    CERTAIN,
    LEAST_PERIODS,
    Alignment,
    align,
    correlation_time,
)
from catenary.postproc.measurements.compared import (
    LINE_TEST,
    Compared,
    Comparison,
    Finding,
    Overlay,
    UpliftAtSupports,
)
from catenary.postproc.measurements.passage import MeasuredForce, MeasuredUplift, Passage, RunForce
from catenary.postproc.read.results import Results, in_stretch

# Errors of heights below this are of no account, however certain [m].
_HEIGHT = 2e-3
# A pantograph has no force if half of its samples lie below this share of the run's mean, and none
# was measured if this share of the samples has no number.
_NO_FORCE, _MOST_GAPS = 0.2, 0.2
# Forces with a lower correlation are not those of the run, and are not used for alignment.
_LEAST_CORRELATION = 0.6
# A residual exceeds the stated noise beyond this factor.
_MORE_THAN_NOISE = 1.3
# A range is widened by noise of deviation 1 by up to so much.
_WIDENED = 6.0
# A span is whole if the record ends this near its masts [m].
_NEAR_MAST = 1.0
# A support is that of the run if it is this near [m].
_NEAR_SUPPORT = 10.0
# Errors below these are of no account, however certain: of places [m], of the force as a share of
# its mean, of a filter as a share of the standard deviation.
_SHIFT, _DRIFTED, _FORCE_SHARE, _FILTER_SHARE = 0.2, 0.1, 0.003, 0.03
# A constant of so many stated deviations is no error.
_BIASES = 3.0
# Means and deviations of a measured force and of the run's differ by less than the first factor;
# by the others where one is in N and the other in kN.
_ALIKE, _UNITS = 3.0, (1e-3, 1e3)


def compare_with(results: Results, passage: Passage) -> Comparison:
    """Compare a run with a measured passage. Not collective.

    Parameters
    ----------
    results : Results
        Results of the run.
    passage : Passage
        What was measured, and how.

    Raises
    ------
    InputError
        If the run has no such pantograph, or if the measurement does not cover the run's line.
    """
    names = results.pantograph_names()
    for one in passage.forces:
        if one.pantograph >= len(names):
            raise InputError(
                f"{passage.name} has pantograph {one.pantograph + 1} by its description, and the "
                f"run in {results.path} has {len(names)}"
            )
    about = results.attributes
    lead = (
        f"{passage.name} beside {results.path} ({about['case']}, "
        f"{3.6 * results.fact('speed'):.0f} km/h), {passage.stretch[0]:g} to "
        f"{passage.stretch[1]:g} m, forces below {passage.cut_off:g} Hz"
    )
    found = Comparison(passage.name, str(results.path), lead, list(results.damage))
    work = _Comparing(results, passage, names, found)
    for one in passage.forces:
        work.pantograph(one)
    work.unmeasured()
    if passage.uplift is not None:
        work.uplifts(passage.uplift)
    return found


class _Comparing:
    """Work on a comparison, to which overlays, figures, findings and remarks are added."""

    def __init__(
        self, results: Results, passage: Passage, names: Sequence[str], found: Comparison
    ) -> None:
        self._results, self._passage, self._names = results, passage, names
        self._found = found
        self._runs: dict[int, RunForce] = {}

    def _run(self, number: int) -> RunForce:
        if number not in self._runs:
            position = self._results.column("contact_position", number)
            force = self._results.column("contact_force", number)
            if position.size < 2 or not np.isfinite(force).all():
                raise InputError(f"{self._results.path} has no record of its contact forces")
            self._runs[number] = RunForce(position, force, self._results.dt)
        return self._runs[number]

    def _stretch(self, run: RunForce) -> tuple[float, float]:
        """Begin and end of what is compared of a pantograph's run [m]."""
        begin, end = self._passage.stretch
        return max(begin, float(run.position[0])), min(end, float(run.position[-1]))

    def _find(self, kind: str, name: str, text: str, value: float = float("nan")) -> None:
        self._found.findings.append(Finding(kind, name, text, value))

    # ---- a pantograph ---------------------------------------------------------------------------

    def pantograph(self, own: MeasuredForce) -> None:
        """Align the force of a pantograph, and compare it."""
        passage, name = self._passage, self._names[own.pantograph]
        run = self._run(own.pantograph)
        measured = ~np.isnan(own.force)
        force = self._without_gaps(own.force, name, "sample")
        if force is None:
            share = 100.0 * float(np.mean(~measured))
            text = f"{name}: {share:.0f} % of the measured forces are not numbers"
            self._find("missing pantograph", name, text)
            return
        expected = run.below(passage.cut_off)(run.position)
        if other := _other_scale(force, expected):
            self._find(other[0], name, f"{name}: {other[1]}", float(np.mean(force)))
            return
        if np.median(force) < _NO_FORCE * float(np.mean(expected)):
            text = f"{name}: half of the measured forces are below {np.median(force):.1f} N: "
            self._find("missing pantograph", name, text + "lowered, or not recorded")
            return
        dt = float(own.place[1] - own.place[0]) / run.speed
        inside = slice(passage.margin(dt), own.place.size - passage.margin(dt))
        # Bridges are there for the filter alone: nothing was measured on them.
        valid = np.arange(own.place.size)[inside][passage.untouched(measured, dt)[inside]]
        place, force = own.place[valid], passage.in_band(force, dt)[valid]
        begin, end = self._stretch(run)
        if begin >= end:
            raise InputError(
                f"{self._results.path} has {in_sentence(name)} from {run.position[0]:g} to "
                f"{run.position[-1]:g} m, outside of the compared stretch, {passage.stretch[0]:g} "
                f"to {passage.stretch[1]:g} m"
            )
        length = float(place[-1] - place[0]) if place.size else 0.0
        least = LEAST_PERIODS * run.speed / passage.cut_off
        if min(length, end - begin) < least:
            raise InputError(
                f"{passage.name} has {length:.1f} m, and the run is compared from {begin:g} to "
                f"{end:g} m: both must have at least {least:.0f} m, {LEAST_PERIODS} periods of "
                f"{passage.cut_off:g} Hz"
            )
        aligned = self._placed(own, place, force)
        if aligned is not None:
            self._found.findings += _errors_of(aligned, name, run, passage, own.bias)
            if aligned.other_shifts:
                shifts = ", ".join(f"{shift:+.1f}" for shift in aligned.other_shifts[:4])
                self._found.remarks.append(f"{name}: shifts of {shifts} m fit as well")
            self._noise_floor(aligned, name, passage.noise_in_band(own.noise, dt))
        at = place if aligned is None else aligned.placed(place)
        within = (at >= begin) & (at <= end)
        if np.count_nonzero(within) < 20:
            raise InputError(
                f"{passage.name} has positions from {at[0]:.1f} to {at[-1]:.1f} m, and the run is "
                f"compared from {begin:g} to {end:g} m: they do not overlap"
            )
        at, force = at[within], force[within]
        wave = run.speed / passage.cut_off
        if at[0] > begin + wave or at[-1] < end - wave:
            text = f"compared from {at[0]:.0f} to {at[-1]:.0f} m, which is all that was measured"
            self._found.remarks.append(f"{name}: {text}")
        modelled = run.below(passage.cut_off)(at)
        heights = self._heights(own, valid, within, at, dt)
        self._force_figures(name, at, force, run)
        if heights is not None:
            self._height_figures(name, *heights, own, dt)
        measured_height, run_height = heights or (None, None)
        self._found.overlays.append(
            Overlay(name, at, force, modelled, measured_height, run_height, aligned)
        )

    def _placed(self, own: MeasuredForce, place: np.ndarray, force: np.ndarray) -> Alignment | None:
        """The alignment of a force (n,) at the file's places (n,); None where it is not that of
        the pantograph, which is found."""
        name, found = self._names[own.pantograph], self._aligned(place, force, own.pantograph)
        other = found and self._other_pantograph(place, force, own.pantograph, found)
        if other:
            self._find("other pantograph", name, *other)
            return None
        if found is None or found.correlation < _LEAST_CORRELATION:
            shown = "" if found is None else f" (correlation {found.correlation:.2f})"
            text = f"{name}: the forces are not those of the run{shown}: nothing is aligned by them"
            self._find("unlike", name, text)
            return None
        return found

    def _without_gaps(self, values: np.ndarray, name: str, what: str) -> np.ndarray | None:
        """Values with gaps bridged by straight lines; None where too much is missing, which is
        found as gaps of ``what``."""
        missing = np.isnan(values)
        share = float(missing.mean())
        if share > _MOST_GAPS:
            return None
        known = np.flatnonzero(~missing)
        # Before the first number and behind the last the record has not begun, or is over.
        n_gaps = int(missing[known[0] : known[-1]].sum())
        if n_gaps:
            text = f"{name}: {counted(n_gaps, what)} without a number, left out"
            self._find("gaps", name, text, float(n_gaps))
        if missing.any():
            values = np.interp(np.arange(values.size), known, values[known])
        return values

    def _aligned(self, place: np.ndarray, force: np.ndarray, number: int) -> Alignment | None:
        passage = self._passage
        return align(
            place, force, self._run(number), passage.stretch, passage.cut_off, passage.is_filtered
        )

    def _other_pantograph(
        self, place: np.ndarray, force: np.ndarray, number: int, found: Alignment
    ) -> tuple[str, float] | None:
        """A sentence and the number of the pantograph of the train whose force this rather is."""
        for other, name in enumerate(self._names):
            there = None if other == number else self._aligned(place, force, other)
            if there is None:
                continue
            # Twice the logarithm of the ratio of likelihoods, of as many samples.
            ratio = np.log(found.residual / max(there.residual, 1e-9))
            if 2.0 * found.n_independent * ratio > CERTAIN:
                text = (
                    f"{self._names[number]}: the measured force fits {in_sentence(name)} better "
                    f"(residual {there.residual:.1f} N, not {found.residual:.1f} N)"
                )
                return text, float(other)
        return None

    def _noise_floor(self, found: Alignment, name: str, stated: float) -> None:
        """Add a remark on the residual and on the smallest errors that show beside it;
        ``stated`` is the noise [N]."""
        factor, length = np.sqrt(CERTAIN), found.length
        self._found.remarks.append(
            f"{name}: noise floor {found.residual:.2f} N (correlation {found.correlation:.3f}); "
            f"reported are a shift above {max(_SHIFT, factor * found.shift.deviation):.2g} m, a "
            f"drift above {max(_DRIFTED, factor * found.drift.deviation * length):.2g} m, a gain "
            f"above {100 * max(_FORCE_SHARE, factor * found.gain.deviation):.2g} %"
        )
        self._beyond_noise(name, "noise floor", "N", found.residual, stated)

    def _beyond_noise(self, name: str, what: str, unit: str, floor: float, stated: float) -> None:
        """Add a remark on the part of a floor beyond the stated noise, zero if not stated."""
        if stated and floor > _MORE_THAN_NOISE * stated:
            more = np.sqrt(floor**2 - stated**2)
            self._found.remarks.append(
                f"{name}: the {what} exceeds the stated noise of {stated:.2f} {unit}: run and "
                f"measurement differ by {more:.2f} {unit} beyond it"
            )

    # ---- figures --------------------------------------------------------------------------------

    def _force_figures(self, name: str, at: np.ndarray, force: np.ndarray, run: RunForce) -> None:
        """Mean, deviation and extremes of both forces over the same places, without gaps."""
        filtered = run.below(self._passage.cut_off)(run.position)
        own = filtered[_near_samples(run.position, at)]
        for label, key, of in (
            ("mean", "mean", np.mean),
            ("standard deviation", "std", np.std),
            ("maximum", "maximum", np.max),
            ("minimum", "minimum", np.min),
        ):
            values = float(of(own)), float(of(force))
            usual = 0.2 * values[1] if key == "std" else float("nan")
            if key == "std" and "std" in self._passage.tolerances:
                usual = self._passage.tolerances["std"] * values[1]
            self._figure(label, name, "N", key, values, usual)
        self._beyond_chance(name, at, force, run.below(self._passage.cut_off)(at))

    def _beyond_chance(
        self, name: str, at: np.ndarray, measured: np.ndarray, modelled: np.ndarray
    ) -> None:
        """Add remarks on the confidence of differences of mean and deviation, by the spread from
        span to span: samples within a span are correlated, spans hardly are."""
        masts = self._results.line("support_x")
        whole = masts[(masts >= at[0] - _NEAR_MAST) & (masts <= at[-1] + _NEAR_MAST)]
        first, second = (span_sums(at, force, whole) for force in (measured, modelled))
        for what, one in zip(
            STATISTICS, differences(first, second, paired=True) or (), strict=False
        ):
            chance = "more than chance" if one.is_certain else "within chance"
            self._found.remarks.append(
                f"{name}: {what}, run - measured, within {one.low:+.2f} to {one.high:+.2f} N with "
                f"a confidence of 95 %: {chance}"
            )

    def _heights(
        self, own: MeasuredForce, valid: np.ndarray, within: np.ndarray, at: np.ndarray, dt: float
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Heights of the head, measured and of the run, at the places that are compared."""
        name = self._names[own.pantograph]
        if own.head_height is None or not self._results.has("head_height"):
            return None
        known = ~np.isnan(own.head_height)
        height = self._without_gaps(own.head_height, name, "head height")
        chosen = self._passage.untouched(known, dt)[valid][within]
        if height is None or not chosen.any():
            text = (
                f"{name}: {np.sum(~known)} head heights are not numbers: heights are not compared"
            )
            self._find("gaps", name, text, float(np.sum(~known)))
            return None
        measured = np.where(chosen, self._passage.in_band(height, dt)[valid][within], np.nan)
        record = self._results.column("head_height", own.pantograph)
        position = self._run(own.pantograph).position
        return measured, RunForce(position, record, self._results.dt).below(self._passage.cut_off)(
            at
        )

    def _height_figures(
        self, name: str, measured: np.ndarray, run: np.ndarray, own: MeasuredForce, dt: float
    ) -> None:
        """The range of heights, and an error of their zero beyond the stated bias; where nothing
        was ``measured`` it is NaN."""
        known = np.isfinite(measured)
        measured, run = measured[known], run[known]
        difference = measured - run
        offset, rest = float(difference.mean()), float(difference.std())
        # As for forces: what remains is noise, with its correlation.
        n = difference.size / correlation_time(difference)
        if abs(offset) > max(_HEIGHT, np.sqrt(CERTAIN / n) * rest, _BIASES * own.height_bias):
            text = f"{name}: head heights are {1e3 * offset:+.1f} mm off the run's throughout"
            self._find("height", name, text, offset)
        self._found.remarks.append(f"{name}: noise floor of heights {1e3 * rest:.2f} mm")
        stated = 1e3 * self._passage.noise_in_band(own.height_noise, dt)
        self._beyond_noise(name, "noise floor of heights", "mm", 1e3 * rest, stated)
        values = 1e3 * float(np.ptp(run)), 1e3 * float(np.ptp(measured))
        key = "contact_height_range"
        self._figure("range of head height", name, "mm", key, values, 20.0, _WIDENED * 1e3 * rest)

    def _figure(
        self,
        label: str,
        name: str,
        unit: str,
        key: str,
        values: tuple[float, float],
        usual: float,
        noise: float = 0.0,
    ) -> None:
        """Add a figure (run, measured), judged by its tolerance; ``noise`` is what noise may add to
        the measured one."""
        given = self._passage.tolerances
        tolerance, source = usual, LINE_TEST
        if key in given:
            source = "description"
            tolerance = usual if key == "std" else given[key] * (1e3 if unit == "mm" else 1.0)
        run, measured = values
        passed, because = None, ""
        if np.isnan(tolerance):
            because = "no tolerance is known; the description may give one"
        elif abs(run - measured) <= tolerance:
            passed = True
        elif 0.0 < measured - run <= tolerance + noise:
            because = f"noise alone may add {noise:.3g} {unit} to the measured figure"
        else:
            passed = False
        self._found.figures.append(
            Compared(label, name, unit, run, measured, tolerance, passed, because, source)
        )

    # ---- the train, and supports ----------------------------------------------------------------

    def unmeasured(self) -> None:
        """Find pantographs of the run without a column in the description."""
        there = {one.pantograph for one in self._passage.forces}
        for number, name in enumerate(self._names):
            if number not in there:
                text = (
                    f"{name}: the run has this pantograph, and the description has no column of it"
                )
                self._find("missing pantograph", name, text)

    def uplifts(self, measured: MeasuredUplift) -> None:
        """Compare the largest uplifts at supports."""
        x = self._results.line("arm_x")
        uplift = self._results.extremes("arm_uplift")[1]
        begin, end = self._passage.stretch
        if not x.size or np.isnan(uplift).all():
            raise InputError(f"{self._results.path} has no record of uplifts at supports")
        nearest = np.abs(x[None, :] - measured.place[:, None]).argmin(axis=1)
        distance = measured.place - x[nearest]
        far = np.abs(distance) > _NEAR_SUPPORT
        if far.any():
            text = f"{far.sum()} of {far.size} supports of the uplifts stand at none of the run's"
            self._find("supports", "", text, float(far.sum()))
        near = ~far & in_stretch(x[nearest], begin, end) & np.isfinite(measured.largest)
        if not near.any():
            return
        off = float(np.median(distance[near]))
        if abs(off) > 1.0:
            text = f"supports of the uplifts stand {off:+.1f} m off the run's"
            self._find("supports", "", text, off)
        self._found.uplift = UpliftAtSupports(
            x[nearest[near]], measured.largest[near], uplift[nearest[near]]
        )
        difference = self._found.uplift.measured - self._found.uplift.run
        scatter = float(difference.std()) if difference.size > 2 else measured.noise
        self._found.remarks.append(
            f"uplift at {difference.size} supports: measured {1e3 * difference.mean():+.1f} mm "
            f"beyond the run's on average, scatter {1e3 * scatter:.1f} mm"
        )
        values = (
            1e3 * float(self._found.uplift.run.max()),
            1e3 * float(self._found.uplift.measured.max()),
        )
        noise = 3.0 * 1e3 * max(scatter, measured.noise)
        self._figure("largest uplift at supports", "", "mm", "uplift", values, 20.0, noise)


def _near_samples(position: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Which positions (n,) belong to samples at ascending places (m,), which are even but for
    gaps: from the first sample to the last those within half a step of one."""
    half = 0.5 * float(np.median(np.diff(at)))
    after = np.clip(np.searchsorted(at, position), 1, at.size - 1)
    distance = np.minimum(np.abs(position - at[after - 1]), np.abs(at[after] - position))
    # The middle of a step belongs to one sample or the other, whatever the rounding.
    near = distance <= half * (1.0 + 1e-6)
    return np.asarray((position >= at[0]) & (position <= at[-1]) & near)


def _errors_of(
    found: Alignment, name: str, run: RunForce, passage: Passage, bias: float
) -> Iterator[Finding]:
    """Errors of positions, of the force, and of the description's filter; ``bias`` is the stated
    deviation of a constant error of the force [N]."""
    if found.shift.differs(0.0, _SHIFT):
        shift, way = found.shift, "far along the track" if found.shift.value > 0 else "far back"
        by = f"{abs(shift.value):.2f} m too {way} (+- {shift.deviation:.2g} m)"
        text = f"{name}: positions are {by} at {found.middle:.0f} m"
        if passage.by_time:
            early = "ahead" if shift.value > 0 else "behind"
            text += f": the clock is {abs(shift.value) / run.speed:.3f} s {early}"
        yield Finding("shift", name, text, shift.value)
    length = found.length
    if found.drift.differs(0.0, _DRIFTED / length):
        drift = found.drift
        what = "clock or speed" if passage.by_time else "positions"
        by = f"{1e3 * drift.value:+.2f} in 1000 (+- {1e3 * drift.deviation:.2g})"
        over = f"{drift.value * length:+.2f} m over {length:.0f} m"
        text = f"{name}: {what} drift by {by}, {over}"
        yield Finding("drift", name, text, drift.value)
    mean = float(np.mean(run.below(passage.cut_off)(run.position)))
    if max(found.gain_certainty, found.offset_certainty) > CERTAIN and (
        abs(found.offset.value) > max(_FORCE_SHARE * mean, _BIASES * bias)
    ):
        yield Finding("gain", name, f"{name}: {_gain_words(found)}", found.gain.value)
    elif found.both_certainty > CERTAIN and found.gain_beside_offset.differs(1.0, _FORCE_SHARE):
        gain = found.gain_beside_offset
        text = (
            f"{name}: the measured force fluctuates {gain.value:.3f} (+- {gain.deviation:.2g}) "
            "times as much as that of the run"
        )
        yield Finding("gain", name, text, gain.value)
    spread = float(np.std(run.below(passage.cut_off)(run.position)))
    if found.filter_certainty > CERTAIN and found.filter_effect > _FILTER_SHARE * spread:
        taken = f"filtered at {passage.cut_off:g} Hz" if passage.is_filtered else "unfiltered"
        seems = "no filter" if found.filter is None else f"a filter of {found.filter:.3g} Hz"
        text = (
            f"{name}: the values seem to have passed {seems}, and are taken for {taken} "
            "(is_filtered and filter_Hz of a description)"
        )
        value = np.inf if found.filter is None else found.filter
        yield Finding("filter", name, text, float(value))


def _other_scale(force: np.ndarray, expected: np.ndarray) -> tuple[str, str] | None:
    """Kind of the error and a sentence, if a measured force (n,) has another sign or unit than that
    of the run in the same band, ``expected`` (m,) [N]."""
    mean, run = float(np.mean(force)), float(np.mean(expected))
    spread = float(np.std(force)), float(np.std(expected))
    if not (run > 0.0 and spread[1] > 0.0):
        return None
    ratios = np.array([abs(mean) / run, spread[0] / spread[1]])

    def alike(factor: float) -> bool:
        return bool(np.all((ratios > factor / _ALIKE) & (ratios < factor * _ALIKE)))

    shown = float(f"{mean:.4g}")  # no power of ten up to a million
    told = f"the measured force is {shown:g} N on average, and that of the run {run:.4g} N"
    factor = next((one for one in _UNITS if alike(one)), None)
    if factor is not None:
        return "unit", f"{told}: check the unit of its column, N or kN"
    if mean < 0.0 and alike(1.0):
        return "sign", f"{told}: a force counts positive where it presses on the wire"
    return None


def _gain_words(found: Alignment) -> str:
    """A gain, an offset, or both where the record does not tell them apart."""
    gain = f"a gain of {found.gain.value:.3f} (+- {found.gain.deviation:.2g})"
    offset = f"an offset of {found.offset.value:+.1f} N (+- {found.offset.deviation:.2g} N)"
    if abs(found.gain_certainty - found.offset_certainty) < CERTAIN / 2.0:
        return f"the measured force has {gain}, or {offset}"
    is_gain = found.gain_certainty > found.offset_certainty
    return f"the measured force has {gain if is_gain else offset}"
