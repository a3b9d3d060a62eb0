"""Waves as pictures: in space and time, in the frame of the train, over wavenumber."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from catenary.cases.studies.waves.seen import EnergySeen, Transmitted, WavesSeen, places_of
from catenary.cases.studies.waves.theory import HIGHEST, WaveTheory
from catenary.postproc.report.pictures import figures

# Share of velocities that the scale of colours covers, and what is drawn of a spectrum [-].
_COVERED, _DECADES = 0.995, 4.0
# Lines of the wave speeds: of the wires, and of the fastest energy of the periodic line.
_DASHES = ("--", "-.", ":", (0, (6, 1, 1, 1, 1, 1)))
# Distance from the moving load up to which the mean energy is drawn [m].
_AROUND = 400.0
_MOST_SUPPORTS = 100
# Wavenumbers that are drawn [rad/m]; most places and times in a picture.
_WIDEST, _MOST = 1.2, 1600


@figures.own_style()
def space_time(
    seen: WavesSeen, theory: WaveTheory, supports: np.ndarray, what: str = "pantographs"
) -> Figure:
    """Velocity of the contact wire in space and time, with the course of the pantographs or of a
    force.

    Parameters
    ----------
    seen : motion of the wire
    theory : with the speeds of waves that are drawn
    supports : places of supports [m]
    what : name of what moves, for the legend
    """
    figure, axes = figures.panels(6.4)
    _velocity(figure, axes, seen.x, seen.time, seen.velocity)
    for p in range(seen.position.shape[1]):
        label = what if p == 0 else None
        axes.plot(seen.position[:, p], seen.time, color="black", linewidth=1.2, label=label)
    start, place = seen.source
    for number, (speed, label) in enumerate(theory.speeds()):
        for end in (seen.x[-1], seen.x[0]):
            axes.plot(
                [place, end], [start, start + abs(end - place) / speed],
                linestyle=_DASHES[number], color="black", linewidth=1.0,
                label=label if end == seen.x[-1] else None,
            )  # fmt: skip
    # So many that a picture of a long line would be grey are left out.
    for x in supports.tolist() if supports.size <= _MOST_SUPPORTS else ():
        axes.axvline(x, color=figures.LIGHT, linewidth=0.6, zorder=1)
    axes.set_xlim(seen.x[0], seen.x[-1])
    axes.set_ylim(seen.time[0], seen.time[-1])
    figures.tidy(axes, "position along the track [m]", "time [s]")
    figures.legend_above(axes, 3)
    return figure


@figures.own_style()
def train_frame(
    seen: WavesSeen, theory: WaveTheory, behind: float, ahead: float, what: str
) -> Figure:
    """Velocity of the contact wire over time and distance from the first pantograph.

    Parameters
    ----------
    seen : motion of the wire
    theory : with the wave speed that is drawn
    behind, ahead : distances that are shown [m]
    what : name of what distances count from, for the axis
    """
    figure, axes = figures.panels(6.4)
    relative, velocity = seen.in_the_train(behind, ahead)
    _velocity(figure, axes, relative, seen.time, velocity)
    when = seen.time[0] + 0.3 * np.ptp(seen.time)
    label = "wave speed of the contact wire, forward and backward"
    # What runs ahead more slowly than the train falls behind it, too.
    for speed in (theory.wave_speed - theory.speed, -theory.wave_speed - theory.speed):
        end = ahead if speed > 0.0 else -behind
        later = end / speed if speed else np.inf
        axes.plot(
            [0.0, end], [when, when + later], "--", color=figures.GREY, linewidth=1.0,
            label=label,
        )  # fmt: skip
        label = ""
    axes.set_xlim(-behind, ahead)
    axes.set_ylim(seen.time[0], seen.time[-1])
    figures.tidy(axes, f"distance from the {what} [m]", "time [s]", legend=True)
    return figure


@figures.own_style()
def wavenumbers(seen: WavesSeen, theory: WaveTheory, what: str = "train") -> Figure:
    """Amplitude of the velocity over wavenumber and frequency, with the waves of theory; ``what``
    names what moves."""
    figure, axes = figures.panels(6.4)
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
    if seen.position.shape[1]:
        axes.plot(
            ends, theory.speed * ends / (2 * np.pi), color=figures.LIMIT, linewidth=1.0,
            label=f"moving with the {what}",
        )  # fmt: skip
    for sign in (1.0, -1.0):
        axes.plot(
            sign * ends, theory.wave_speed * ends / (2 * np.pi), "--", color=figures.COLOURS[1],
            linewidth=1.0, label="contact wire as a string" if sign > 0 else None,
        )  # fmt: skip
    axes.set_xlim(-_WIDEST, _WIDEST)
    axes.set_ylim(0.0, HIGHEST)
    figures.tidy(axes, "wavenumber [rad/m], positive along the track", "frequency [Hz]")
    figures.legend_above(axes, 3)
    return figure


@figures.own_style()
def transmission(found: Transmitted) -> Figure:
    """Energy at two stations beyond a blow over frequency; pass bands are shaded."""
    figure, axes = figures.panels(4.2)
    for low, high in found.bands:
        axes.axvspan(low, high, color=figures.SHADE, zorder=0)
    for values, label, colour in (
        (found.first, "near the blow", figures.GREY),
        (found.second, f"{found.distance:.0f} m further", figures.COLOURS[0]),
    ):
        axes.semilogy(
            found.frequency, np.maximum(values, 1e-12), color=colour, linewidth=1.0, label=label
        )
    axes.set_xlim(0.0, HIGHEST)
    axes.set_ylim(1e-7, 2.0)
    figures.tidy(axes, "frequency [Hz], pass bands shaded", "energy over its largest [-]")
    figures.legend_above(axes, 2)
    return figure


@figures.own_style()
def energy_parts(energy: EnergySeen, seen: WavesSeen, what: str) -> Figure:
    """Energy ahead of and behind what moves, over time, and its mean over the distance from there.

    ``seen`` has the places of what moves; ``what`` is its name, for the axis.
    """
    figure, (over_time, over_place) = figures.panels(6.4, 2, 1)
    places = places_of(seen, energy.time)
    behind, between, ahead = energy.parts(places)
    labels = (
        ("behind", "between", "ahead")
        if seen.position.shape[1]
        else ("before the blow", "", "beyond the blow")
    )
    # Both halves are alike on both sides of a blow: the one drawn last lets the other be seen.
    looks = ((0, 2.4), (2, 1.2), (1, 1.0))
    parts = behind, between, ahead
    for part, label, (number, width) in zip(parts, labels, looks, strict=True):
        if label and part.any():
            over_time.plot(
                energy.time, part, color=figures.COLOURS[number], linewidth=width, label=label
            )
    over_time.plot(energy.time, energy.total, color="black", linewidth=0.9, label="whole line")
    over_time.set_ylim(bottom=0.0)
    figures.tidy(over_time, "time [s]", "energy of the line [J]", legend=True)
    relative, mean = energy.around(places.max(axis=1), _AROUND)
    over_place.semilogy(relative, np.maximum(mean, 1e-12), color=figures.COLOURS[0], linewidth=1.2)
    positive = mean[mean > 0.0]
    if positive.size:
        over_place.set_ylim(max(positive.min(), 1e-6 * positive.max()), 2.0 * positive.max())
    figures.tidy(over_place, f"distance from the {what} [m]", "mean energy [J/m]")
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
