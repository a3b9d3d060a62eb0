"""The lumped pantograph alone: exact oscillations, static force, energy."""

from __future__ import annotations

import numpy as np
import pytest
from measuring import check, orders, print_table
from scipy import linalg

from catenary.mbs.head.stepping import Stepping
from catenary.mbs.lumped import LumpedData, LumpedPantograph

EPS = np.finfo(float).eps
# EN 50318:2002 (two masses) and the benchmark of ten codes, 2015 (three masses).
TWO_MASSES = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0))
THREE_MASSES = LumpedData((7.5, 9.0, 6.0), (7000.0, 15500.0, 160.0), (45.0, 0.1, 100.0))
NOMINAL = 5.5


def energy(data: LumpedData, base: float, pantograph: LumpedPantograph) -> float:
    """Kinetic energy, and elastic energy of all springs of a chain over a base at rest [J]."""
    stretches = np.diff(np.append(pantograph.position, base))
    elastic = np.dot(data.stiffnesses, stretches**2)
    return 0.5 * float(np.dot(data.masses, pantograph.velocity**2) + elastic)


@pytest.mark.parametrize("damping", [0.0, 30.0], ids=["undamped", "damped"])
def test_one_mass_moves_like_the_exact_oscillator(damping: float) -> None:
    """m z'' + c z' + k (z - z_s) = 0, z_s = nominal height + lift / k, let go at rest.

    z - z_s = y exp(-d t) (cos(w t) + d / w sin(w t)), d = c / (2 m), w^2 = k / m - d^2.
    """
    mass, stiffness, lift, duration = 12.0, 600.0, 90.0, 2.0
    data = LumpedData((mass,), (stiffness,), (damping,))
    start = NOMINAL + 0.05
    settled = NOMINAL + lift / stiffness
    decay = damping / (2 * mass)
    omega = np.sqrt(stiffness / mass - decay**2)
    errors, steps = [], [8e-3, 4e-3, 2e-3, 1e-3]
    for dt in steps:
        pantograph = LumpedPantograph(data, lift, NOMINAL, Stepping(raise_time=0.0, dt=dt))
        pantograph.place(start)
        t = dt * np.arange(1, round(duration / dt) + 1)
        heads = []
        for now in t:
            heads.append(pantograph.predict(now).height[0])
            pantograph.advance(np.array([0.0]))
        swing = np.cos(omega * t) + decay / omega * np.sin(omega * t)
        exact = settled + (start - settled) * np.exp(-decay * t) * swing
        errors.append(float(np.abs(np.array(heads) - exact).max()))
    observed = print_table("largest error [m], expected order 2", steps, errors)
    # The next term is smaller by (omega dt)^2.
    within = np.log2(1 + stiffness / mass * steps[-2] ** 2)
    check("order", observed[-1], 2, within=within)
    if not damping:
        # The period is too long by (omega dt)^2 / 12: the phase error grows to omega T times that.
        phase = (omega * steps[-1]) ** 2 / 12 * omega * duration
        check(
            "largest error [m]",
            errors[-1],
            abs(start - settled) * phase,
            within=abs(start - settled) * phase / (omega * duration),
        )


@pytest.mark.parametrize(
    ("gamma", "beta", "theory"), [(0.5, 0.25, 2), (0.6, 0.3025, 1)], ids=["average", "damping"]
)
def test_several_masses_follow_the_matrix_exponential(
    gamma: float, beta: float, theory: int
) -> None:
    """The whole state under a constant contact force, first-order system solved exactly."""
    data, lift, force, duration = THREE_MASSES, 120.0, 80.0, 0.5
    mass = np.diag(data.masses)
    stiffness, damping = data.chain(data.stiffnesses), data.chain(data.dampings)
    n = data.n_masses
    settled = linalg.solve(stiffness, np.array([-force, 0.0, lift]))
    # Heights relative to those of relaxed springs.
    base = NOMINAL + lift / data.stiffnesses[0] + lift / data.stiffnesses[1]
    system = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-linalg.solve(mass, stiffness), -linalg.solve(mass, damping)],
        ]
    )
    start = NOMINAL - base - settled
    moved = linalg.expm(duration * system) @ np.concatenate([start, np.zeros(n)])
    exact = base + settled + moved[:n]
    errors, steps = [], [0.5e-3, 0.25e-3, 0.125e-3]
    for dt in steps:
        pantograph = LumpedPantograph(data, lift, NOMINAL, Stepping(0.0, dt, beta, gamma))
        pantograph.place(NOMINAL)
        # The contact force is there from the beginning, unlike in a march.
        state = pantograph.state()
        state[2 * n] -= force / data.masses[0]
        pantograph.restore(state)
        for number in range(round(duration / dt)):
            pantograph.predict((number + 1) * dt)
            pantograph.advance(np.array([force]))
        errors.append(float(np.abs(pantograph.state()[:n] - exact).max()))
    observed = print_table(f"error at the end [m], expected order {theory}", steps, errors)
    fastest = np.sqrt(linalg.eigh(stiffness, mass, eigvals_only=True)[-1])
    x = fastest * steps[-2]
    # The next term: (omega dt)^2, or with gamma = 0.6 the error of the frequency beside that of
    # the decay, omega dt (1/6 + beta - 1/4) / (gamma - 1/2).
    following = x**2 if theory == 2 else x * (1 / 6 + beta - 1 / 4) / (gamma - 1 / 2)
    check("order", orders(errors)[-1], theory, within=np.log2(1 + following))
    assert observed[-1] > theory - 0.5


@pytest.mark.parametrize(
    "data",
    [TWO_MASSES, pytest.param(THREE_MASSES, marks=pytest.mark.study)],
    ids=["two masses", "three masses"],
)
def test_pantograph_at_rest_presses_with_the_static_force(data: LumpedData) -> None:
    """F at the nominal head height, F - k_r (z - nominal) elsewhere with all springs in a row.

    On a wire that does not move the head is f / k_c above it, which gives f.
    """
    lift, dt, contact = 130.0, 2e-3, 5e4
    in_row = 1.0 / sum(1.0 / k for k in data.stiffnesses)
    for wire in (NOMINAL - lift / contact, NOMINAL + 0.1, NOMINAL - 0.05):
        pantograph = LumpedPantograph(data, lift, NOMINAL, Stepping(raise_time=0.2, dt=dt))
        pantograph.place(wire)
        force = 0.0
        for number in range(40_000):
            head = pantograph.predict((number + 1) * dt)
            # Contact spring and damper (500 N s/m, so that all motion dies out), implicit.
            push = contact * (head.height[0] - wire) + 500.0 * head.velocity[0]
            softness = contact * head.height_compliance + 500.0 * head.velocity_compliance
            softness = softness.item()
            force = push / (1.0 + softness)
            pantograph.advance(np.array([force]))
        expected = (lift - in_row * (wire - NOMINAL)) / (1.0 + in_row / contact)
        # 80 s are many decay times of the slowest motion. Round-off of heights, on the stiffest
        # spring, and of velocities, which are differences of heights over dt.
        within = 8 * EPS * NOMINAL * (contact + 500.0 / dt)
        check(f"force on a wire at {wire:.4f} m [N]", force, expected, within=within)


@pytest.mark.parametrize("data", [TWO_MASSES, THREE_MASSES], ids=["two masses", "three masses"])
def test_undamped_pantograph_keeps_its_energy(data: LumpedData) -> None:
    """Average acceleration keeps it exactly: round-off of n steps, n eps at most."""
    free = LumpedData(data.masses, data.stiffnesses, (0.0,) * data.n_masses)
    dt, n_steps = 1e-3, 20_000
    pantograph = LumpedPantograph(free, 0.0, NOMINAL, Stepping(0.0, dt))
    pantograph.place(NOMINAL - 0.2)
    energies = [energy(free, NOMINAL, pantograph)]
    # Relaxed springs but for the one to the base.
    check("energy [J]", energies[0], 0.5 * free.stiffnesses[-1] * 0.2**2, within=1e-13)
    for number in range(n_steps):
        pantograph.predict((number + 1) * dt)
        pantograph.advance(np.array([0.0]))
        energies.append(energy(free, NOMINAL, pantograph))
    # Stretches are differences of heights of 5.5 m: their round-off on the stiffest spring.
    stretch = np.sqrt(2 * energies[0] / max(free.stiffnesses))
    within = n_steps * EPS * max(free.stiffnesses) * stretch * NOMINAL
    check("energy [J]", energies, energies[0], within=within)


def test_work_of_contact_force_and_lift_is_what_the_energy_changes_by() -> None:
    """Undamped: a constant lift F and contact force f do F dz_last - f dz_head exactly."""
    free = LumpedData((7.2, 15.0), (4200.0, 50.0), (0.0, 0.0))
    lift, force, dt = 120.0, 70.0, 1e-3
    pantograph = LumpedPantograph(free, lift, NOMINAL, Stepping(0.0, dt))
    pantograph.place(NOMINAL)
    pantograph.predict(dt)
    pantograph.advance(np.array([force]))
    first = pantograph.state()[:2]
    # The lift compresses the upper spring where the head is at its nominal height.
    base = NOMINAL + lift / free.stiffnesses[0]
    before = energy(free, base, pantograph)
    for number in range(1, 3000):
        pantograph.predict((number + 1) * dt)
        pantograph.advance(np.array([force]))
    moved = pantograph.state()[:2] - first
    work = lift * moved[1] - force * moved[0]
    print(f"the head rose by {moved[0]:.3f} m")
    within = 3000 * EPS * (lift + free.stiffnesses[0] * 0.1) * NOMINAL
    check("change of energy [J]", energy(free, base, pantograph) - before, work, within=within)
