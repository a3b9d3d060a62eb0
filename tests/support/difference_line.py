"""Simple lines under lumped pantographs by explicit finite differences, without the package.

Wires are rows of points ``h`` apart with lumped masses; tension and bending are central
differences, and so is time. Droppers and contacts are forces that are cut off at zero: there is no
system to be solved in a step, and no set of active contacts. Errors fall with h^2 and dt^2.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import signal, sparse
from scipy.sparse import linalg as sparse_linalg

GRAVITY = 9.81


@dataclass(frozen=True)
class Data:
    """A simple line and its train, in SI units; positions of droppers from the mast of each span.

    ``contact`` and ``messenger`` are tension, mass per length and bending stiffness; clamps are
    those on the messenger wire and on the contact wire; ``starts`` are places of pantographs.
    """

    contact: tuple[float, float, float]
    messenger: tuple[float, float, float]
    droppers: tuple[float, ...]
    pre_sag: tuple[float, ...]
    dropper_stiffness: float
    dropper_mass: float
    clamps: tuple[float, float]
    support: float
    arm: tuple[float, float, float, float]  # length, mass per length, clamp, stiffness
    encumbrance: float
    masses: tuple[float, ...]
    springs: tuple[float, ...]
    dampers: tuple[float, ...]
    static_force: float
    speed: float
    starts: tuple[float, ...]
    stretch: tuple[float, float]
    n_spans: int
    span: float = 55.0
    contact_stiffness: float = 5e4
    raise_time: float = 0.5
    alpha: float = 1e-4
    beta: float = 0.0125


@dataclass
class Found:
    """Time step [s], places and forces (n, pantographs) [m], [N], and largest uplift at arms of the
    stretch [m]."""

    dt: float
    place: np.ndarray
    force: np.ndarray
    uplift: float

    def statistics(self, stretch: tuple[float, float], p: int = 0) -> dict[str, float]:
        """Mean, deviation, maximum and minimum of a force below 20 Hz [N]."""
        filtered = self.filtered[:, p]
        place = self.place[:, p]
        own = filtered[(place >= stretch[0]) & (place <= stretch[1])]
        return {"mean_N": own.mean(), "std_N": own.std(), "max_N": own.max(), "min_N": own.min()}

    @property
    def filtered(self) -> np.ndarray:
        """Forces after the low-pass of EN 50317, forward and backward."""
        sections = signal.butter(6, 20.0, fs=1.0 / self.dt, output="sos")
        return signal.sosfiltfilt(sections, self.force, axis=0, padlen=int(0.3 / self.dt))


@dataclass
class DifferenceLine:
    """The line on a grid whose spacing divides all positions; the contact wire's points come
    first, the messenger wire's behind them."""

    data: Data
    h: float
    n: int = field(init=False)

    def __post_init__(self) -> None:
        data, h = self.data, self.h
        self.n = n = round(data.n_spans * data.span / h) + 1
        masts = data.span * np.arange(1, data.n_spans)
        at = (data.span * np.arange(data.n_spans)[:, None] + np.array(data.droppers)).ravel()
        self.low = np.rint(at / h).astype(int)
        assert np.allclose(self.low * h, at)
        self.arms = np.rint(masts / h).astype(int)
        m = len(at)
        each = np.arange(m)
        self.pull = sparse.csr_matrix(
            (np.repeat([-1.0, 1.0], m), (np.tile(each, 2), np.append(self.low, self.low + n))),
            shape=(m, 2 * n),
        )
        wires = sparse.block_diag([self._wire(*data.contact), self._wire(*data.messenger)])
        supports = np.zeros(2 * n)
        supports[n + self.arms] = data.support
        self.free = np.ones(2 * n)
        self.free[[0, n - 1, n, 2 * n - 1]] = 0.0
        standing = (wires + sparse.diags(supports)).tocsr()
        self._rest(standing, supports)
        stiffness = standing + data.dropper_stiffness * (self.pull.T @ self.pull)
        own = np.zeros(2 * n)
        own[self.arms] = data.arm[3]
        cut = sparse.diags(self.free)
        self.stiffness = (cut @ (stiffness + sparse.diags(own)) @ cut).tocsr()

    def _wire(self, tension: float, _: float, bending: float) -> sparse.csr_matrix:
        """T d2 and EI d4 by central differences, times h; both ends pinned."""
        n, h = self.n, self.h
        second = sparse.diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(n, n)).tolil()
        second[[0, -1]] = 0.0
        second = second.tocsr()
        inner = second.T  # a bent end has no curvature, so that no moment comes from there
        return (-tension / h * second + bending / h**3 * (inner @ second)).tocsr()

    def _rest(self, standing: sparse.csr_matrix, supports: np.ndarray) -> None:
        """Heights at rest above the contact wire's ends, tensions of droppers, moving masses."""
        data, n = self.data, self.n
        sag = -np.tile(data.pre_sag, data.n_spans)
        ends = np.flatnonzero(self.free == 0.0)
        given = np.append(self.low, ends)
        wanted = np.concatenate([sag, [0.0, 0.0, data.encumbrance, data.encumbrance]])
        pick = sparse.csr_matrix(
            (np.ones(given.size), (np.arange(given.size), given)), shape=(given.size, 2 * n)
        )
        acts = sparse.hstack([self.pull.T, -pick[len(sag) :].T])
        inside = sparse.diags(self.free)
        # Rows of ends say nothing but what holds them there.
        matrix = sparse.bmat([[inside @ standing, acts], [pick, None]]).tocsc()
        factor = sparse_linalg.splu(matrix)
        weight = np.repeat([data.contact[1], data.messenger[1]], n) * self.h
        length = np.full(len(sag), data.encumbrance)
        length_of_arm, mass_of_arm, clamp_of_arm, _ = data.arm
        rod = length_of_arm * mass_of_arm
        for _ in range(6):
            half = 0.5 * data.dropper_mass * length
            hung = weight.copy()
            hung[self.low] += half + data.clamps[1]
            hung[n + self.low] += half + data.clamps[0]
            self.mass = hung.copy()
            hung[self.arms] += rod / 2 + clamp_of_arm
            self.mass[self.arms] += rod / 3 + clamp_of_arm
            load = self.free * (supports * data.encumbrance - GRAVITY * hung)
            found = factor.solve(np.append(load, wanted))
            self.height, self.tension = found[: 2 * n], found[2 * n : 2 * n + len(sag)]
            length = self.pull @ self.height - self.tension / data.dropper_stiffness

    def nominal_height(self) -> float:
        """Mean height in a middle span of a head that presses with its static force [m]."""
        first = round(self.data.n_spans // 2 * self.data.span / self.h)
        nodes = np.arange(first, first + round(self.data.span / self.h) + 1)
        factor = sparse_linalg.splu((self.stiffness + sparse.diags(1.0 - self.free)).tocsc())
        lift = []
        for node in nodes:
            unit = np.zeros(2 * self.n)
            unit[node] = 1.0
            lift.append(factor.solve(unit)[node])
        height = self.height[nodes] + self.data.static_force * np.array(lift)
        return float(np.mean(0.5 * (height[1:] + height[:-1])))

    def _weights(self, x: float) -> tuple[slice, np.ndarray]:
        """Four points about a place, and the weights of Lagrange's cubic there."""
        s, first = x / self.h, int(x / self.h) - 1
        t = s - first
        numbers = np.array(
            [
                -(t - 1) * (t - 2) * (t - 3) / 6,
                t * (t - 2) * (t - 3) / 2,
                -t * (t - 1) * (t - 3) / 2,
                t * (t - 1) * (t - 2) / 6,
            ]
        )
        return slice(first, first + 4), numbers

    def run(self, dt: float) -> Found:
        """The train's way until its last pantograph leaves the stretch."""
        data, n = self.data, self.n
        k = np.array(data.springs)
        c = np.array(data.dampers)
        masses = np.array(data.masses)[:, None]
        # Stretch of each spring by the heights of its masses; the last one stands on the base.
        stretch = np.eye(len(k)) - np.eye(len(k), k=1)
        base = self.nominal_height() + data.static_force * sum(1.0 / k[:-1])
        lift = np.zeros((len(k), 1))
        x = np.array(data.starts)
        z = np.tile([self._at(place) for place in x], (len(k), 1))
        vz = vz_before = np.zeros_like(z)
        u = np.zeros(2 * n)
        v = v_before = np.zeros(2 * n)
        inverse = self.free / self.mass
        # The filter needs 0.3 s beyond the stretch.
        n_steps = int(((data.stretch[1] - x.min()) / data.speed + 0.3) / dt)
        force, place = np.zeros((2, n_steps, len(x)))
        arms = self.arms[
            (self.arms * self.h >= data.stretch[0]) & (self.arms * self.h <= data.stretch[1])
        ]
        uplift = 0.0
        for step in range(n_steps):
            time = step * dt
            # Velocities stand half a step back: those of now by extrapolation.
            now, now_z = 1.5 * v - 0.5 * v_before, 1.5 * vz - 0.5 * vz_before
            moved = u + data.alpha * now
            load = -(self.stiffness @ moved)
            tension = self.tension + data.dropper_stiffness * (self.pull @ moved)
            slack = np.minimum(tension, 0.0)
            load[self.low] -= slack
            load[n + self.low] += slack
            raised = 0.5 - 0.5 * np.cos(np.pi * min(time / data.raise_time, 1.0))
            lift[-1] = raised * data.static_force + k[-1] * base
            push = lift - stretch.T @ (k[:, None] * (stretch @ z) + c[:, None] * (stretch @ now_z))
            for p in range(len(x)):
                here = x[p] + data.speed * time
                at, weights = self._weights(here)
                wire = weights @ (self.height[at] + u[at])
                felt = data.contact_stiffness * max(z[0, p] - wire, 0.0)
                load[at] += felt * weights
                push[0, p] -= felt
                force[step, p], place[step, p] = felt, here
            v, v_before = v + dt * (inverse * load - data.beta * self.free * now), v
            u = u + dt * v
            vz, vz_before = vz + dt * push / masses, vz
            z = z + dt * vz
            if step % 10 == 0:
                uplift = max(uplift, float(u[arms].max()))
        return Found(dt, place, force, uplift)

    def _at(self, x: float) -> float:
        """Height of the contact wire at rest [m]."""
        at, weights = self._weights(x)
        return float(weights @ self.height[at])
