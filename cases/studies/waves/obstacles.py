"""Reflection and transmission at the obstacles of a line, measured on a bench and by closed forms.

Each kind stands alone: a dropper with its clamps between two wires, a support, a steady arm, an
end, and a change from one wire of the line to the next one above.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from catenary.cases.studies.waves.bench import HALF, Bench, measured
from catenary.cases.studies.waves.theory import HIGHEST
from catenary.postproc.report.pictures import figures
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.waves.scattering import change_of_wire, scattered

# Frequencies at which obstacles are measured [Hz].
FREQUENCIES = np.arange(2.0, HIGHEST + 0.5, 0.5)
# Shares below these are compared with them and not with themselves, what comes back and what goes
# on: see `Result.error`.
LEAST = (0.01, 0.1)


class Obstacle(NamedTuple):
    """An obstacle as a bench, and the springs and masses that theory has of it.

    Attributes
    ----------
    name : in tables
    bench : it alone on its wires
    stiffness, mass : (n, n) between its wires [N/m], [kg]; not of an end or a change of wire
    """

    name: str
    bench: Bench
    stiffness: np.ndarray
    mass: np.ndarray


class Result(NamedTuple):
    """Shares of waves at an obstacle; f frequencies, n wires.

    Attributes
    ----------
    wires : names
    back, onward : (2, f, n, n) complex, measured and by theory: on the wire of the row, of a unit
        wave on that of the column
    """

    name: str
    wires: tuple[str, ...]
    frequency: np.ndarray
    back: np.ndarray
    onward: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """Difference of measured and theoretical shares, as complex numbers, (2, f, n, n) [-].

        Over the theoretical share, or over `LEAST`: an arm sends nothing back at its own frequency,
        and behind a support there is no wave to speak of.
        """
        pairs = zip((self.back, self.onward), LEAST, strict=True)
        return np.stack([np.abs(m - t) / np.maximum(np.abs(t), least) for (m, t), least in pairs])


def obstacles_of(rest: LineAtRest) -> list[Obstacle]:
    """The kinds of obstacle that the line of a problem has."""
    problem, line = rest.problem, rest.problem.line
    on = problem.effects
    found = []
    for number, group in enumerate(line.droppers):
        wires = line.wire(group.lower), line.wire(group.upper)
        mine = rest.mesh.dropper_group == number
        if not mine.any():
            continue
        length = float(np.median(rest.model.dropper_lengths[mine]))
        half = 0.5 * group.kind.mass_per_length * length if "dropper_mass" in on else 0.0
        clamps = [group.kind.lower_clamp_mass, group.kind.upper_clamp_mass]
        masses = [half + (clamp if "clamp_mass" in on else 0.0) for clamp in clamps]
        slopes = group.kind.slopes_at(np.array([length]))
        tension = np.median(rest.form.dropper_force[mine], keepdims=True)
        k = float(slopes.at(slopes.piece_under(tension)).slope[0])
        spring = replace(group.kind, stiffness=k, axial_stiffness=None, curve=None)
        part = replace(group, kind=spring, upper_x=(HALF,), lower_x=(HALF,))
        found.append(
            Obstacle(
                f"{group.name} ({length:.2f} m)", Bench(wires, (part,), length),
                k * np.array([[1.0, -1.0], [-1.0, 1.0]]), np.diag(masses),
            )
        )  # fmt: skip
    for support in line.supports:
        bench = Bench((line.wire(support.wire),), (replace(support, x=(HALF,)),))
        found.append(_alone(support.name, bench, support.stiffness, 0.0))
    for arms in line.steady_arms:
        kind = arms.kind
        moves = kind.mass_per_length * kind.length / 3.0 + kind.clamp_mass
        mass = moves if "arm_inertia" in on else 0.0
        # Of the first one, where each has its own.
        of_each = arms.vertical_stiffness(line.wire(arms.wire))
        stiffness = float(of_each[0]) if "arm_stiffness" in on and of_each.size else 0.0
        alone = replace(kind, stiffness=stiffness, by_radial_force=False)
        bench = Bench((line.wire(arms.wire),), (replace(arms, kind=alone, x=(HALF,)),))
        found.append(_alone(arms.name, bench, stiffness, mass))
    contact = line.wires[0]
    for above in line.wires[1:2]:
        name = f"from {contact.name} to {above.name}"
        found.append(_alone(name, Bench((contact,), beyond=above), 0.0, 0.0))
    found.append(_alone("end", Bench((contact,), ends=True), 0.0, 0.0))
    return found


def _alone(name: str, bench: Bench, stiffness: float, mass: float) -> Obstacle:
    return Obstacle(name, bench, np.array([[stiffness]]), np.array([[mass]]))


def result_of(obstacle: Obstacle, problem: Problem, frequency: np.ndarray = FREQUENCIES) -> Result:
    """Measure an obstacle and put theory beside it. Serial."""
    bench = obstacle.bench
    found = measured(bench, problem, frequency)
    omega, wires = found.omega, bench.wires
    if bench.ends:
        # Held, free to turn: the wave comes back turned over.
        back, onward = -np.ones((omega.size, 1, 1)), np.zeros((omega.size, 1, 1))
    elif bench.beyond is not None:
        returned, passed = change_of_wire(wires[0], bench.beyond, omega)
        back, onward = returned[:, None, None], passed[:, None, None]
    else:
        squares = (omega**2)[:, None, None]
        back, onward = scattered(wires, omega, obstacle.stiffness - squares * obstacle.mass)
    return Result(
        obstacle.name, tuple(wire.name for wire in wires), frequency,
        np.stack([found.back, back]), np.stack([found.onward, onward]),
    )  # fmt: skip


def as_rows(results: list[Result]) -> list[dict[str, Any]]:
    """A row for each obstacle, pair of wires and frequency: sizes of the shares, and the error."""
    names = ("back", "back_theory", "onward", "onward_theory")
    rows = []
    for result in results:
        error = 100.0 * result.error.max(axis=0)
        for j, i in np.ndindex(*result.back.shape[2:]):
            for f, frequency in enumerate(result.frequency.tolist()):
                shares = np.abs([*result.back[:, f, j, i], *result.onward[:, f, j, i]]).tolist()
                wires = {"wave_on": result.wires[i], "seen_on": result.wires[j]}
                row = {"obstacle": result.name, **wires, "frequency_Hz": frequency}
                row |= dict(zip(names, shares, strict=True))
                rows.append(row | {"error_percent": float(error[f, j, i])})
    return rows


@figures.own_style()
def picture(results: list[Result]) -> Figure:
    """Sizes of the shares over frequency: theory as lines, what is measured as dots."""
    figure = figures.new_figure(2.0 + 2.4 * ((len(results) + 1) // 2))
    panels = figure.subplots((len(results) + 1) // 2, 2, squeeze=False).ravel()
    for result, axes in zip(results, panels, strict=False):
        for number, (label, shares) in enumerate(_curves(result)):
            colour = figures.COLOURS[number % len(figures.COLOURS)]
            seen, expected = np.abs(shares)
            axes.plot(result.frequency, expected, color=colour, linewidth=1.0, label=label)
            axes.plot(result.frequency, seen, ".", color=colour, markersize=4.0)
        figures.tidy(
            axes, "frequency [Hz]; dots measured, lines theory", "share of the amplitude",
            result.name.replace("_", " "),
        )  # fmt: skip
        axes.set_ylim(0.0, 1.05 * max(1e-3, axes.get_ylim()[1]))
        axes.legend(frameon=False, fontsize="x-small", ncols=2)
    for axes in panels[len(results) :]:
        axes.set_visible(False)
    return figure


def _curves(result: Result) -> list[tuple[str, np.ndarray]]:
    """What a picture shows of an obstacle: label, and shares (2, f) measured and by theory.

    What an obstacle sends to another wire runs both ways alike.
    """
    curves = []
    for j, i in np.ndindex(*result.back.shape[2:]):
        wave, other = (result.wires[at].replace("_wire", "") for at in (i, j))
        if i != j:
            curves.append((f"{wave} to {other}", result.back[:, :, j, i]))
            continue
        curves.append((f"back, {wave}", result.back[:, :, i, i]))
        if result.onward[1, :, i, i].any():
            curves.append((f"onward, {wave}", result.onward[:, :, i, i]))
    return curves
