"""Heads that start below the wire: free flight up to it, then contact and the static force."""

from __future__ import annotations

import numpy as np
from measuring import check, march, print_table
from small_lines import FREE_MASS, WHOLE, ac_simple_line, mesh_of, numerics, problem_of, train

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
