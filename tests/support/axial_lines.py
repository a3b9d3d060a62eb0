"""Small lines whose wires move along the track, and the energy of one as a second opinion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from small_lines import HANGING, WHOLE, bare_wires, en50318_line

from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.problem import Problem

AXIAL = frozenset({"axial_motion", "tensioners", "temperature"})
ALONG = WHOLE | AXIAL
HANGING_ALONG = HANGING | AXIAL
# EA of the wires [N].
OF_CONTACT_WIRE, OF_MESSENGER_WIRE = 18e6, 11.4e6


def with_stiffness(line: LineData) -> LineData:
    """The line with wires that stretch."""
    assert line.messenger_wire is not None
    return replace(
        line,
        contact_wire=replace(line.contact_wire, axial_stiffness=OF_CONTACT_WIRE),
        messenger_wire=replace(line.messenger_wire, axial_stiffness=OF_MESSENGER_WIRE),
    )


def elastic_line(n_spans: int) -> LineData:
    """The line of EN 50318 with wires that stretch."""
    return with_stiffness(en50318_line(n_spans))


def elastic_wires(length: float) -> LineData:
    """One span without droppers, of wires that stretch."""
    return with_stiffness(bare_wires(length))


# Gauss points and weights on [0, 1], exact for polynomials of degree 7.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_POINTS, _WEIGHTS = 0.5 * (_POINTS + 1.0), 0.5 * _WEIGHTS


class PotentialOfLine:
    """Potential energy of a simple line by its definition, of complex numbers too.

    Wires with one strain for each element, droppers of their true length between their ends,
    weights by what they hang on at the installation; no arms. ``z``, ``slope``, ``u`` (n_nodes,).
    """

    def __init__(self, problem: Problem, mesh: LineMesh, installed: Equilibrium) -> None:
        self._problem, self._mesh, self._installed = problem, mesh, installed

    def __call__(self, z: np.ndarray, slope: np.ndarray, u: np.ndarray) -> complex:
        line, mesh = self._problem.line, self._mesh
        energy: complex = 0.0
        for name in (CONTACT_WIRE, MESSENGER_WIRE):
            wire, pairs = line.wire(name), mesh.elements(name)
            h = np.diff(mesh.x(pairs), axis=1)[:, 0]
            was = self._installed.height, self._installed.slope
            grown = square_of_slope(h, z[pairs], slope[pairs])
            grown = grown - square_of_slope(h, was[0][pairs], was[1][pairs])
            assert wire.axial_stiffness is not None
            warmer = self._problem.along.warmer
            strain = np.diff(u[pairs], axis=1)[:, 0] / h + 0.5 * grown - wire.expansion * warmer
            energy += (h * (wire.tension + 0.5 * wire.axial_stiffness * strain) * strain).sum()
            bent = square_of_curvature(h, z[pairs], slope[pairs])
            energy += 0.5 * wire.bending_stiffness * (h * bent).sum()
            first, last = z[pairs].T
            turned = h * (slope[pairs[:, 0]] - slope[pairs[:, 1]]) / 12.0
            mean = 0.5 * (first + last) + turned
            energy += wire.mass_per_length * self._problem.gravity * (h * mean).sum()
        upper, lower = mesh.droppers.T
        length = np.sqrt((z[upper] - z[lower]) ** 2 + (u[upper] - u[lower]) ** 2)
        (group,) = line.droppers
        assert group.kind.stiffness is not None
        stretch = length - self._installed.dropper_length
        energy += (0.5 * group.kind.stiffness * stretch**2).sum()
        (supports,) = line.supports
        relaxed = line.wire(MESSENGER_WIRE).points(np.array(supports.x))[:, 2]
        energy += (0.5 * supports.stiffness * (z[mesh.supports] - relaxed) ** 2).sum()
        return energy


def square_of_slope(h: np.ndarray, z: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Mean of z'^2 over elements."""
    total = np.zeros(z.shape[:-1], dtype=np.result_type(z, slope))
    for s, weight in zip(_POINTS, _WEIGHTS, strict=True):
        shape = 6 * s * (s - 1) * (z[..., 0] - z[..., 1]) / h
        shape = shape + (1 - 4 * s + 3 * s * s) * slope[..., 0]
        shape = shape + (3 * s * s - 2 * s) * slope[..., 1]
        total = total + weight * shape**2
    return total


def square_of_curvature(h: np.ndarray, z: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Mean of z''^2 over elements."""
    total = np.zeros(z.shape[:-1], dtype=np.result_type(z, slope))
    for s, weight in zip(_POINTS, _WEIGHTS, strict=True):
        bend = (12 * s - 6) * (z[..., 0] - z[..., 1]) / h**2
        bend = bend + ((6 * s - 4) * slope[..., 0] + (6 * s - 2) * slope[..., 1]) / h
        total = total + weight * bend**2
    return total


def gradient_of(potential: PotentialOfLine, at: np.ndarray) -> np.ndarray:
    """First derivatives of the energy by heights, slopes and places, by complex steps."""
    slopes = np.empty(at.size)
    for i in range(at.size):
        moved = at.astype(complex)
        moved[i] += 1e-30j
        slopes[i] = potential(*np.split(moved, 3)).imag / 1e-30
    return slopes


def hessian_of(potential: PotentialOfLine, at: np.ndarray, delta: float = 1e-6) -> np.ndarray:
    """Second derivatives, by central differences of the first ones."""
    columns = []
    for i in range(at.size):
        ahead, behind = at.copy(), at.copy()
        ahead[i] += delta
        behind[i] -= delta
        change = gradient_of(potential, ahead) - gradient_of(potential, behind)
        columns.append(change / (2 * delta))
    return np.array(columns)


def line_of_few_droppers() -> LineData:
    """Two spans of one dropper, no arms."""
    line = elastic_line(2)
    return replace(
        line,
        dropper_positions=((25.0,),) * 2,
        pre_sag=((0.05,),) * 2,
        stagger=(0.0,) * 3,
        steady_arm=replace(line.steady_arm, stiffness=0.0),
    )
