"""A chain tied to its base under a conductor rail, against a plain model by assumed modes.

The rail is a simply supported beam in sines, carried by springs and masses; chain, contact spring
and gravity stand beside it as dense matrices, and nothing of the program is used. The base is put
as `docs/pantographs.md` says, or as it stood before: then the chain starts pressed together.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
import pytest
from measuring import check, march
from scenes import load_scene, mesh_of, problem_of
from scipy import linalg, signal
from ts_alpha2 import TS_ALPHA2

import catenary

SPAN, N_SPANS, MASS, BENDING, TENSION = 8.5, 30, 7.1, 2.7e5, 100.0
SUPPORT, CLAMP, ALPHA, BETA = 6e5, 7.0, 1e-4, 0.0125
CHAIN = np.array([10.31, 6.15, 15.30]), (53415.8, 6754.2), (29.60, 0.20, 1.14)
FORCE, CONTACT, SPEED, START, RAISED = 110.0, 82300.0, 120.0 / 3.6, 17.0, 1.0
DT, N_MODES = 1e-3, 480
TIED, SOFT = 40687.0, 100.0


class Rail:
    """The rail in the modes of the beam on its supports."""

    def __init__(self) -> None:
        self.length = SPAN * N_SPANS
        self.k = np.arange(1, N_MODES + 1) * np.pi / self.length
        at = SPAN * np.arange(1, N_SPANS)
        sines = self._sines(at)
        free = self.k**2 * (TENSION + BENDING * self.k**2) / MASS
        squares, self.turn = linalg.eigh(
            np.diag(free) + SUPPORT * sines @ sines.T, np.eye(N_MODES) + CLAMP * sines @ sines.T
        )
        self.squares, self.damping = squares, BETA + ALPHA * squares
        # Heights at rest: supports are where the rail is at its height, as if they were rigid.
        weight = (
            -MASS
            * 9.81
            * np.sqrt(2.0 / (MASS * self.length))
            * ((1.0 - np.cos(self.k * self.length)) / self.k)
        )
        system = np.block([[np.diag(free), sines], [sines.T, np.zeros((at.size, at.size))]])
        self.rest = np.linalg.solve(system, np.append(weight, np.zeros(at.size)))[:N_MODES]

    def _sines(self, x: np.ndarray) -> np.ndarray:
        return np.sqrt(2.0 / (MASS * self.length)) * np.sin(np.outer(self.k, x))

    def shapes(self, x: np.ndarray) -> np.ndarray:
        """Modes at places (p,), (modes, p)."""
        return self.turn.T @ self._sines(x)

    def height(self, x: np.ndarray) -> np.ndarray:
        """At rest, over that of the supports [m]."""
        return self.rest @ self._sines(x)

    @property
    def span(self) -> np.ndarray:
        """Places in a span in the middle (200,) [m]."""
        return SPAN * (N_SPANS // 2) + SPAN * (np.arange(200) + 0.5) / 200

    @cached_property
    def give(self) -> float:
        """Mean lift of a span under a unit force [m/N]."""
        return float((self.shapes(self.span) ** 2 / self.squares[:, None]).sum(axis=0).mean())

    @cached_property
    def lifted(self) -> float:
        """Mean height of a span under the static force [m]."""
        return float(self.height(self.span).mean() + FORCE * self.give)


RAIL = Rail()


def history(base_stiffness: float, depth: float, rises: bool) -> tuple[np.ndarray, np.ndarray]:
    """Places and contact force of a march by average acceleration.

    ``depth`` [m] of the contact under which the static force is meant; ``rises`` is whether the
    base comes up with the lift, or stands from the start.
    """
    masses, springs, dampers = CHAIN
    stiff, damp = np.zeros((2, 3, 3))
    for matrix, values in ((stiff, (*springs, base_stiffness)), (damp, dampers)):
        for i, value in enumerate(values):
            matrix[i, i] += value
            if i < 2:
                matrix[i : i + 2, i : i + 2] += value * np.array([[0.0, -1.0], [-1.0, 1.0]])
    base = RAIL.lifted + depth + FORCE * sum(1.0 / k for k in springs)
    n = int(25 * SPAN / SPEED / DT)
    time = DT * np.arange(1, n + 1)
    x = START + SPEED * time
    shapes, heights = RAIL.shapes(x), RAIL.height(x)
    level = float(RAIL.height(np.array([START]))[0])
    part = np.where(time < RAISED, 0.5 * (1.0 - np.cos(np.pi * time / RAISED)), 1.0)
    rate = np.where(time < RAISED, 0.5 * np.pi / RAISED * np.sin(np.pi * time / RAISED), 0.0)
    half, square = 0.5 * DT, 0.25 * DT**2
    solid = np.linalg.inv(np.diag(masses) + half * damp + square * stiff)
    give = 1.0 / (1.0 + half * RAIL.damping + square * RAIL.squares)
    y, vy = np.full(3, level), np.zeros(3)
    pushed = np.zeros(3)
    pushed[2] = base_stiffness * ((level if rises else base) - level)
    ay = pushed / masses
    q, vq, aq = np.zeros((3, N_MODES))
    force = np.zeros(n)
    for i in range(n):
        y, vy = y + DT * vy + square * ay, vy + half * ay
        q, vq = q + DT * vq + square * aq, vq + half * aq
        stands = level + part[i] * (base - level) if rises else base
        moves = rate[i] * (base - level) if rises else 0.0
        pushed[2] = part[i] * FORCE + base_stiffness * stands + dampers[2] * moves
        ay = solid @ (pushed - stiff @ y - damp @ vy)
        aq = -give * (RAIL.damping * vq + RAIL.squares * q)
        shape = shapes[:, i]
        gap = y[0] + square * ay[0] - heights[i] - shape @ (q + square * aq)
        soft = square * (solid[0, 0] + shape @ (give * shape))
        force[i] = max(0.0, gap / (1.0 / CONTACT + soft))
        ay, aq = ay - force[i] * solid[:, 0], aq + force[i] * give * shape
        y, vy, q, vq = y + square * ay, vy + half * ay, q + square * aq, vq + half * aq
    return x, force


def judged(x: np.ndarray, force: np.ndarray) -> tuple[float, float, float]:
    """Mean, deviation below 20 Hz and share of losses from the tenth span on [N], [N], [-]."""
    below = signal.sosfiltfilt(signal.butter(6, 20.0, fs=1.0 / DT, output="sos"), force)
    inside = (x >= 10 * SPAN) & (x <= 22 * SPAN)
    return (
        float(force[inside].mean()),
        float(below[inside].std()),
        float((force[inside] == 0.0).mean()),
    )


@pytest.mark.parametrize("base_stiffness", [pytest.param(TIED, marks=pytest.mark.study), SOFT])
def test_the_force_under_a_rail_is_that_of_a_plain_model(base_stiffness: float) -> None:
    tied = base_stiffness == TIED
    springs = {"pantographs.tsg18f.stiffnesses_N_per_m": [53415.8, 6754.2, base_stiffness]}
    scene = catenary.load("conductor_rail").replace(springs, line={"n_spans": N_SPANS})
    found = catenary.run(scene).force.values[1:, 0]
    x, expected = history(base_stiffness, FORCE / CONTACT if tied else 0.0, tied)
    n = min(found.size, x.size)
    x, found, expected = x[:n], found[:n], expected[:n]
    print("mean, deviation, losses: {:.2f} N, {:.2f} N, {:.2%}".format(*judged(x, found)))
    inside = x >= 10 * SPAN
    # The modes left out give way by 2 L^3 / (3 pi^4 EI 480^3) = 4e-9 m/N, 0.2 % of a support's
    # 1.7e-6: what the force varies by is wrong by some of that at each support, and supports are
    # met one after the other. Half of the modes are wrong by eight times as much.
    off = (found - expected)[inside]
    check("rms difference [N]", off.std(), 0.0, within=0.01 * expected[inside].std())
    check("mean [N]", found[inside].mean(), expected[inside].mean(), within=0.01)


@pytest.mark.study
def test_what_a_chain_pressed_against_its_base_does_is_no_property_of_the_line() -> None:
    """Of a base that stands from the start the chain, 18 mm below it, gets 745 N at once, and
    nothing damps it: six times the deviation, and losses. Without the depth of the contact in its
    height a stiff base takes from the mean what 1.3 mm are to the springs in a row, the contact's
    and the rail's included."""
    depth = FORCE / CONTACT
    raised = judged(*history(TIED, depth, True))
    pressed = judged(*history(TIED, depth, False))
    lower = judged(*history(TIED, 0.0, True))
    soft = judged(*history(SOFT, 0.0, False))
    for name, row in (("raised", raised), ("pressed", pressed), ("low", lower), ("soft", soft)):
        print("{}: {:.2f} N, {:.2f} N, losses {:.2%}".format(name, *row))
    assert raised[2] == soft[2] == 0.0 and pressed[2] > 0.02
    assert pressed[1] > 5.0 * raised[1]
    series = 1.0 / (1.0 / TIED + sum(1.0 / k for k in CHAIN[1]) + 1.0 / CONTACT + RAIL.give)
    # Under a load that moves at 0.5 of its slowest wave the rail gives way by a quarter more, which
    # is 0.25 e / (e + 2e-4 m/N) of that.
    more = 0.25 * RAIL.give * series
    check("lost mean [N]", raised[0] - lower[0], series * depth, within=more * series * depth)
    check("means of both bases [N]", raised[0], soft[0], within=2.0)


@pytest.mark.study
def test_the_second_opinion_raises_the_base_as_well() -> None:
    """TSALPHA2 on line and chain as one system, which has its own equations of the chain.

    Both are of order 2: a step of 0.25 ms at 20 Hz is wrong by (w dt)^2 / 12 = 8e-5 of 120 N at
    most; pressed against a base that stands the chain is off by more than 100 N.
    """
    words = (
        "line.n_spans=12", "train.end_m=34", "train.raise_time_s=0.1", "evaluation.from_m=25",
        "evaluation.to_m=34", "numerics.dt_s=2.5e-4",
    )  # fmt: skip
    scene, found = load_scene("conductor_rail", words), []
    problem, mesh = problem_of(scene), mesh_of(scene)
    for scheme in ("one_solve", TS_ALPHA2):
        run = march(replace(problem, numerics=replace(problem.numerics, scheme=scheme)), mesh)
        found.append(run["contact_force"][:, 0])
    check("contact force [N]", found[1], found[0], within=0.02)
