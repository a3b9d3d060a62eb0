"""Vertical lines under lumped pantographs by explicit finite differences, without the package.

Wires are rows of points ``h`` apart with lumped masses; tension and bending are central
differences, and so is time. Droppers and contacts are forces that are cut off at zero: there is no
system to be solved in a step, and no set of active contacts. Errors fall with h^2 and dt^2.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from force_history import ForceHistory
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

GRAVITY = 9.81
# The line ahead of the waves does not move: beyond what is left of them there [m], which is looked
# at every so many steps over so long a way [m].
_AT_REST, _LOOK_EVERY, _WAY = 1e-13, 100, 8.0


@dataclass(frozen=True)
class Stitch:
    """Wires beside supports: length, tension, mass per length, bending stiffness, mass and
    stiffness of a clamp, in SI units."""

    length: float
    tension: float
    mass: float
    bending: float
    clamp: float
    clamp_stiffness: float = 1e7


@dataclass(frozen=True)
class Data:
    """A line and its train, in SI units; positions of droppers from the mast of each span.

    ``contact`` and ``messenger`` are tension, mass per length and bending stiffness; clamps are
    those on the upper wire and on the contact wire; ``starts`` are places of pantographs.
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
    stitch: Stitch | None = None


@dataclass
class DifferenceLine:
    """The line on a grid whose spacing divides all positions. Points are numbered along the track,
    those of the contact wire, the messenger wire and the stitch wire of a place one after another;
    ``at`` (wires, n) has their numbers, -1 where a wire is not."""

    data: Data
    h: float
    at: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        data, h = self.data, self.h
        n = round(data.n_spans * data.span / h) + 1
        self.arms = np.rint(data.span * np.arange(1, data.n_spans) / h).astype(int)
        places = (data.span * np.arange(data.n_spans)[:, None] + np.array(data.droppers)).ravel()
        hung = np.rint(places / h).astype(int)
        assert np.allclose(hung * h, places)
        # Whether each segment and each point belongs to a stitch wire.
        stitched, inner = np.zeros(n - 1, dtype=bool), np.zeros(n, dtype=bool)
        half = 0 if data.stitch is None else round(0.5 * data.stitch.length / h)
        for arm in self.arms if half else ():
            stitched[arm - half : arm + half] = True
            inner[arm - half + 1 : arm + half] = True
        there = np.ones((3, n), dtype=bool)
        there[2] = np.append(stitched, False) | np.insert(stitched, 0, False)
        self.at = np.full((3, n), -1)
        self.at.T[there.T] = np.arange(there.sum())
        self.size = int(there.sum())
        self.low, self.up = self.at[0, hung], self.at[np.where(there[2, hung], 2, 1), hung]
        self.pull = self._differences(self.up, self.low)
        tension, mass, bending = data.contact
        standing = self._wire(0, np.full(n - 1, tension), np.full(n, bending))
        self.mass = np.zeros(self.size)
        self.mass[self.at[0]] = mass * h
        tension, mass, bending = data.messenger
        tensions = np.full(n - 1, tension)
        self.mass[self.at[1]] = mass * h
        if data.stitch is not None:
            own = data.stitch
            # Between its clamps the stitch wire carries its tension in place of the messenger wire.
            tensions[stitched] -= own.tension
            standing += self._wire(2, own.tension * stitched, own.bending * inner)
            ends = np.concatenate([self.arms - half, self.arms + half])
            clamps = self._differences(self.at[1, ends], self.at[2, ends])
            standing += own.clamp_stiffness * (clamps.T @ clamps)
            self.mass[self.at[2, inner]] = own.mass * h
            self.mass[self.at[2, ends]] = 0.5 * (own.mass * h + own.clamp)
            self.mass[self.at[1, ends]] += 0.5 * own.clamp
        standing += self._wire(1, tensions, np.full(n, bending))
        self.supports = np.zeros(self.size)
        self.supports[self.at[1, self.arms]] = data.support
        standing += sparse.diags(self.supports)
        self.free = np.ones(self.size)
        self.ends = self.at[:2, [0, -1]].ravel()
        self.free[self.ends] = 0.0
        self._rest(standing.tocsr())
        stiffness = standing + data.dropper_stiffness * (self.pull.T @ self.pull)
        held = np.zeros(self.size)
        held[self.at[0, self.arms]] = data.arm[3]
        cut = sparse.diags(self.free)
        self.stiffness = (cut @ (stiffness + sparse.diags(held)) @ cut).tocsr()

    def _differences(self, plus: np.ndarray, minus: np.ndarray) -> sparse.csr_matrix:
        """A row for each pair of points: by how much the first is higher."""
        rows = np.tile(np.arange(plus.size), 2)
        signs = np.repeat([1.0, -1.0], plus.size)
        return sparse.csr_matrix(
            (signs, (rows, np.append(plus, minus))), shape=(plus.size, self.size)
        )

    def _wire(self, wire: int, tension: np.ndarray, bending: np.ndarray) -> sparse.csr_matrix:
        """T d2 and EI d4 of a wire by central differences, times h, of the tension of each segment
        and the bending stiffness of each point; ends carry no moment."""
        at, h = self.at[wire], self.h
        segments, points = np.flatnonzero(tension), 1 + np.flatnonzero(bending[1:-1])
        slopes = self._differences(at[segments + 1], at[segments])
        bends = self._differences(at[points + 1], at[points])
        bends -= self._differences(at[points], at[points - 1])
        stretched = slopes.T @ sparse.diags(tension[segments] / h) @ slopes
        return (stretched + bends.T @ sparse.diags(bending[points] / h**3) @ bends).tocsr()

    def _rest(self, standing: sparse.csr_matrix) -> None:
        """Heights at rest above the contact wire's ends, tensions of droppers, moving masses."""
        data = self.data
        sag = -np.tile(data.pre_sag, data.n_spans)
        given = np.append(self.low, self.ends)
        wanted = np.concatenate([sag, [0.0, 0.0, data.encumbrance, data.encumbrance]])
        pick = sparse.csr_matrix(
            (np.ones(given.size), (np.arange(given.size), given)), shape=(given.size, self.size)
        )
        acts = sparse.hstack([self.pull.T, -pick[len(sag) :].T])
        inside = sparse.diags(self.free)
        # Rows of ends say nothing but what holds them there.
        matrix = sparse.bmat([[inside @ standing, acts], [pick, None]]).tocsc()
        factor = sparse_linalg.splu(matrix)
        wires = self.mass
        length = np.full(len(sag), data.encumbrance)
        length_of_arm, mass_of_arm, clamp_of_arm, _ = data.arm
        rod, arms = length_of_arm * mass_of_arm, self.at[0, self.arms]
        for _ in range(6):
            half = 0.5 * data.dropper_mass * length
            hung = wires.copy()
            hung[self.low] += half + data.clamps[1]
            hung[self.up] += half + data.clamps[0]
            self.mass = hung.copy()
            hung[arms] += rod / 2 + clamp_of_arm
            self.mass[arms] += rod / 3 + clamp_of_arm
            load = self.free * (self.supports * data.encumbrance - GRAVITY * hung)
            found = factor.solve(np.append(load, wanted))
            self.height, self.tension = found[: self.size], found[self.size :][: len(sag)]
            length = self.pull @ self.height - self.tension / data.dropper_stiffness

    def nominal_height(self) -> float:
        """Mean height in a middle span of a head that presses with its static force [m]."""
        first = round(self.data.n_spans // 2 * self.data.span / self.h)
        nodes = self.at[0, first : first + round(self.data.span / self.h) + 1]
        factor = sparse_linalg.splu((self.stiffness + sparse.diags(1.0 - self.free)).tocsc())
        lift = []
        for node in nodes:
            unit = np.zeros(self.size)
            unit[node] = 1.0
            lift.append(factor.solve(unit)[node])
        height = self.height[nodes] + self.data.static_force * np.array(lift)
        return float(np.mean(0.5 * (height[1:] + height[:-1])))

    def _weights(self, x: float) -> tuple[np.ndarray, np.ndarray]:
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
        return self.at[0, first : first + 4], numbers

    def run(self, dt: float, ahead: float = 0.5) -> ForceHistory:
        """The train's way until its last pantograph leaves the stretch.

        Velocities of the line, which stand half a step back, are extrapolated by ``ahead`` steps:
        half a step is exact to dt^2, none is stable with twice the damping of the shortest waves.
        """
        data = self.data
        k, c = np.array(data.springs), np.array(data.dampers)
        masses = np.array(data.masses)[:, None]
        # Stretch of each spring by the heights of its masses; the last one stands on the base.
        stretch = np.eye(len(k)) - np.eye(len(k), k=1)
        stiff, damp = stretch.T @ (k[:, None] * stretch), stretch.T @ (c[:, None] * stretch)
        base = self.nominal_height() + data.static_force * sum(1.0 / k[:-1])
        lift = np.zeros((len(k), 1))
        x = np.array(data.starts)
        z = np.tile([self._at(place) for place in x], (len(k), 1))
        vz = vz_before = np.zeros_like(z)
        # The filter needs 0.3 s beyond the stretch.
        n_steps = int(((data.stretch[1] - x.min()) / data.speed + 0.3) / dt)
        force, place = np.zeros((2, n_steps, len(x)))
        arms = self.arms[
            (self.arms * self.h >= data.stretch[0]) & (self.arms * self.h <= data.stretch[1])
        ]
        arms, highest = self.at[0, arms], np.zeros(arms.size)
        # Displacement, its last change, ``ahead`` of the change before, and dt^2 / mass; of the
        # moving part of the line, up to ``front`` [m].
        every = [np.zeros(self.size), np.zeros(self.size), np.zeros(self.size)]
        inverses, front, m = dt**2 * self.free / self.mass, float(x.max()), 0
        for step in range(n_steps):
            time = step * dt
            if step % _LOOK_EVERY == 0 and m < self.size:
                nearly = self._points_up_to(front - _WAY)
                # A pantograph that does not touch yet moves nothing.
                is_near = float(x.max()) + data.speed * time > front - 2.0 * _WAY
                if step == 0 or is_near or np.abs(every[0][nearly:m]).max() > _AT_REST:
                    front += 3.0 * _WAY
                    m = self._points_up_to(front)
                    matrix = self.stiffness[:m, :m].todia()
                    u, change, share = (whole[:m] for whole in every)
                    inverse, new_share = inverses[:m], np.empty(m)
                    now, moved = np.empty(m), np.empty(m)
                    n_hung = int(np.searchsorted(np.maximum(self.low, self.up), m))
                    low, up, rest = self.low[:n_hung], self.up[:n_hung], self.tension[:n_hung]
            np.multiply(change, ahead, out=new_share)
            np.add(change, new_share, out=now)
            now -= share
            share[:] = new_share
            np.multiply(now, data.alpha / dt, out=moved)
            moved += u
            pushed = matrix @ moved
            tension = rest + data.dropper_stiffness * (moved[up] - moved[low])
            if tension.min() < 0.0:
                slack = np.minimum(tension, 0.0)
                pushed[low] += slack
                pushed[up] -= slack
            raised = 0.5 - 0.5 * np.cos(np.pi * min(time / data.raise_time, 1.0))
            lift[-1] = raised * data.static_force + k[-1] * base
            push = lift - stiff @ z - damp @ (1.5 * vz - 0.5 * vz_before)
            for p in range(len(x)):
                here = x[p] + data.speed * time
                at, weights = self._weights(here)
                wire = weights @ (self.height[at] + u[at])
                felt = data.contact_stiffness * max(z[0, p] - wire, 0.0)
                pushed[at] -= felt * weights
                push[0, p] -= felt
                force[step, p], place[step, p] = felt, here
            pushed *= inverse
            change -= pushed
            now *= data.beta * dt
            change -= now
            u += change
            vz, vz_before = vz + dt * push / masses, vz
            z = z + dt * vz
            if step % 10 == 0:
                np.maximum(highest, every[0][arms], out=highest)
        return ForceHistory(dt, place, force, float(highest.max()))

    def _points_up_to(self, x: float) -> int:
        """How many points there are up to a place."""
        n = self.at.shape[1]
        last = int(x / self.h)
        return self.size if last >= n else int(self.at[:, : last + 1].max()) + 1

    def _at(self, x: float) -> float:
        """Height of the contact wire at rest [m]."""
        at, weights = self._weights(x)
        return float(weights @ self.height[at])
