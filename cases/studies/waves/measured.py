"""Group velocities and pass bands measured from the signals that a blow sends along a line."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from catenary.cases.studies.waves.seen import WavesSeen
from catenary.cases.studies.waves.theory import HIGHEST, WaveTheory, row_of
from catenary.solver.waves.bloch import BlochWaves

# A band is so many widths to both sides, and lies within a branch [-]; its largest width [Hz].
_WIDTHS, _WIDEST = 4.0, 0.2
# Narrower bands last too long [Hz]; a record has so many deviations of a signal in time behind its
# centre [-].
_NARROWEST, _LATE = 0.03, 1.3
# Share of a record, at its end, over which a signal is let fade before its spectrum is taken.
_FADED = 0.25
# The fastest waves up to these frequencies are measured [Hz].
_UP_TO = (0.5 * HIGHEST, HIGHEST)
# Spans from the blow to the first station, least spans from there to the second, and which share of
# the line between blow and end lies before the second.
_FIRST, _APART, _SHARE = 2, 3, 0.5


class Arrived(NamedTuple):
    """Signals of two stations in a band of frequencies.

    Attributes
    ----------
    velocity : distance over the time between the centres of their energies [m/s]
    frequency : (f,) of the band [Hz]
    weight : (f,) share of each frequency in the energy of the first signal
    """

    velocity: float
    frequency: np.ndarray
    weight: np.ndarray

    def expected(self, frequency: np.ndarray, velocity: np.ndarray) -> float:
        """Distance over mean travel time of the band, given group velocities (n,) [m/s] at
        ascending frequencies (n,) [Hz]."""
        slowness = 1.0 / np.interp(self.frequency, frequency, velocity)
        return float(1.0 / (self.weight @ slowness))


def arrived(
    time: np.ndarray, first: np.ndarray, second: np.ndarray, distance: float, frequency: float,
    width: float,
) -> Arrived:  # fmt: skip
    """Speed of the energy in a band of frequencies from one station to another.

    The centre of energy of a signal in time is the mean of its group delays, each frequency by its
    share of the energy: whatever the phases are.

    Parameters
    ----------
    time : (t,) at equal distances [s]
    first, second : (t,) signals of a wave that passes both once
    distance : from the first to the second [m]
    frequency, width : middle of the band and its width (one standard deviation) [Hz]
    """
    # The band's filter reaches as far back as forth: there is room before the record, and behind.
    n = time.size
    padded, at = 3 * n, (time[1] - time[0]) * np.arange(-n, 2 * n)
    nu = np.fft.rfftfreq(padded, time[1] - time[0])
    band = np.exp(-0.5 * ((nu - frequency) / width) ** 2)
    spectra = [np.fft.rfft(np.pad(signal, n)) * band for signal in (first, second)]
    centres = []
    for spectrum in spectra:
        whole = np.zeros(padded, dtype=complex)
        whole[: nu.size] = spectrum
        energy = np.abs(np.fft.ifft(whole)) ** 2
        centres.append(float(at @ energy / energy.sum()))
    weight = np.abs(spectra[0]) ** 2
    inside = np.abs(nu - frequency) < _WIDTHS * width
    weight = weight[inside]
    velocity = distance / (centres[1] - centres[0])
    return Arrived(velocity, nu[inside], weight / weight.sum())


def measured_rows(
    theory: WaveTheory, seen: WavesSeen, spectrum: Transmitted | None
) -> list[dict[str, Any]]:
    """Group velocities of the waves of a blow beside those of the periodic line, as rows of
    ``waves.csv``.

    ``theory`` is that of the line, ``seen`` the motion after the blow, ``spectrum`` the spectra at
    two stations. Signals are taken until an end of the line may send waves back to a station. There
    are no rows without a blow, periodic line or room for two stations, nor where a band has not
    passed both by then.
    """
    waves, columns = theory.bloch, _stations(theory, seen)
    if waves is None or columns is None:
        return []
    signals = [seen.velocity[:, column].astype(float) for column in columns]
    distance = float(seen.x[columns[1]] - seen.x[columns[0]])
    reach = float(seen.x[columns[1]] - seen.struck)
    way_back = min(
        seen.struck + seen.x[columns[0]] - 2.0 * seen.x[0],
        2.0 * seen.x[-1] - seen.struck - seen.x[columns[1]],
    )
    rows = []
    if spectrum is not None:
        note = (
            f"share of the energy that has come {distance:.0f} m further which lies in the pass "
            "bands of the periodic line"
        )
        rows.append(row_of("energy_in_pass_bands", spectrum.inside, "-", note))
    branches = [branch_of_fastest(waves, highest) for highest in _UP_TO]
    if np.array_equal(branches[0][0], branches[1][0]):
        del branches[1:]  # one has the fastest wave of all
    for number, (frequency, velocity) in enumerate(branches, start=1):
        at, wide = 0.5 * (frequency[0] + frequency[-1]), frequency[-1] - frequency[0]
        width = min(_WIDEST, float(wide) / (2.2 * _WIDTHS))
        slowest = velocity[np.abs(frequency - at) < _WIDTHS * width].min()
        time = seen.time[seen.time - seen.time[0] < way_back / velocity.max()]
        if width < _NARROWEST:
            continue
        centre = reach / float(np.interp(at, frequency, velocity))
        late = max(reach / slowest, centre + _LATE / (2.0 * np.pi * width))
        if late > (1.0 - _FADED) * np.ptp(time):
            continue
        first, second = (signal[: time.size] * _fade(time.size) for signal in signals)
        found = arrived(time, first, second, distance, float(at), width)
        what = f"around {at:.1f} Hz over {distance:.0f} m"
        name, theirs = f"group_velocity_{number}", found.expected(frequency, velocity)
        rows += [
            row_of(name, found.velocity, "m/s", f"group velocity measured {what}"),
            row_of(f"{name}_theory", theirs, "m/s", f"group velocity of the periodic line {what}"),
        ]
    return rows


class Transmitted(NamedTuple):
    """Spectra of the velocity at two stations, the second one further from a blow.

    Attributes
    ----------
    frequency : (f,) up to 20 Hz [Hz]
    first, second : (f,) energy at both stations, each relative to its largest [-]
    bands : (n, 2) pass bands of the periodic line [Hz]
    inside : share of the energy at the second station that lies in them, widened by what the record
        resolves [-]
    distance : from the first station to the second one [m]
    """

    frequency: np.ndarray
    first: np.ndarray
    second: np.ndarray
    bands: np.ndarray
    inside: float
    distance: float


def transmitted(theory: WaveTheory, seen: WavesSeen) -> Transmitted | None:
    """Spectra of the motion ``seen`` at two stations after a blow, with the pass bands of
    ``theory``; None without a blow, periodic line or room."""
    columns = _stations(theory, seen)
    if columns is None:
        return None
    n = seen.time.size
    fade = _fade(n)
    step = float(seen.time[1] - seen.time[0])
    frequency = np.fft.rfftfreq(4 * n, step)
    chosen = frequency <= HIGHEST
    first, second = (
        np.abs(np.fft.rfft(seen.velocity[:, column] * fade, 4 * n)[chosen]) ** 2
        for column in columns
    )
    frequency, bands, wide = frequency[chosen], theory.bands(), 1.0 / (n * step)
    within = np.zeros(frequency.size, dtype=bool)
    for low, high in bands:
        within |= (frequency > low - wide) & (frequency < high + wide)
    inside = float(second[within].sum() / second.sum())
    distance = float(seen.x[columns[1]] - seen.x[columns[0]])
    return Transmitted(
        frequency, first / first.max(), second / second.max(), bands, inside, distance
    )


def _fade(n: int) -> np.ndarray:
    """Factors (n,) that let a record fade: motion that goes on at its end would spill over all
    frequencies."""
    fade, late = np.ones(n), max(1, int(_FADED * n))
    fade[-late:] = 0.5 * (1.0 + np.cos(np.pi * np.arange(late) / late))
    return fade


def _stations(theory: WaveTheory, seen: WavesSeen) -> tuple[int, int] | None:
    """Columns of two places whole spans of a periodic line beyond a blow; None without these, or
    without room."""
    if theory.bloch is None or seen.position.shape[1]:
        return None
    length = theory.bloch.length
    n = int(_SHARE * (seen.x[-1] - seen.struck) // length) - _FIRST
    if n < _APART:
        return None
    first, second = (
        int(np.argmin(np.abs(seen.x - (seen.struck + spans * length))))
        for spans in (_FIRST, _FIRST + n)
    )
    return first, second


def branch_of_fastest(waves: BlochWaves, highest: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (n,), ascending [Hz], and group velocities [m/s] of the branch that has the
    fastest wave up to the frequency ``highest`` [Hz]."""
    speed = np.where(waves.frequency <= highest, np.abs(waves.group_velocity), 0.0)
    branch = int(speed.max(axis=0).argmax())
    order = np.argsort(waves.frequency[:, branch])
    velocity = np.maximum(np.abs(waves.group_velocity[order, branch]), 1e-3)
    return waves.frequency[order, branch], velocity
