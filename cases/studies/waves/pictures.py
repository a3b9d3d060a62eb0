"""Waves as pictures: over place and time, in the frame of the train, over wavenumber."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from catenary.cases.studies.waves.seen import WavesSeen
from catenary.cases.studies.waves.theory import HIGHEST, WaveTheory
from catenary.postproc.report import figures

# Share of velocities that the scale of colours covers, and what is drawn of a spectrum [-].
_COVERED, _DECADES = 0.995, 4.0
# Wavenumbers that are drawn [rad/m]; most places and times in a picture.
_WIDEST, _MOST = 1.2, 1600


def space_time(seen: WavesSeen, theory: WaveTheory, supports: np.ndarray) -> Figure:
    """Velocity of the contact wire over place and time, with train, supports and wave speeds."""
    figure = figures.new_figure(6.4)
    axes = figure.add_subplot()
    _velocity(figure, axes, seen.x, seen.time, seen.velocity)
    for p in range(seen.position.shape[1]):
        label = "pantographs" if p == 0 else None
        axes.plot(seen.position[:, p], seen.time, color="black", linewidth=1.2, label=label)
    row = int(0.3 * seen.time.size)
    start, place = float(seen.time[row]), float(seen.position[row].max())
    for end, label in ((seen.x[-1], "wave speed of the contact wire"), (seen.x[0], None)):
        when = [start, start + abs(end - place) / theory.wave_speed]
        axes.plot([place, end], when, "--", color="black", linewidth=1.0, label=label)
    _supports(axes, supports)
    axes.set_xlim(seen.x[0], seen.x[-1])
    axes.set_ylim(seen.time[0], seen.time[-1])
    figures.tidy(axes, "place along the track [m]", "time [s]")
    figures.legend_above(axes)
    return figure


def train_frame(seen: WavesSeen, theory: WaveTheory, behind: float, ahead: float) -> Figure:
    """The same against the distance from the first pantograph."""
    figure = figures.new_figure(6.4)
    axes = figure.add_subplot()
    relative, velocity = seen.in_the_train(behind, ahead)
    _velocity(figure, axes, relative, seen.time, velocity)
    ahead_of = np.array([0.0, ahead])
    when = seen.time[0] + 0.3 * np.ptp(seen.time)
    axes.plot(
        ahead_of, when + ahead_of / (theory.wave_speed - theory.speed), "--", color=figures.GREY,
        linewidth=1.0, label="wave speed of the contact wire, ahead and behind",
    )  # fmt: skip
    behind_it = np.array([0.0, behind])
    axes.plot(
        -behind_it, when + behind_it / (theory.wave_speed + theory.speed), "--",
        color=figures.GREY, linewidth=1.0,
    )  # fmt: skip
    axes.set_xlim(-behind, ahead)
    axes.set_ylim(seen.time[0], seen.time[-1])
    figures.tidy(axes, "distance from the first pantograph [m]", "time [s]")
    figures.legend_above(axes)
    return figure


def wavenumbers(seen: WavesSeen, theory: WaveTheory) -> Figure:
    """Amplitude of the velocity over wavenumber and frequency, with the waves of theory."""
    figure = figures.new_figure(6.4)
    axes = figure.add_subplot()
    k, frequency, amplitude = seen.spectrum()
    near, low = np.abs(k) <= _WIDEST, frequency <= HIGHEST
    level = np.log10(np.maximum(amplitude[np.ix_(low, near)], 10.0**-_DECADES))
    image = axes.pcolormesh(
        k[near], frequency[low], level, cmap="Greys", shading="nearest", rasterized=True
    )
    figure.colorbar(image, ax=axes, label="log10 of the amplitude over the largest")
    if theory.bloch is not None:
        rows = theory.bloch.harmonics(share=0.2)
        rows = rows[(rows[:, 1] <= HIGHEST) & (np.abs(rows[:, 0]) <= _WIDEST)]
        for sign in (1.0, -1.0):
            axes.scatter(
                sign * rows[:, 0], rows[:, 1], s=2.0, color=figures.COLOURS[0], alpha=0.35,
                linewidths=0,
            )  # fmt: skip
        axes.plot([], [], ".", color=figures.COLOURS[0], label="waves of the periodic line")
    ends = np.array([0.0, _WIDEST])
    axes.plot(
        ends, theory.speed * ends / (2 * np.pi), color=figures.LIMIT, linewidth=1.0,
        label="what moves with the train",
    )  # fmt: skip
    for sign in (1.0, -1.0):
        axes.plot(
            sign * ends, theory.wave_speed * ends / (2 * np.pi), "--", color=figures.COLOURS[1],
            linewidth=1.0, label="contact wire as a string" if sign > 0 else None,
        )  # fmt: skip
    axes.set_xlim(-_WIDEST, _WIDEST)
    axes.set_ylim(0.0, HIGHEST)
    figures.tidy(axes, "wavenumber [rad/m], positive with the train", "frequency [Hz]")
    figures.legend_above(axes, 3)
    return figure


def _velocity(
    figure: Figure, axes: Axes, x: np.ndarray, time: np.ndarray, velocity: np.ndarray
) -> None:
    every = [max(1, -(-n // _MOST)) for n in velocity.shape]
    shown = velocity[:: every[0], :: every[1]]
    finite = np.abs(shown[np.isfinite(shown)])
    largest = float(np.quantile(finite, _COVERED)) if finite.size else 1.0
    image = axes.pcolormesh(
        x[:: every[1]], time[:: every[0]], shown, cmap="RdBu_r", vmin=-largest, vmax=largest,
        shading="nearest", rasterized=True,
    )  # fmt: skip
    figure.colorbar(image, ax=axes, label="velocity of the contact wire [m/s]")


def _supports(axes: Axes, supports: np.ndarray) -> None:
    for x in supports.tolist():
        axes.axvline(x, color=figures.LIGHT, linewidth=0.6, zorder=1)
