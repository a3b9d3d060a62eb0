"""Reflection and transmission at the obstacles of a line, measured on a bench and by closed forms.

Each kind stands alone: a dropper with its clamps between two wires, a support, a steady arm, an
end, and a change from one wire of the line to the next one above.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.sparse.linalg import splu

from catenary.base.mpi import MPI
from catenary.cases.studies.waves.theory import HIGHEST
from catenary.meshgen.build import make_mesh
from catenary.meshgen.line import Droppers, Line, SteadyArms, Supports
from catenary.meshgen.wires import Conductor, Piece, Profile, Section, Wire
from catenary.postproc.report.pictures import figures
from catenary.solver.effects.build_model import build
from catenary.solver.integrators.line_integrator import make_line
from catenary.solver.model import beam
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Block, Model
from catenary.solver.model.partition import distribute
from catenary.solver.problem.problem import Damping, Numerics, Problem
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.waves.reflection import answer_of, change_of_wire, scattered

# Wire to both sides of the obstacle, and stations before and behind it [m].
HALF, STATION = 600.0, 60.0
# Elements are twice as long as what bends beside a stiff obstacle, sqrt(EI / T), in bounds [m].
_SHORTEST, _LONGEST = 0.1, 0.2
DT = 1e-3
# Length of the pulse in time, one standard deviation: a third of its largest spectrum at 20 Hz [s].
_PULSE = 0.012
# Signals are taken until a wave of the fastest wire has run so many halves: at 2.1 the first echo
# of an end is at a station.
_HALVES = 1.9
_KEPT = frozenset({"vertical", "dropper_mass", "clamp_mass", "arm_inertia", "arm_stiffness"})


Part = Droppers | SteadyArms | Supports


class Obstacle(NamedTuple):
    """An obstacle alone on its wires, its springs and masses in theory.

    Its bench is these wires with the obstacle at `HALF`, along which one pulse runs.

    Attributes
    ----------
    name : in tables
    wires : they are what waves run on, in this order
    stiffness, mass : (n, n) between its wires [N/m], [kg]; not of an end or a change of wire
    parts : groups of one member each that it is made of on the bench
    dropper_length : of the dropper, if it is one [m]
    beyond : conductor of the first wire beyond the obstacle, None for the same
    ends : whether the wires end at the obstacle, held
    """

    name: str
    wires: tuple[Wire, ...]
    stiffness: np.ndarray
    mass: np.ndarray
    parts: tuple[Part, ...] = ()
    dropper_length: float = 1.0
    beyond: Conductor | None = None
    ends: bool = False


def measured(
    obstacle: Obstacle, problem: Problem, frequency: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Run a pulse on each wire of the bench and measure reflected and transmitted waves. Serial.

    On each wire the incoming and the reflected pulse are measured before the obstacle, the
    transmitted one beyond it; windows in time separate them. As in the theory there is no damping,
    and droppers pull and push.

    Parameters
    ----------
    obstacle : with its wires
    problem : problem whose effects give masses and springs of the obstacle
    frequency : (f,) > 0 [Hz]

    Returns
    -------
    back, onward : (f, n, n) complex, as `reflection.scattered` returns them; onward is zero beyond
        an end
    omega : (f,) angular frequencies of the discrete motion, (2 / dt) tan(w dt / 2) for the angular
        frequency w and steps of average acceleration [1/s]
    """
    model = _model(obstacle, problem)
    n, f = len(obstacle.wires), frequency.size
    omega = 2 * np.pi * frequency
    seen = 2.0 / DT * np.tan(0.5 * omega * DT)
    back, onward = np.zeros((2, f, n, n), dtype=complex)
    delays = [answer_of(wire, seen).wavenumber * STATION for wire in obstacle.wires]
    beyond = [
        answer_of(obstacle.beyond or wire, seen).wavenumber * STATION for wire in obstacle.wires
    ]
    for struck in range(n):
        time, before, behind = _signals(obstacle, model, struck)
        change = np.exp(-1j * omega[:, None] * time)
        split = 2.0 * STATION / obstacle.wires[struck].wave_speed
        came = change @ np.where(time < split, before[struck], 0.0)
        for other in range(n):
            returned = change @ np.where(time < split, 0.0, before[other])
            late = np.exp(1j * (delays[struck] + delays[other]))
            back[:, other, struck] = returned / came * late
            if not obstacle.ends:
                late = np.exp(1j * (delays[struck] + beyond[other]))
                onward[:, other, struck] = change @ behind[other] / came * late
    return back, onward, seen


def _model(obstacle: Obstacle, problem: Problem) -> Model:
    """The obstacle on its bench as a model."""
    length = HALF if obstacle.ends else 2 * HALF
    masts = (0.0, length) if obstacle.ends else (0.0, HALF, length)
    wires = []
    for number, wire in enumerate(obstacle.wires):
        # Heights are of no effect, but droppers have a length.
        height = 5.0 + number
        piece = Piece(masts, (0.0,) * len(masts), (height,) * len(masts))
        level = Profile(
            height, masts, (0.0,) * len(masts), (Section((0.0, length), (0.0, length)),)
        )
        wires.append(Wire.of(wire, wire.name, wire.role, (piece,), level))
    line = Line(
        tuple(np.diff(masts).tolist()),
        (0, 0),
        "bench",
        tuple(wires),
        tuple(part for part in obstacle.parts if isinstance(part, Droppers)),
        tuple(part for part in obstacle.parts if isinstance(part, SteadyArms)),
        tuple(part for part in obstacle.parts if isinstance(part, Supports)),
    )
    bends = min(np.sqrt(wire.bending_stiffness / wire.tension) for wire in obstacle.wires)
    # A whole number of them up to the stations, too.
    a_station = round(STATION / float(np.clip(2.0 * bends, _SHORTEST, _LONGEST)))
    mesh = make_mesh(line, a_station * round(HALF / STATION))
    alone = replace(
        problem, line=line, damping=Damping(0.0, 0.0), effects=problem.effects & _KEPT, incidents=()
    )
    model = build(alone, mesh, np.full(mesh.droppers.shape[0], obstacle.dropper_length))
    if obstacle.beyond is not None:
        _change(model, obstacle.wires[0], obstacle.beyond)
    return model


def _change(model: Model, wire: Wire, beyond: Conductor) -> None:
    """Make a wire another one beyond the middle: its elements get the difference of both wires."""
    dofs, length = model.wire_elements(wire.name)
    there = model.mesh.x(model.mesh.elements(wire.name)).min(axis=1) > HALF - 1e-6
    dofs, length = dofs[there], length[there]
    mass = beam.mass(length, beyond.mass_per_length - wire.mass_per_length)
    stiffness = beam.stiffness(
        length, beyond.bending_stiffness - wire.bending_stiffness, beyond.tension - wire.tension
    )
    model.blocks.append(Block.of_elements(wire.name, dofs, mass, stiffness))


def _signals(
    obstacle: Obstacle, model: Model, struck: int
) -> tuple[np.ndarray, list[np.ndarray], list[np.ndarray]]:
    """Times (t,), and deflections (t,) of each wire at the stations before and behind."""
    displacement, velocity = _pulse(obstacle.wires[struck], model)
    factor = splu(whole_matrix(model, mass=1.0, held_diagonal=1.0))
    acceleration = factor.solve(-(whole_matrix(model, stiffness=1.0) @ displacement))
    rows = []
    for place in (HALF - STATION, HALF + STATION):
        nodes = [model.mesh.wires[wire.name] for wire in obstacle.wires]
        at = [own[np.argmin(np.abs(model.mesh.x(own) - place))] for own in nodes]
        rows.append(model.dofs(np.array(at)))
    beyond = [] if obstacle.beyond is None else [obstacle.beyond]
    lasts = _HALVES * HALF / max(wire.wave_speed for wire in [*obstacle.wires, *beyond])
    time = DT * np.arange(int(lasts / DT))
    found = np.empty((time.size, 2, len(obstacle.wires)))
    numerics = Numerics(DT, "one_solve", 0.25, 0.5, 1e-9, 1e-9, 1)
    line = make_line(MPI.COMM_SELF, model, distribute(model, 1, 0), numerics)
    try:
        line.start(displacement, velocity, acceleration)
        for number in range(time.size):
            if number:
                line.free_step()
            now = line.displacement
            found[number] = now[rows[0]], now[rows[1]]
    finally:
        line.destroy()
    before, behind = found.transpose(1, 2, 0)
    return time, list(before), list(behind)


def _pulse(wire: Wire, model: Model) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity of a pulse that runs towards the obstacle, and nowhere else.

    All its waves run one way, each with its own velocity: v = -i w(k) u.
    """
    nodes = model.mesh.wires[wire.name]
    x = model.mesh.x(nodes)
    start = HALF - 2.0 * STATION
    shape = np.exp(-0.5 * ((x - start) / (_PULSE * wire.wave_speed)) ** 2)
    k = 2 * np.pi * np.fft.rfftfreq(x.size, x[1] - x[0])
    omega = np.sqrt((wire.tension * k**2 + wire.bending_stiffness * k**4) / wire.mass_per_length)
    spectrum = np.fft.rfft(shape)
    vectors = []
    for wave in (spectrum, -1j * omega * spectrum):
        vector = np.zeros(model.n_dofs)
        vector[model.dofs(nodes)] = np.fft.irfft(wave, x.size)
        vector[model.dofs(nodes, "theta_y")] = np.fft.irfft(1j * k * wave, x.size)
        vector[model.constrained] = 0.0
        vectors.append(vector)
    return vectors[0], vectors[1]


# Frequencies at which obstacles are measured [Hz].
FREQUENCIES = np.arange(2.0, HIGHEST + 0.5, 0.5)
# Shares below these are compared with them and not with themselves, what comes back and what goes
# on: see `Result.error`.
LEAST = (0.01, 0.1)


class Result(NamedTuple):
    """Shares of waves at an obstacle; f frequencies, n wires.

    Attributes
    ----------
    name : name of the obstacle
    wires : names of the wires
    frequency : (f,) [Hz]
    back, onward : (2, f, n, n) complex amplitudes, measured and by theory, on the wire of the row,
        by a unit wave on that of the column
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
        part: Part = replace(group, kind=spring, upper_x=(HALF,), lower_x=(HALF,))
        springs = k * np.array([[1.0, -1.0], [-1.0, 1.0]])
        name = f"{group.name} ({length:.2f} m)"
        found.append(Obstacle(name, wires, springs, np.diag(masses), (part,), length))
    for support in line.supports:
        part = replace(support, x=(HALF,))
        found.append(_on_one(support.name, line.wire(support.wire), support.stiffness, 0.0, part))
    for arms in line.steady_arms:
        kind = arms.kind
        moves = kind.mass_per_length * kind.length / 3.0 + kind.clamp_mass
        mass = moves if "arm_inertia" in on else 0.0
        # Of the first one, where each has its own.
        of_each = arms.vertical_stiffness(line.wire(arms.wire))
        stiffness = float(of_each[0]) if "arm_stiffness" in on and of_each.size else 0.0
        alone = replace(kind, stiffness=stiffness, by_radial_force=False)
        part = replace(arms, kind=alone, x=(HALF,))
        found.append(_on_one(arms.name, line.wire(arms.wire), stiffness, mass, part))
    contact = line.wires[0]
    for above in line.wires[1:2]:
        change = _on_one(f"from {contact.name} to {above.name}", contact)
        found.append(change._replace(beyond=above))
    found.append(_on_one("end", contact)._replace(ends=True))
    return found


def _on_one(
    name: str, wire: Wire, stiffness: float = 0.0, mass: float = 0.0, *parts: Part
) -> Obstacle:
    return Obstacle(name, (wire,), np.array([[stiffness]]), np.array([[mass]]), parts)


def result_of(obstacle: Obstacle, problem: Problem, frequency: np.ndarray = FREQUENCIES) -> Result:
    """Measure the shares that an obstacle sends back and onward at each ``frequency`` (n,) [Hz], on
    the line of a ``problem``, and put theory beside them. Serial."""
    wires = obstacle.wires
    seen_back, seen_onward, omega = measured(obstacle, problem, frequency)
    if obstacle.ends:
        # Held, free to turn: the wave comes back turned over.
        back, onward = -np.ones((omega.size, 1, 1)), np.zeros((omega.size, 1, 1))
    elif obstacle.beyond is not None:
        returned, passed = change_of_wire(wires[0], obstacle.beyond, omega)
        back, onward = returned[:, None, None], passed[:, None, None]
    else:
        squares = (omega**2)[:, None, None]
        back, onward = scattered(wires, omega, obstacle.stiffness - squares * obstacle.mass)
    return Result(
        obstacle.name, tuple(wire.name for wire in wires), frequency,
        np.stack([seen_back, back]), np.stack([seen_onward, onward]),
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


_MARKS = "o^svxD"


@figures.own_style()
def picture(results: list[Result]) -> Figure:
    """Sizes of the shares over frequency: theory as lines, what is measured as marks."""
    n_rows = (len(results) + 1) // 2
    figure, grid = figures.panels(2.0 + 2.4 * n_rows, n_rows, 2, squeeze=False)
    panels = grid.ravel()
    for result, axes in zip(results, panels, strict=False):
        for number, (label, shares) in enumerate(_curves(result)):
            # Marks tell curves apart in black and white, too.
            how: Any = {"color": figures.COLOURS[number % len(figures.COLOURS)], "linewidth": 1.0}
            how |= {"marker": _MARKS[number % len(_MARKS)], "markersize": 4.0, "markevery": 2}
            seen, expected = np.abs(shares)
            axes.plot(result.frequency, expected, **(how | {"marker": ""}))
            axes.plot(result.frequency, seen, **(how | {"linestyle": ""}))
            axes.plot([], [], label=label, **how)
        figures.tidy(
            axes, "frequency [Hz]; marks measured, lines theory", "share of the amplitude",
            result.name.replace("_", " "),
        )  # fmt: skip
        # What nearly nothing passes stands clear of the axis.
        highest = 1.05 * max(1e-3, axes.get_ylim()[1])
        axes.set_ylim(-0.03 * highest, highest)
        axes.legend(frameon=False, fontsize="x-small", ncols=2)
    for axes in panels[len(results) :]:
        axes.set_visible(False)
    return figure


def _curves(result: Result) -> list[tuple[str, np.ndarray]]:
    """An obstacle in a picture: label, and shares (2, f) measured and by theory.

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
