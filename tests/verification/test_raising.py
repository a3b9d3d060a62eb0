"""Heads that start below the wire: free flight up to it, then contact and the static force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from measuring import check, march, print_table
from small_lines import (
    EN_PANTOGRAPH,
    FREE_MASS,
    WHOLE,
    ac_simple_line,
    mesh_of,
    numerics,
    problem_of,
    train,
)

from catenary.mbs.head.strips import Strips
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Problem, Train

BELOW, FORCE = 0.3, 40.0


def raised(dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, head heights less those of the wire at rest, forces: a lone mass from below."""
    line = ac_simple_line(3)
    usual = train(1.0, 80.0, 80.4, data=FREE_MASS, static_force=FORCE, raise_time=0.0)
    own = {name: getattr(usual, name) for name in Train.__dataclass_fields__}
    problem: Problem = problem_of(
        line, WHOLE, train=Train(**{**own, "start_below": BELOW}), numerics=numerics(dt)
    )
    history = march(problem, mesh_of(line, 4))
    height = history["head_height"][:, 0]
    check("gap at the start [m]", history["wire_height"][0, 0] - height[0], BELOW, within=1e-12)
    return np.array(history.time), height - height[0], history["contact_force"][:, 0]


def test_a_free_mass_rises_to_the_wire_under_its_lift() -> None:
    """z = F t^2 / (2 m) up to the wire, t = sqrt(2 m d / F) = 0.346 s; then it presses."""
    mass = FREE_MASS.masses[0]
    expected = np.sqrt(2 * mass * BELOW / FORCE)
    errors = []
    for dt in (4e-3, 2e-3, 1e-3):
        time, height, force = raised(dt)
        touched = int(np.argmax(force > 0.0))
        free = time[:touched]
        # Average acceleration is exact under a constant force, but for round-off of heights of 5 m.
        closed = FORCE * free**2 / (2 * mass)
        check("way in free flight [m]", height[:touched], closed, within=1e-12 * (1 + touched))
        assert (force[:touched] == 0.0).all() and force[touched:].max() > FORCE
        errors.append(abs(time[touched] - expected))
        # Told at the end of the step in which it happens; the wire moves by its own slope of a
        # few millimetres a metre under a train of 1 m/s, less than 1 mm at 1.7 m/s.
        check("instant of contact [s]", time[touched], expected, within=dt + 1e-3 / 1.7)
    print_table("instant of contact", ["4 ms", "2 ms", "1 ms"], errors)


def test_no_strip_starts_within_the_wire() -> None:
    """Two strips 0.6 m apart under a wire with slope: the head starts where the lower end of the
    wire lies on a strip. At the middle's height that one would press with 1e6 N/m from the start,
    hundreds of newtons.

    The lift grows from zero as 120 N (1 - cos(pi t / 0.5 s)) / 2. A force that follows it swings to
    twice its value at most. A head at rest meets the slope s at the speed V s, with V s sqrt(k m)
    at most.
    """
    spacing, end = 0.6, 0.05
    data = replace(EN_PANTOGRAPH, strips=Strips(2, spacing, None, None, None))
    problem = problem_of(
        ac_simple_line(3),
        WHOLE,
        train=train(1.0, 77.0, 77.0 + end, data=data, raise_time=0.5),
        contact=LinearLaw(1e6, 0.0),
        numerics=numerics(1e-4),
    )
    history = march(problem, mesh_of(ac_simple_line(3), 4))
    force = history["contact_force"][:, 0]
    below = history["wire_height"][0, 0] - history["head_height"][0, 0]
    print(f"head below the middle's wire {1e3 * below:.3f} mm, largest force {force.max():.3g} N")
    assert below > 1e-4, "the wire has a slope there"
    lift = 60.0 * (1.0 - np.cos(2.0 * np.pi * np.array(history.time)))
    met = 1.0 * below / (0.5 * spacing) * np.sqrt(1e6 * EN_PANTOGRAPH.masses[0])
    assert 0.0 < force.max() and (force <= 2.0 * lift + met).all()
    # The depth that the upper strip would have at the middle's height presses more by far.
    assert 1e6 * below > 10.0 * (2.0 * lift.max() + met)
