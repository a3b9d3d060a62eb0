"""Energy of a small line in all three planes, and its rest by a dense Newton iteration of its own.

Wires have one strain for each element, in the vertical plane, in plan and in a curve; droppers and
steady arms the true length between their ends. Weights are what hangs on each node.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from axial_lines import square_of_curvature, square_of_slope

from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium

# Of a bar along itself [N/m].
BAR = 1e7
NAMES = ("w", "theta_y", "u", "v", "theta_z")


class SpatialLine:
    """Potential energy of a line of two wires, of complex numbers and many shapes at a time.

    ``model`` is of the line as it is now, ``first`` the rest for which it was cut under its loads,
    ``lengths`` (n_droppers,) what its droppers are cut to [m], ``sideways`` [N/m] by wire a load
    to the left.
    """

    def __init__(
        self,
        model: Model,
        first: Equilibrium,
        lengths: np.ndarray,
        sideways: dict[str, float] | None = None,
    ) -> None:
        self.model, self._first, self._lengths = model, first, lengths
        self._sideways = sideways or {}
        self.pulls: dict[int, float] = {}

    def __call__(self, place: np.ndarray) -> np.ndarray:
        """Energy of shapes (..., 5 n_nodes), which are heights, slopes and so on [J]."""
        model, first = self.model, self._first
        line, mesh, n = model.problem.line, model.mesh, model.mesh.n_nodes
        z, slope, u, y, turn = (place[..., k * n : (k + 1) * n] for k in range(5))
        assert first.lateral is not None
        energy = np.zeros(place.shape[:-1], dtype=place.dtype)
        for wire in line.wires:
            pairs = mesh.elements(wire.name)
            x = mesh.x(pairs)
            h, c = np.diff(x, axis=1)[:, 0], np.zeros(len(pairs))
            upright = twist = c
            if line.curve is not None:
                c, middle = (
                    line.curve.curvature_at(x.mean(axis=1)),
                    line.curve.share(x.mean(axis=1)),
                )
                # The part of 1/R across the canted plane.
                upright = np.abs(c) * np.sin(line.curve.tilt * middle)
                roll = np.sign(line.curve.curvature) * line.curve.tilt * line.curve.share(x)
                twist = np.diff(roll, axis=1)[:, 0] / h
            was = first.height, first.slope, first.lateral.y, first.lateral.slope
            grown = -2 * c * (_mean(h, y, turn, pairs) - _mean(h, was[2], was[3], pairs))
            was_z = _mean(h, was[0], was[1], pairs)
            grown = grown - 2 * upright * (_mean(h, z, slope, pairs) - was_z)
            grown = grown + _twisted(twist, h, (z, slope), (y, turn), pairs)
            grown = grown - _twisted(twist, h, was[:2], was[2:], pairs)
            for now, then in (((z, slope), was[:2]), ((y, turn), was[2:])):
                grown = grown + _both(square_of_slope, h, *now, pairs)
                grown = grown - _both(square_of_slope, h, *then, pairs)
            strain = (u[..., pairs[:, 1]] - u[..., pairs[:, 0]]) / h + 0.5 * grown
            strain = strain - wire.expansion * model.simulated.warmer
            axial = wire.axial_stiffness or 0.0
            energy += (h * (wire.tension + 0.5 * axial * strain) * strain).sum(axis=-1)
            bent = _both(square_of_curvature, h, z, slope, pairs)
            bent = bent + _both(square_of_curvature, h, y, turn, pairs)
            energy += 0.5 * wire.bending_stiffness * (h * bent).sum(axis=-1)
            blown = self._sideways.get(wire.name, 0.0)
            energy -= blown * (h * _mean(h, y, turn, pairs)).sum(axis=-1)
        every = np.arange(n)
        for number, name in enumerate(NAMES[:2]):
            weight = model.weight[model.dofs(every, name)]
            energy -= (weight * (z, slope)[number]).sum(axis=-1)
            if line.curve is not None:
                share = line.curve.sideways_pull_at(mesh.x(every))
                energy += (share * weight * (y, turn)[number]).sum(axis=-1)
        upper, lower = mesh.droppers.T
        gap = [part[..., upper] - part[..., lower] for part in (z, u, y)]
        stretch = np.sqrt(gap[0] ** 2 + gap[1] ** 2 + gap[2] ** 2) - self._lengths
        energy += (0.5 * model.dropper_stiffness * stretch**2).sum(axis=-1)
        (supports,) = line.supports
        relaxed = line.wire(supports.wire).points(np.array(supports.x))[:, 2]
        under = z[..., mesh.supports] - relaxed
        energy += (0.5 * supports.stiffness * under**2).sum(axis=-1)
        energy += self._of_arms(z, u, y)
        for node, pull in self.pulls.items():
            energy -= pull * u[..., node]
        return energy

    def _of_arms(self, z: np.ndarray, u: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Bars from the wire to hinges, which are where the arm is as it was hung."""
        (arms,), nodes = self.model.problem.line.steady_arms, self.model.mesh.steady_arms
        lateral = self._first.lateral
        assert lateral is not None
        pull = np.hypot(lateral.arm_force[:, 0], lateral.arm_force[:, 1])
        length, side, up = arms.kind.length, *(lateral.arm_force[:, :2] / pull[:, None]).T
        hinge = lateral.y[nodes] + length * side, self._first.height[nodes] + length * up
        far = (hinge[0] - y[..., nodes]) ** 2 + (hinge[1] - z[..., nodes]) ** 2
        stretch = np.sqrt(far + u[..., nodes] ** 2) - (length - pull / BAR)
        return np.asarray((0.5 * BAR * stretch**2).sum(axis=-1))

    def gradient(self, place: np.ndarray) -> np.ndarray:
        """First derivatives at shapes (..., m) by complex steps, shape as ``place``."""
        steps = place[..., None, :] + 1e-30j * np.eye(place.shape[-1])
        return np.asarray(self(steps).imag / 1e-30)

    def hessian(self, place: np.ndarray, delta: float = 1e-6) -> np.ndarray:
        """Second derivatives, by central differences of the first ones."""
        steps = delta * np.eye(place.size)
        return (self.gradient(place + steps) - self.gradient(place - steps)) / (2 * delta)

    def numbers(self) -> np.ndarray:
        """The model's numbers of a shape's parts, (m,)."""
        every = np.arange(self.model.mesh.n_nodes)
        return np.concatenate([self.model.dofs(every, name) for name in NAMES])

    def rest(self, start: np.ndarray, held: np.ndarray) -> np.ndarray:
        """The shape (m,) in which nothing is left of forces, but where it is ``held`` (m,) bool."""
        place, free, before = start.copy(), ~held, 0.0
        for _ in range(60):
            # A tangent is kept while it serves.
            if np.abs(slope := self.gradient(place)[free]).max() > 0.1 * before:
                matrix = self.hessian(place)[np.ix_(free, free)]
            before = np.abs(slope).max()
            step = np.linalg.solve(matrix, -slope)
            place[free] += step
            if np.abs(step).max() < 1e-11:
                return place
        raise AssertionError(f"Newton's method still moves by {np.abs(step).max():.1e} m")


def shape(form: Equilibrium) -> np.ndarray:
    """A shape of the energy's as form finding has it, (5 n_nodes,)."""
    assert form.lateral is not None
    along = form.along if form.along.size else np.zeros(form.height.size)
    return np.concatenate([form.height, form.slope, along, form.lateral.y, form.lateral.slope])


def _both(
    mean: Callable[..., np.ndarray],
    h: np.ndarray,
    course: np.ndarray,
    slope: np.ndarray,
    pairs: np.ndarray,
) -> np.ndarray:
    """A mean over elements of shapes (..., n_nodes), (..., n_elements)."""
    ends = [np.stack([part[..., pairs[:, k]] for k in (0, 1)], axis=-1) for part in (course, slope)]
    return mean(h, *ends)


def _twisted(
    twist: np.ndarray,
    h: np.ndarray,
    upright: tuple[np.ndarray, np.ndarray],
    level: tuple[np.ndarray, np.ndarray],
    pairs: np.ndarray,
) -> np.ndarray:
    """What (z' - p' y)^2 + (y' + p' z)^2 have beside z'^2 + y'^2, of means over elements."""
    z, y = (_mean(h, *plane, pairs) for plane in (upright, level))
    first, second = pairs.T
    rise, aside = ((part[..., second] - part[..., first]) / h for part, _ in (upright, level))
    return np.asarray(twist * (2.0 * (z * aside - y * rise) + twist * (z**2 + y**2)))


def _mean(h: np.ndarray, y: np.ndarray, turn: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Mean deflection of elements."""
    first, second = pairs.T
    return 0.5 * (y[..., first] + y[..., second]) + h / 12 * (turn[..., first] - turn[..., second])
