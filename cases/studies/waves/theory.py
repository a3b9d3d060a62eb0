"""Theory of the waves of a scene: closed forms, the periodic line, its ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.sparse import linalg as sparse_linalg

from catenary.base.errors import InputError
from catenary.meshgen.slowest_wave import bends, slowest_wave_of
from catenary.meshgen.wires import Role
from catenary.postproc.evaluate.wording import wire_words
from catenary.postproc.report.pictures import figures
from catenary.solver.ends import SIDES
from catenary.solver.model.matrices import stiffness_matrix, whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.problem.ends import AbsorbingLayer, EndCondition, Periodic
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.elasticity import middle_span
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.waves.bloch import BlochWaves, bloch_waves, period_of
from catenary.solver.waves.reflection import EndReflection, end_reflection

# Forces are judged below this frequency (EN 50317) [Hz].
HIGHEST = 20.0
# Speeds that a picture shows at most.
MOST_SPEEDS = 4


@dataclass(frozen=True)
class WaveTheory:
    """Figures of a line under a train.

    Attributes
    ----------
    speed : of the train [m/s]
    wave_speed : slowest wave of the contact wire, sqrt(T / m) of a string [m/s]
    wires : name and slowest wave of all wires, sqrt(T / m) of strings [m/s]
    doppler : (c - v) / (c + v) [-]: an echo from ahead comes back with its frequency over this; NaN
        for a train that no wave of the wire outruns
    reflection : reflection coefficient of a stiff dropper on the contact wire,
        Z_m / (Z_c + Z_m) with impedances sqrt(T m); NaN for lines of more than two wires [-]
    amplification : reflection / doppler, by which an echo grows with each return [-]
    bloch : waves of the line as a periodic one, None if its spans are not alike
    why_not : why there are none, empty otherwise
    by_bending : whether the contact wire's waves are not those of a string
    """

    speed: float
    wave_speed: float
    wires: tuple[tuple[str, float], ...]
    doppler: float
    reflection: float
    amplification: float
    bloch: BlochWaves | None
    why_not: str
    by_bending: bool = False

    @property
    def _as(self) -> str:
        return "on its supports" if self.by_bending else "as a string"

    def speeds(self) -> list[tuple[float, str]]:
        """Speeds of waves [m/s] and what they are of: the wires, the periodic line up to 20 Hz."""
        # Wires of one speed, such as those of two tension sections, are one line in pictures.
        wires: dict[str, tuple[float, str]] = {}
        for name, speed in self.wires:
            words = f"{wire_words(name)} {self._as}"
            wires.setdefault(f"{speed:.6g}", (speed, words))
        found = list(wires.values())
        if self.bloch is not None:
            speed, at = self.bloch.fastest(HIGHEST)
            found.append((speed, f"greatest group velocity of the line ({at:.1f} Hz)"))
        return found[:MOST_SPEEDS]

    def bands(self) -> np.ndarray:
        """Pass bands, (n, 2) [Hz]."""
        return np.zeros((0, 2)) if self.bloch is None else self.bloch.pass_bands(HIGHEST)

    def outrunning(self) -> np.ndarray:
        """Ranges of frequency with a wave that is faster than the train, (n, 2) [Hz]."""
        waves = self.bloch
        if waves is None:
            return np.zeros((0, 2))
        faster = np.abs(waves.group_velocity) > self.speed
        inside = faster & (waves.frequency <= HIGHEST)
        found = np.sort(waves.frequency[inside])
        if not found.size:
            return np.zeros((0, 2))
        # Neighbours that are no further apart than waves of neighbouring phases are one range,
        # unless they lie in two pass bands.
        gap = max(0.1, float(np.abs(np.diff(waves.frequency, axis=0)).max()))
        band = np.searchsorted(self.bands()[:, 0], found, side="right")
        first = np.append(True, (np.diff(found) > gap) | (np.diff(band) > 0))
        return np.column_stack([found[first], found[np.append(first[1:], True)]])


def row_of(name: str, value: float, unit: str, meaning: str) -> dict[str, Any]:
    """A row of ``waves.csv``."""
    return {"name": name, "value": value, "unit": unit, "meaning": meaning}


def wave_theory(problem: Problem, rest: LineAtRest) -> WaveTheory:
    """Figures of a problem and its line at rest. Not collective."""
    contact = problem.line.wires_of(Role.CONTACT)[0]
    carriers = [wire for wire in problem.line.wires if wire.role is not Role.CONTACT]
    c, v = slowest_wave_of(problem.line, contact), problem.train.speed
    reflection = np.nan
    if len(carriers) == 1:
        z_m, z_c = (np.sqrt(wire.tension * wire.mass_per_length) for wire in (carriers[0], contact))
        reflection = float(z_m / (z_m + z_c))
    doppler = (c - v) / (c + v) if c > v else np.nan
    waves, why_not = None, ""
    try:
        waves = bloch_waves(period_of(rest.model, *middle_span(problem.line)), HIGHEST)
    except InputError as error:
        why_not = str(error)
    wires = tuple((wire.name, slowest_wave_of(problem.line, wire)) for wire in problem.line.wires)
    bent = bends(c, contact.tension, contact.mass_per_length)
    return WaveTheory(v, c, wires, doppler, reflection, reflection / doppler, waves, why_not, bent)


def first_band(model: Model, n_modes: int) -> tuple[float, float]:
    """Lowest and highest frequency of a line's first modes [Hz], undamped, all droppers taut.

    Not collective. From K x = omega^2 M x on the unknowns that are not held.
    """
    free = np.setdiff1d(np.arange(model.n_dofs), model.constrained)
    matrices = stiffness_matrix(model), whole_matrix(model, mass=1.0)
    stiffness, mass = (matrix[free][:, free].tocsc() for matrix in matrices)
    squares = sparse_linalg.eigsh(stiffness, n_modes, mass, sigma=0.0, return_eigenvectors=False)
    frequencies = np.sqrt(squares) / (2.0 * np.pi)
    return float(frequencies.min()), float(frequencies.max())


# Frequencies, and the least reflection that is drawn.
_FIRST, _STEP, _LEAST = 0.5, 0.05, 1e-5
# Of a layer, whose reflection changes within a tenth of a hertz beside the gaps between bands.
_STEP_OF_LAYER = 0.02
# Share of the energy that a line in the picture stands for.
_LITTLE = 0.02


def reflections_of(rest: LineAtRest) -> list[EndReflection]:
    """Reflection of both ends, start first, with the line's own damping from where they begin.

    None if the line's spans there are not alike. Not collective.
    """
    found = []
    for side, end in enumerate(rest.problem.ends):
        step = _STEP_OF_LAYER if isinstance(end, AbsorbingLayer) else _STEP
        frequency = np.arange(_FIRST, HIGHEST + 0.5 * step, step)
        try:
            found.append(end_reflection(rest.model, side, frequency))
        except InputError:
            return []
    return found


def reflection_rows(found: list[EndReflection], speed: float) -> list[dict[str, Any]]:
    """Figures of waves that outrun a train [m/s], none where no wave does."""
    rows = []
    for side, end in zip(SIDES, found, strict=False):
        of_what = f"reflected by the {side} of the line, of waves faster than the train"
        amplitude, energy = end.of_faster(speed), end.energy_of_faster(speed)
        rows += [
            row_of(f"{name}_{side}", value, "-", f"{what} {of_what}")
            for name, value, what in (
                ("largest_reflection", amplitude[0], "largest amplitude"),
                ("rms_reflection", amplitude[1], "root mean square amplitude"),
                ("largest_energy", energy[0], "largest share of the energy"),
                ("mean_energy", energy[1], "mean share of the energy"),
            )
            if np.isfinite(value)
        ]
    return rows


def curve_rows(found: list[EndReflection]) -> list[dict[str, Any]]:
    """Every wave that travels to an end, with its reflection."""
    return [
        {"end": side, "frequency_Hz": float(f), "group_velocity_m_per_s": float(v), "reflected": r}
        for side, end in zip(SIDES, found, strict=False)
        for f, speeds, shares in zip(end.frequency, end.group_velocity, end.reflected, strict=True)
        for v, r in zip(speeds.tolist(), shares.tolist(), strict=True)
        if np.isfinite(v)
    ]


@figures.own_style()
def draw_reflections(
    found: list[EndReflection], ends: tuple[EndCondition, EndCondition], speed: float
) -> Figure:
    """Reflection by both ends over frequency; waves faster than ``speed`` [m/s] are filled."""
    figure, axes = figures.panels(4.2)
    rings: dict[str, Any] = {"facecolors": "none", "linewidths": 0.5}
    for number, (side, end, kind) in enumerate(zip(SIDES, found, ends, strict=False)):
        frequency = np.broadcast_to(end.frequency[:, None], end.reflected.shape)
        there = np.isfinite(end.reflected)
        fast = there & (end.group_velocity > speed)
        shown = np.maximum(end.reflected, _LEAST)
        # The start is drawn larger, to be seen beneath an end that sends back as much.
        colour, marker, size = figures.COLOURS[number], "os"[number], (26.0, 6.0)[number]
        name = f"{side}, {_name(kind)}"
        label = f"{name}: waves faster than the train"
        for which, how in (
            (there & ~fast, rings | {"edgecolors": colour, "alpha": 0.6}),
            (fast, {"color": colour, "linewidths": 0, "label": label}),
        ):
            axes.scatter(frequency[which], shown[which], s=size, marker=marker, **how)
    axes.scatter([], [], s=8.0, edgecolors=figures.GREY, label="slower waves", **rings)
    axes.axhline(_LITTLE**0.5, color=figures.GREY, linewidth=0.8, linestyle="--", zorder=0)
    axes.annotate(
        f"{100.0 * _LITTLE:g} % of the energy reflected", (HIGHEST, _LITTLE**0.5), (-3.0, 2.0),
        textcoords="offset points", ha="right", va="bottom", fontsize="small", color=figures.GREY,
    )  # fmt: skip
    axes.set_yscale("log")
    axes.set_xlim(0.0, HIGHEST)
    axes.set_ylim(0.7 * _LEAST, 2.0)
    figures.tidy(axes, "frequency [Hz]", f"reflected amplitude [-], drawn from {_LEAST:g}")
    figures.legend_above(axes, 2)
    return figure


def _name(end: EndCondition) -> str:
    if isinstance(end, AbsorbingLayer):
        return f"layer of {end.n_spans} spans"
    return "periodic" if isinstance(end, Periodic) else "fixed"
