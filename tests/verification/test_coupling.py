"""Coupling schemes: their order in dt, where they lose their stability, and a stiff contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import History, check, march, print_table, start_march
from scipy import signal
from small_lines import HANGING, WHOLE, en50318_line, mesh_of, numerics, problem_of, train
from studies import few

from catenary import RunBroken
from catenary.mbs.head.stepping import Stepping
from catenary.mbs.lumped import LumpedData, LumpedPantograph
from catenary.meshgen.mesh import LineMesh
from catenary.solver.contact.forces_on_line import no_links
from catenary.solver.contact.pantographs import Heads
from catenary.solver.contact_problem.coupling import Coupling, make_coupling
from catenary.solver.contact_problem.force_exchange import LineResponse
from catenary.solver.contact_problem.law_tangents import LawInSteps
from catenary.solver.problem.contact_laws import HertzLaw, KinematicLaw, LinearLaw
from catenary.solver.problem.problem import Problem

COUPLINGS = ("implicit", "iterated", "explicit")


def smooth(coupling: str, dt: float) -> Problem:
    """Three spans, nothing that switches: no slack dropper, no loss of contact."""
    accurate = numerics(dt, coupling=coupling, eps_force=1e-10)
    return problem_of(
        en50318_line(3),
        HANGING | {"structural_damping"},
        train=train(50.0, 70.0, 110.0, raise_time=0.2),
        numerics=accurate,
    )


@pytest.mark.study
def test_order_of_each_coupling() -> None:
    """Implicit and iterated are the same trapezoidal step: order 2. The extrapolation lacks
    beta dt^2 a_new of both sides' motion, k beta dt^2 times the relative acceleration in the force:
    of order 2 as well while it is stable."""
    mesh = mesh_of(en50318_line(3), 3)

    def force(coupling: str, dt: float) -> np.ndarray:
        found = march(smooth(coupling, dt), mesh)["contact_force"][:, 0]
        return found[:: round(2e-3 / dt)]

    steps = [1e-3 / 2**k for k in range(4)]
    reference = force("implicit", 1e-3 / 32)
    errors = {}
    for coupling in COUPLINGS:
        errors[coupling] = [
            float(np.sqrt(((force(coupling, dt) - reference) ** 2).mean())) for dt in steps
        ]
        observed = print_table(
            f"{coupling}: rms error of the contact force [N]",
            [f"{1e3 * dt:g} ms" for dt in steps],
            errors[coupling],
        )
        # Passing from element to element adds a share of steps with a jump, V dt / h: see
        # test_order_in_time.
        check(f"order, {coupling}", observed[-1], 2.0, within=0.35)
    # One trapezoidal step, solved in two ways: the tolerance of the exchange and no more.
    check("iterated against implicit", errors["iterated"], errors["implicit"], within=1e-7)
    assert errors["explicit"] != errors["implicit"]


class Wall:
    """A free mass between a coupling and a wire that does not move."""

    def __init__(self, coupling: str, stiffness: float, mass: float, dt: float) -> None:
        self.mass = LumpedPantograph(
            LumpedData((mass,), (0.0,), (0.0,)), 0.0, 0.0, Stepping(raise_time=0.0, dt=dt)
        )
        law = LawInSteps(1, stiffness, 0.0, pulls=True)
        accurate = numerics(dt, coupling=coupling, eps_force=1e-9)
        self.coupling: Coupling = make_coupling(law, no_links(), accurate)
        self.heads, self.dt, self.time = Heads(1), dt, 0.0
        self.mass.restore(np.array([1e-3, 0.0, -stiffness * 1e-3 / mass]))
        self.line = LineResponse(1, 32, early=True)  # room as in runs, for loops as theirs

    def largest(self, n_steps: int) -> float:
        """Largest depth on the way, beside that at the start."""
        found = 0.0
        for _ in range(n_steps):
            self.time += self.dt
            head = self.mass.predict(self.time)
            self.heads.height[:], self.heads.velocity[:] = head.height, head.velocity
            self.heads.height_compliance[:] = head.height_compliance
            self.heads.velocity_compliance[:] = head.velocity_compliance
            early = self.mass.extrapolate(self.time)
            self.heads.early_height[:], self.heads.early_velocity[:] = early
            result = self.coupling.solve(self.line, self.heads)
            self.mass.advance(result.contact_force)
            found = max(found, abs(float(self.mass.position[0])))
            if found > 1.0:
                break
        return found / 1e-3


def explicit_limit() -> float:
    """omega dt at which a mass on a spring by extrapolation loses its stability.

    d* = d + dt v + dt^2/4 a, a_new = -omega^2 d*, d_new = d* + dt^2/4 a_new,
    v_new = v + dt/2 (a + a_new): largest omega dt with all eigenvalues in the unit circle.
    """

    def radius(x: float) -> float:
        row = -(x**2) * np.array([1.0, 1.0, 0.25])
        step = np.array(
            [
                np.array([1.0, 1.0, 0.25]) + 0.25 * row,
                np.array([0.0, 1.0, 0.5]) + 0.5 * row,
                row,
            ]
        )
        return float(np.abs(np.linalg.eigvals(step)).max())

    grid = np.linspace(0.01, 3.0, 3000)
    stable = [radius(x) <= 1.0 + 1e-9 for x in grid]
    return float(grid[np.argmin(stable)])


@pytest.mark.parametrize("coupling", few(COUPLINGS, "implicit", "explicit"))
def test_where_a_mass_on_a_stiff_contact_becomes_unstable(coupling: str) -> None:
    """Implicit: nowhere. Explicit: at the limit of its step matrix. Iterated: the exchange
    multiplies errors by k beta dt^2 / m, so that it ends at omega dt = 2."""
    stiffness, mass = 1e6, 1.0
    limit = {"implicit": 20.0, "iterated": 2.0, "explicit": explicit_limit()}[coupling]
    print(f"{coupling}: stable up to omega dt = {limit:.4f}")
    omega = np.sqrt(stiffness / mass)
    below = Wall(coupling, stiffness, mass, 0.97 * limit / omega)
    n_steps = 2000
    if coupling == "iterated":
        # An exchange that gains 6 % each time takes as many as this. Beyond its limit the first
        # step breaks, so that a few hundred, each of hundreds of exchanges, tell enough.
        below.coupling._max_iterations = 2000  # type: ignore[attr-defined]
        n_steps = 300
    # A trapezoidal step keeps the energy; an extrapolated one swings higher near its limit.
    assert below.largest(n_steps) < 10.0
    if coupling == "implicit":
        return
    above = Wall(coupling, stiffness, mass, 1.03 * limit / omega)
    try:
        grown = above.largest(5000)
    except RunBroken as broken:
        print(broken)
        grown = np.inf
    assert grown > 100.0


LIGHT_HEAD = LumpedData((1.0, 15.0), (4200.0, 50.0), (10.0, 90.0))


def stiff(coupling: str, dt: float) -> Problem:
    """A head of 1 kg, a contact of 1e6 N/m, 250 km/h over slackening droppers."""
    return problem_of(
        en50318_line(6),
        WHOLE,
        contact=LinearLaw(1e6, 0.0),
        train=train(250 / 3.6, 80.0, 280.0, data=LIGHT_HEAD, raise_time=0.4),
        numerics=numerics(dt, coupling=coupling),
    )


def until_it_ends(problem: Problem, mesh: LineMesh) -> tuple[History, str]:
    """What a march showed, and how it ended."""
    run, _ = start_march(problem, mesh)
    history = History()
    with run:
        outcome = run.run([history])
    return history, outcome.outcome


def filtered(history: History, dt: float, start: float, weight: float = 1.0) -> np.ndarray:
    """Contact force below 20 Hz, as EN 50317 has it, every 4 ms from ``start`` [s].

    With a weight below 1 the mean of each force and the one before.
    """
    sections = signal.butter(6, 20.0, fs=1 / dt, output="sos")
    force = history["contact_force"][:, 0]
    force = weight * force + (1 - weight) * np.append(0.0, force[:-1])
    force = signal.sosfiltfilt(sections, force)
    return np.asarray(force[round(start / dt) : -round(0.1 / dt) : round(4e-3 / dt)])


def test_default_coupling_carries_a_light_head_on_a_stiff_contact_with_a_long_step() -> None:
    """dt = 4 ms, omega dt = 4 for the head on its contact: the explicit coupling fails.

    It does not grow beyond all bounds, because contact is lost after each wrong push: the head
    hops, with pushes of many times the true force, and what is left below 20 Hz is noise.
    """
    mesh = mesh_of(en50318_line(6), 4)
    reference = march(stiff("implicit", 0.5e-3), mesh)
    expected = filtered(reference, 0.5e-3, 0.8)
    apart, largest = {}, {}
    for coupling in ("implicit", "explicit"):
        found = march(stiff(coupling, 4e-3), mesh)
        force = filtered(found, 4e-3, 0.8)
        n = min(force.size, expected.size)
        apart[coupling] = float(np.sqrt(((force[:n] - expected[:n]) ** 2).mean()))
        largest[coupling] = float(found["contact_force"][200:].max())
        lost = float((found["contact_force"][200:] == 0.0).mean())
        print(f"{coupling}: {apart[coupling]:.1f} N apart below 20 Hz, largest force "
              f"{largest[coupling]:.0f} N, lost in {100 * lost:.0f} % of the steps")  # fmt: skip
        if coupling == "implicit":
            check("mean force [N]", force.mean(), expected.mean(), within=2.0)
    print(f"of a deviation of {expected.std():.1f} N, largest force "
          f"{reference['contact_force'].max():.0f} N")  # fmt: skip
    # At 4 ms a period of 20 Hz has 12 steps: phases are off by (omega dt)^2 / 12 = 2 % and by
    # more in what the head does at its own 10 to 20 Hz.
    assert apart["implicit"] < 0.3 * expected.std()
    assert apart["explicit"] > 3 * apart["implicit"]
    assert largest["explicit"] > 3 * largest["implicit"]
    _, outcome = until_it_ends(stiff("iterated", 4e-3), mesh)
    print(f"iterated: {outcome}")
    assert 'take numerics.coupling = "implicit"' in outcome


def test_penalty_laws_tend_to_the_kinematic_one() -> None:
    """Linear and Hertz's springs, stiffer and stiffer: force and depth of no depth at all.

    A spring k gives way by f / k: the difference below 20 Hz falls like 1 / k. The kinematic force
    is a mean over the step, gamma f + (1 - gamma) f_before, and so the springs' is taken.
    """
    mesh = mesh_of(en50318_line(6), 4)

    def run(law: LinearLaw | HertzLaw | KinematicLaw) -> History:
        damped = numerics(1e-3, gamma=0.55, beta=0.28)
        # Bilateral, so that a stiff spring does not bounce where the kinematic law cannot.
        effects = WHOLE - {"contact_loss"} if isinstance(law, LinearLaw) else WHOLE
        problem = replace(stiff("implicit", 1e-3), contact=law, numerics=damped, effects=effects)
        # From mid-span, where the wire is level: only under the kinematic law heads start with it.
        placements = train(250 / 3.6, 90.0, 290.0, raise_time=0.4)
        return march(replace(problem, train=placements), mesh)

    limit = run(KinematicLaw())
    depth = limit["head_height"] - limit["wire_height"]
    # Of second order in the step: the head's relative acceleration, some 10 m/s^2, over dt^2.
    check("depth [m]", depth[10:], 0.0, within=2e-5)
    force = filtered(limit, 1e-3, 0.5)
    errors = []
    for stiffness in (4e5, 1.6e6, 6.4e6):
        other = filtered(run(LinearLaw(stiffness, 0.0)), 1e-3, 0.5, weight=0.55)
        errors.append(float(np.sqrt(((other - force) ** 2).mean())))
    print_table("linear, rms difference below 20 Hz [N], stiffness in fours", [1, 4, 16], errors)
    # Order 1 in 1 / k reads as 2 for fours.
    assert (np.log2(np.divide(errors[:-1], errors[1:])) > 1.5).all()
    assert errors[-1] < 0.01 * force.std()
    hertz = filtered(run(HertzLaw(2e10, 1.5, 0.0, 0.1)), 1e-3, 0.5, weight=0.55)
    difference = float(np.sqrt(((hertz - force) ** 2).mean()))
    print(f"Hertz, rms difference {difference:.3f} N")
    # It cannot pull, so that the head hops on it: a tenth of the deviation.
    assert difference < 0.2 * force.std()


def test_a_kinematic_contact_ends_where_it_would_have_to_pull() -> None:
    """At 330 km/h a head of 20 kg leaves the wire of the EN line; the law cannot follow it."""
    mesh = mesh_of(en50318_line(6), 4)
    heavy = LumpedData((20.0, 15.0), (4200.0, 50.0), (10.0, 90.0))
    problem = problem_of(
        en50318_line(6),
        WHOLE,
        contact=KinematicLaw(),
        train=train(330 / 3.6, 80.0, 280.0, data=heavy, raise_time=0.4),
        numerics=numerics(1e-3, gamma=0.55, beta=0.28),
    )
    found, outcome = until_it_ends(problem, mesh)
    print(outcome)
    assert "would have to pull" in outcome
    time = np.array(found.time)
    # Everything up to there has been shown, and was pressing.
    assert (found["contact_force"][time > 0.4 + 1e-9] >= 0.0).all() and time[-1] > 0.4
