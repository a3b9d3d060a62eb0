"""A mass on a rigid wire: ramp and step in the wire's height, with closed forms for both.

The wire is rigid because it is heavy: 1e15 kg/m do not move under a contact force. Its shape at
rest is given by hand, level or sloping, with a step inside one short element.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from measuring import History, check, march, print_table
from small_lines import BARE, FREE_MASS, bare_wires, mesh_of, numerics, problem_of, train

from catenary.meshgen.mesh import CONTACT_WIRE, LineMesh
from catenary.meshgen.wires import Conductor
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.time_loop.views.observers import StepView

RIGID = Conductor(tension=20e3, mass_per_length=1e15, bending_stiffness=195.0)
MASS = FREE_MASS.masses[0]
LIFT, STIFFNESS = 100.0, 5e4
LENGTH, SPEED, START = 20.0, 50.0, 1.0


def run(
    mesh_elements: int,
    dt: float,
    heights: np.ndarray,
    slope: float,
    effects: frozenset[str],
    damping: float,
    raise_time: float,
    watch: Callable[[StepView], Any] | None = None,
) -> History:
    """March over a rigid wire with these heights of its nodes and one slope."""
    line = bare_wires(LENGTH, contact_wire=RIGID)
    mesh: LineMesh = mesh_of(line, mesh_elements)
    nodes = mesh.wires[CONTACT_WIRE]

    def shaped(form: Equilibrium) -> Equilibrium:
        height, slopes = form.height.copy(), form.slope.copy()
        height[nodes], slopes[nodes] = heights, slope
        return replace(form, height=height, slope=slopes)

    problem = problem_of(
        line,
        BARE | effects,
        contact=LinearLaw(STIFFNESS, damping),
        train=train(
            SPEED,
            START,
            LENGTH - 1.0,
            data=FREE_MASS,
            static_force=LIFT,
            raise_time=raise_time,
            nominal_height=5.5,
        ),
        numerics=numerics(dt),
    )
    return march(problem, mesh, watch, shaped)


def test_gap_rate_on_a_ramp_contains_the_convective_term() -> None:
    """Bilateral contact: with y = z - h the head obeys m y'' + c y' + k y = F, ramp or not.

    f = k y + c y' with y' = z' - V h'. Without the convective part V h' the head would settle
    c V h' / k higher or lower, 10 N of contact force wide of the mark.
    """
    slope, damping = 0.01, 20.0
    x = np.linspace(0.0, LENGTH, 21)
    first = 60  # after a start in which contact damping sets in at once
    errors, steps = [], [1e-3, 0.5e-3, 0.25e-3]
    for dt in steps:
        begin = first * round(1e-3 / dt)
        history = run(
            20, dt, 5.5 + slope * x, slope, frozenset({"contact_damping"}), damping, raise_time=0.0,
            watch=lambda view: view.checkpoint()["pantograph_0"],
        )  # fmt: skip
        wire = 5.5 + slope * history["contact_position"][begin:, 0]
        z, velocity, _ = history.watched[begin]
        t = np.array(history.time[begin:]) - history.time[begin]
        decay = damping / (2 * MASS)
        omega = np.sqrt(STIFFNESS / MASS - decay**2)
        y, rate = z - wire[0] - LIFT / STIFFNESS, velocity - SPEED * slope
        swing = y * np.cos(omega * t) + (rate + decay * y) / omega * np.sin(omega * t)
        depth = LIFT / STIFFNESS + np.exp(-decay * t) * swing
        depth_rate = np.exp(-decay * t) * (
            (rate * np.cos(omega * t))
            - (decay * rate + (omega**2 + decay**2) * y) / omega * np.sin(omega * t)
        )
        exact = STIFFNESS * depth + damping * depth_rate
        errors.append(float(np.abs(history["contact_force"][begin:, 0] - exact).max()))
        height = history["wire_height"][begin:, 0]
        check("wire height [m]", height, wire, within=8 * np.finfo(float).eps * 5.7)
    observed = print_table("contact force, largest error [N], expected order 2", steps, errors)
    # The next term is smaller by (omega dt)^2.
    check("order", observed[-1], 2, within=np.log2(1 + (omega * steps[-2]) ** 2))
    print(f"the convective term is worth {damping * SPEED * slope:.1f} N")
    assert errors[-1] < 0.1 * damping * SPEED * slope


def test_contact_is_lost_at_a_step_and_regained_when_the_head_has_caught_up() -> None:
    """The wire jumps up by s. The head, F / k deep in contact, flies free under its lift F:

    it needs t with F t^2 / (2 m) = s - F / k, arrives with v = F t / m, and contact then
    swings up to f = F + sqrt(F^2 + k m v^2).
    """
    step, dt, n_elements, at = 0.05, 0.2e-3, 2000, 10.0
    omega = np.sqrt(STIFFNESS / MASS)
    x = np.linspace(0.0, LENGTH, n_elements + 1)
    heights = np.where(x > at - 1e-6, 5.5 + step, 5.5)
    # A lift that rises for three half periods leaves no oscillation behind.
    history = run(
        n_elements,
        dt,
        heights,
        0.0,
        frozenset({"contact_loss"}),
        damping=0.0,
        raise_time=3 * np.pi / omega,
        # States of the flight are enough, and each costs as much as a step.
        watch=lambda view: None if view.contact_force[0] else view.checkpoint()["pantograph_0"],
    )
    force = history["contact_force"][:, 0]
    time = np.array(history.time)
    before = force[(time > 3 * np.pi / omega) & (START + SPEED * time < at - 0.1)]
    # What the time step changes of the period, (omega dt)^2 / 12 of the phase 3 pi, it leaves of
    # the oscillation.
    remains = LIFT * 3 * np.pi * (omega * dt) ** 2 / 12
    check("force before the step [N]", before, LIFT, within=remains)
    # Undamped, the head bounces on; the first flight and what follows it are compared.
    lost = int(np.argmax((force == 0.0) & (START + SPEED * time > at)))
    back = lost + int(np.argmax(force[lost:] > 0.0))
    flight = np.sqrt(2 * (step - LIFT / STIFFNESS) * MASS / LIFT)
    # Loss and regain fall into one step each; the remaining oscillation shifts the height.
    check("time without contact [s]", (back - lost) * dt, flight, within=2 * dt)
    speed = LIFT * flight / MASS
    largest = LIFT + np.sqrt(LIFT**2 + STIFFNESS * MASS * speed**2)
    # The peak falls between two states, up to dt / 2 from one: (omega dt)^2 / 8 of the amplitude;
    # a step that contains the impact catches the wrong share of it: (omega dt)^2 / 4.
    within = (3 / 8) * (omega * dt) ** 2 * largest + remains
    bounce = force[back : back + round(np.pi / omega / dt)]
    check("largest force [N]", bounce.max(), largest, within=within)
    velocity = history.watched[back - 1][1]
    check("speed at regain [m/s]", velocity, speed, within=2 * dt * LIFT / MASS)
