"""Waves that are seen in a run: motion of the contact wire, energy of the line, group velocities.

Motion in space and time, and over their frequencies, is found from snapshots of the uplift, and so
is the energy of the line ahead of its train, under it and behind it. Group velocities and pass
bands are measured from the signals that a blow sends along a line.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from catenary.base.errors import InputError
from catenary.cases.studies.waves.theory import HIGHEST, WaveTheory, row_of
from catenary.meshgen.mesh import DROPPERS
from catenary.postproc.film.film_data import FilmData, Snapshots
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.switching_links import some_of, switching_links
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.waves.bloch import BlochWaves
from catenary.solver.waves.excitation import Excitation, MovingForce

# Distance of points along the wire between which the motion is interpolated [m].
_STEP = 0.5
# Length of the stretches of line that energy is summed over [m].
STRETCH = 2.0
# Displacements of a node along x, y and z, and slopes of the latter two.
_ALONG_AXES, _SLOPES = ("u", "v", "w"), ("", "theta_z", "theta_y")
# Length beside an end of a window in which a spline still swings after the step there [m].
_FROM_END = 4.0
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


@dataclass(frozen=True)
class WavesSeen:
    """Motion of the contact wire at t times and n places.

    Attributes
    ----------
    time : (t,) at equal distances [s]
    x : (n,) at equal distances [m]
    uplift, velocity : (t, n) [m], [m/s]; the velocity at a time is that of the steps around it
    position : (t, p) of the pantographs, or of a force that moves; p = 0 for a blow [m]
    struck : place of a blow, NaN for all else [m]
    """

    time: np.ndarray
    x: np.ndarray
    uplift: np.ndarray
    velocity: np.ndarray
    position: np.ndarray
    struck: float = np.nan

    @property
    def source(self) -> tuple[float, float]:
        """Time [s] and place [m] at which the drawn waves begin: those of a blow, or of the first
        pantograph after three tenths of the run."""
        if not self.position.shape[1]:
            return float(self.time[0]), self.struck
        row = int(0.3 * self.time.size)
        return float(self.time[row]), float(self.position[row].max())

    def in_the_train(self, behind: float, ahead: float) -> tuple[np.ndarray, np.ndarray]:
        """Places relative to the first pantograph (m,) [m], and the velocity there (t, m) [m/s].

        NaN beyond the ends of the line.
        """
        relative = np.arange(-behind, ahead + _STEP, _STEP)
        rows = [
            np.interp(place + relative, self.x, row, left=np.nan, right=np.nan)
            for place, row in zip(self.position.max(axis=1), self.velocity, strict=True)
        ]
        return relative, np.array(rows)

    def spectrum(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Wavenumbers (k,) [rad/m], frequencies (f,) [Hz] and amplitudes (f, k) of the velocity.

        A wave exp(i (omega t - k x)) that runs with the train stands at positive k and omega. Both
        directions are tapered by Hann's window; the largest amplitude is 1.
        """
        taper = np.hanning(self.time.size)[:, None] * np.hanning(self.x.size)
        # The sign of k: numpy's transform is of exp(+i k x) where a wave has exp(-i k x).
        changed = np.fft.fft2(self.velocity * taper)
        frequency = np.fft.fftfreq(self.time.size, self.time[1] - self.time[0])
        k = -2 * np.pi * np.fft.fftfreq(self.x.size, _STEP)
        amplitude, order = np.abs(changed[frequency >= 0.0]), np.argsort(k)
        amplitude = amplitude[:, order]
        return k[order], frequency[frequency >= 0.0], amplitude / max(amplitude.max(), 1e-300)


def places_of(seen: WavesSeen, time: np.ndarray) -> np.ndarray:
    """Places of what moves at times (t,) [s], or that of a blow at all of them, (t, p) [m]."""
    if not seen.position.shape[1]:
        return np.full((time.size, 1), seen.struck)
    return np.column_stack([np.interp(time, seen.time, course) for course in seen.position.T])


# Takes a time [s], later than the one before, and the displacements of the nodes (n_nodes, 3) [m].
TakesMotion = Callable[[float, np.ndarray], None]


class WireMotion:
    """Collects what `WavesSeen` holds of a wire.

    Parameters
    ----------
    nodes, along : (n,) nodes of the wire in order of x, and their places [m]
    """

    def __init__(self, nodes: np.ndarray, along: np.ndarray) -> None:
        self._nodes, self._along = nodes, along
        self.x = np.arange(along[0], along[-1], _STEP)
        self._times: list[float] = []
        self._rows: list[np.ndarray] = []

    def add(self, time: float, moved: np.ndarray) -> None:
        """Add the motion of the nodes at a time, as `TakesMotion`."""
        self._times.append(time)
        row = np.interp(self.x, self._along, moved[self._nodes, 2])
        self._rows.append(row.astype(np.float32))

    def seen(
        self, position: Callable[[np.ndarray], np.ndarray], struck: float = np.nan
    ) -> WavesSeen:
        """Return all that was added; ``position`` gives the places (t, p) that move at times (t,).

        Raises
        ------
        InputError
            If it was not added at equal distances in time, or fewer than three times.
        """
        times = np.array(self._times)
        apart = np.diff(times)
        if times.size < 3 or np.ptp(apart) > 1e-6 * apart[0]:
            raise InputError("the run needs three snapshots or more at equal distances in time")
        uplift = np.array(self._rows)
        velocity = np.gradient(uplift, float(apart[0]), axis=0)
        return WavesSeen(times, self.x, uplift, velocity, position(times), struck)


def waves_seen(
    data: FilmData, snapshots: Snapshots, others: Sequence[TakesMotion] = ()
) -> WavesSeen:
    """The motion of the lowest contact wire in the snapshots of a run, which ``others`` see too.

    Not collective.

    Raises
    ------
    InputError
        If the snapshots are not at equal distances in time, or fewer than three.
    """
    nodes = data.lowest_contact_nodes()
    wire = WireMotion(nodes, data.points[nodes, 0])
    for number, time in enumerate(snapshots.times.tolist()):
        moved = snapshots.displacement(number)
        for take in (wire.add, *others):
            take(time, moved)
    if data.excitation is not None:
        return wire.seen(*course_of(data.excitation))
    return wire.seen(lambda times: data.position[[data.row_at(t) for t in times.tolist()]])


def course_of(excitation: Excitation) -> tuple[Callable[[np.ndarray], np.ndarray], float]:
    """Course of an excitation, as `WireMotion.seen` takes it: a blow stays at its place."""
    if isinstance(excitation, MovingForce):
        return lambda times: excitation.place(times)[:, None], np.nan
    return lambda times: np.zeros((times.size, 0)), excitation.at


@dataclass(frozen=True)
class EnergySeen:
    """Energy of the line relative to its rest, over t times and n stretches.

    Attributes
    ----------
    time : (t,) half way between snapshots [s]
    x : (n,) middles of the stretches [m]
    density : (t, n) kinetic and elastic, of all wires and of what hangs between them [J/m]
    """

    time: np.ndarray
    x: np.ndarray
    density: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """(t,) [J]."""
        return np.asarray(self.density.sum(axis=1) * STRETCH)

    def parts(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Energy behind, between and ahead of places that move (t, p) [m], (t,) each [J].

        Between are those from the last to the first of them; a single one has none. The stretch
        under a place is shared.
        """
        up_to = np.hstack([np.zeros((self.time.size, 1)), np.cumsum(self.density, axis=1)])
        ends = np.append(self.x - 0.5 * STRETCH, self.x[-1] + 0.5 * STRETCH)
        behind, before = (
            np.array([np.interp(at, ends, row) for at, row in zip(places, up_to, strict=True)])
            for places in (position.min(axis=1), position.max(axis=1))
        )
        return (
            behind * STRETCH, (before - behind) * STRETCH, (up_to[:, -1] - before) * STRETCH,
        )  # fmt: skip

    def within(self, moving: np.ndarray) -> EnergySeen:
        """The energy without that at the ends of a window, beyond which a line rests.

        It is held there where it was when the window went on, and snapshots show it at rest: the
        step between has no energy of waves. What is ``moving`` at each time, (t, 2), has a begin
        and an end [m].
        """
        left, right = self.x - 0.5 * STRETCH, self.x + 0.5 * STRETCH
        begin, end = moving[:, :1], moving[:, 1:]
        behind = (left < begin + _FROM_END) & (begin > left[0])
        ahead = (right > end - _FROM_END) & (end < right[-1] - STRETCH)
        return replace(self, density=np.where(behind | ahead, 0.0, self.density))

    def until(self, end: float) -> EnergySeen:
        """The energy between snapshots up to ``end`` [s]."""
        n = int(self.time.searchsorted(end - 0.5 * (self.time[1] - self.time[0]) + 1e-9))
        return replace(self, time=self.time[:n], density=self.density[:n])

    def around(self, place: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Distances from a place that moves (t,) [m], up to ``reach``, and the mean over time of
        the density there, (m,) each; NaN where the line never is."""
        relative = np.arange(-reach, reach + STRETCH, STRETCH)
        rows = [
            np.interp(at + relative, self.x, row, left=np.nan, right=np.nan)
            for at, row in zip(place.tolist(), self.density, strict=True)
        ]
        there = np.isfinite(rows)
        n = there.sum(axis=0)
        total = np.where(there, rows, 0.0).sum(axis=0)
        return relative, np.where(n > 0, total / np.maximum(n, 1), np.nan)


class EnergyMotion:
    """Collects the energy of a line from the motion of its nodes.

    Slopes are those of cubic splines through a wire's nodes. Between two snapshots the motion is
    their mean and the velocity their difference over the time between them: a wave of angular
    frequency w loses (w dt)^2 / 12 of its kinetic and (w dt)^2 / 4 of its elastic energy.

    Parameters
    ----------
    rest : the line
    nodes : (n_nodes,) for each node of its mesh, its number in the motion that is added
    """

    def __init__(self, rest: LineAtRest, nodes: np.ndarray | None = None) -> None:
        model, mesh = rest.model, rest.mesh
        self._nodes = np.arange(mesh.n_nodes) if nodes is None else nodes
        self._numbering = model.numbering
        self._pieces = [piece for name in mesh.wires for piece in mesh.pieces(name)]
        self._stiffness, self._mass = (
            whole_matrix(model, **kind).tocsr() for kind in ({"stiffness": 1.0}, {"mass": 1.0})
        )
        self._size, self._x = model.n_dofs, mesh.points[:, 0]
        edges = np.arange(self._x.min(), self._x.max() + STRETCH, STRETCH)
        self._middles = edges[:-1] + 0.5 * STRETCH
        place = np.zeros(model.n_dofs)
        for numbers in model.numbering.numbers.T:
            place[numbers[numbers >= 0]] = self._x[numbers >= 0]
        last = self._middles.size - 1
        self._stretch = np.clip(((place - edges[0]) // STRETCH).astype(int), 0, last)
        # Droppers and their bends: see `_switched`.
        table = switching_links(model, rest.form.dropper_force)
        owner = np.where(table.bent < 0, np.arange(table.bent.size), table.bent)
        mine = np.isin(owner, table.of_component(DROPPERS)) & ~table.is_dependent & ~table.broken
        self._links = some_of(table.arrays, mine & (table.arrays.law["released"] > 0.0))
        self._link_stretch = self._stretch[self._links.unknowns[:, 0]]
        self._before: tuple[float, np.ndarray] | None = None
        self._times: list[float] = []
        self._rows: list[np.ndarray] = []

    def add(self, time: float, moved: np.ndarray) -> None:
        """Add the motion of the nodes at a time, as `TakesMotion`."""
        now = moved[self._nodes]
        if self._before is not None:
            then, earlier = self._before
            self._times.append(0.5 * (then + time))
            self._rows.append(self._density(0.5 * (earlier + now), (now - earlier) / (time - then)))
        self._before = time, now

    def seen(self) -> EnergySeen:
        """Return all that was added."""
        return EnergySeen(np.array(self._times), self._middles, np.array(self._rows))

    def _density(self, moved: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        d, v = self._vector(moved), self._vector(velocity)
        energy = 0.5 * (d * (self._stiffness @ d) + v * (self._mass @ v))
        n = self._middles.size
        density = np.bincount(self._stretch, energy, n)
        density += np.bincount(self._link_stretch, self._switched(d), n)
        return density / STRETCH

    def _vector(self, moved: np.ndarray) -> np.ndarray:
        """Unknowns of the line whose nodes are displaced by ``moved``, (n_nodes, 3)."""
        vector, every = np.zeros(self._size), np.arange(len(moved))
        for name, slope, values in zip(_ALONG_AXES, _SLOPES, moved.T, strict=True):
            there = self._numbering.has(every, name)
            if there.any():
                vector[self._numbering.of(every[there], name)] = values[there]
            for nodes in self._pieces if slope in self._numbering.names else ():
                own = self._numbering.has(nodes, slope)
                steep = CubicSpline(self._x[nodes], values[nodes])(self._x[nodes], 1)
                vector[self._numbering.of(nodes[own], slope)] = steep[own]
        return vector

    def _switched(self, d: np.ndarray) -> np.ndarray:
        """Energy of droppers less k e^2 / 2, as they are slack or on another slope of their curve
        than at rest, by link and bend [J].

        A dropper of tension N at rest and stretch e beyond it has (N + k e)^2 / 2 k - N^2 / 2 k -
        N e, the last term being the work of the weights: k e^2 / 2 if it pulls, -N^2 / 2 k - N e if
        not.
        """
        unknowns, weights, law = self._links
        beyond = law["rest"] + law["stiffness"] * (weights * d[unknowns]).sum(axis=1)
        return -law["released"] * np.minimum(beyond, 0.0) ** 2 / (2.0 * law["stiffness"])


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
    branches = [_branch_of_fastest(waves, highest) for highest in _UP_TO]
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


def _branch_of_fastest(waves: BlochWaves, highest: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (n,), ascending [Hz], and group velocities [m/s] of the branch that has the
    fastest wave up to the frequency ``highest`` [Hz]."""
    speed = np.where(waves.frequency <= highest, np.abs(waves.group_velocity), 0.0)
    branch = int(speed.max(axis=0).argmax())
    order = np.argsort(waves.frequency[:, branch])
    velocity = np.maximum(np.abs(waves.group_velocity[order, branch]), 1e-3)
    return waves.frequency[order, branch], velocity
