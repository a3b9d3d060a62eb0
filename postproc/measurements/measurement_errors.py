"""Errors of a measurement that the alignment of its force with a run shows."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from catenary.postproc.measurements.alignment import CERTAIN, Alignment
from catenary.postproc.measurements.compared import Finding
from catenary.postproc.measurements.passage import Passage, RunForce

# Errors below these are of no account, however certain: of places [m], of the force as a share of
# its mean, of a filter as a share of the standard deviation.
SHIFT, DRIFTED, FORCE_SHARE, _FILTER_SHARE = 0.2, 0.1, 0.003, 0.03
# A constant of so many stated deviations is no error.
BIASES = 3.0
# Means and deviations of a measured force and of the run's differ by less than the first factor;
# by the others where one is in N and the other in kN.
_ALIKE, _UNITS = 3.0, (1e-3, 1e3)


def errors_of(
    found: Alignment, name: str, run: RunForce, passage: Passage, bias: float
) -> Iterator[Finding]:
    """Errors of positions, of the force, and of the description's filter. Not collective.

    Parameters
    ----------
    found : Alignment
        Alignment of the measured force.
    name : str
        Name of the pantograph.
    run : RunForce
        Its force in the run.
    passage : Passage
        The measured passage.
    bias : float
        Stated deviation of a constant error of the force [N].
    """
    if found.shift.differs(0.0, SHIFT):
        shift, way = found.shift, "far along the track" if found.shift.value > 0 else "far back"
        by = f"{abs(shift.value):.2f} m too {way} (+- {shift.deviation:.2g} m)"
        text = f"{name}: positions are {by} at {found.middle:.0f} m"
        if passage.by_time:
            early = "ahead" if shift.value > 0 else "behind"
            text += f": the clock is {abs(shift.value) / run.speed:.3f} s {early}"
        yield Finding("shift", name, text, shift.value)
    length = found.length
    if found.drift.differs(0.0, DRIFTED / length):
        drift = found.drift
        what = "clock or speed" if passage.by_time else "positions"
        by = f"{1e3 * drift.value:+.2f} in 1000 (+- {1e3 * drift.deviation:.2g})"
        over = f"{drift.value * length:+.2f} m over {length:.0f} m"
        text = f"{name}: {what} drift by {by}, {over}"
        yield Finding("drift", name, text, drift.value)
    mean = float(np.mean(run.below(passage.cut_off)(run.position)))
    if max(found.gain_certainty, found.offset_certainty) > CERTAIN and (
        abs(found.offset.value) > max(FORCE_SHARE * mean, BIASES * bias)
    ):
        yield Finding("gain", name, f"{name}: {_gain_words(found)}", found.gain.value)
    elif found.both_certainty > CERTAIN and found.gain_beside_offset.differs(1.0, FORCE_SHARE):
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


def other_scale(force: np.ndarray, expected: np.ndarray) -> tuple[str, str] | None:
    """Kind of the error and a sentence, if a force has another sign or unit than that of the run.

    Parameters
    ----------
    force : ndarray, shape (n,)
        Measured force [N].
    expected : ndarray, shape (m,)
        Force of the run in the same band [N].
    """
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
