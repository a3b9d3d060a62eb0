"""What closed forms and the periodic line say about the waves of a scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import linalg as sparse_linalg

from catenary.base.errors import InputError
from catenary.meshgen.slowest_wave import bends, slowest_wave_of
from catenary.meshgen.wires import Role
from catenary.solver.model.matrices import stiffness_matrix, whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.elasticity import middle_span
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.waves.bloch import BlochWaves, bloch_waves, period_of

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
    doppler : (c - v) / (c + v) [-]: an echo from ahead comes back with its frequency over this
    reflection : share of a wave on the contact wire that a stiff dropper sends back,
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
            words = f"{name.replace('_', ' ')} {self._as}"
            wires.setdefault(f"{speed:.6g}", (speed, words))
        found = list(wires.values())
        if self.bloch is not None:
            speed, at = self.bloch.fastest(HIGHEST)
            found.append((speed, f"fastest energy of the line ({at:.1f} Hz)"))
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
        # Neighbours that are no further apart than waves of neighbouring phases are one range.
        gap = max(0.1, float(np.abs(np.diff(waves.frequency, axis=0)).max()))
        first = np.append(True, np.diff(found) > gap)
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
    doppler = (c - v) / (c + v)
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
