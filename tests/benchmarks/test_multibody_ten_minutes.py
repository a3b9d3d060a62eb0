"""All bodies in the time loop for ten minutes. Not part of ``make test``: some five minutes.

    .venv/bin/python -m pytest -s tests/benchmarks/test_multibody_ten_minutes.py

`tests/verification/test_multibody_long_runs.py` has ten minutes of the reduced pantograph.
"""

from __future__ import annotations

import time

import numpy as np
import paper_pantograph as paper
import pytest
from body_mechanics import energy
from long_runs import DT, HEIGHT, STATIC, check_balance, check_no_drift, contact_forces, mean

from catenary.mbs.head.stepping import Stepping
from catenary.mbs.mechanism.full_pantograph import FullPantograph
from catenary.mbs.rigid.forces import Actuator, SpringDamper


@pytest.mark.timeout(1500)
@pytest.mark.parametrize("seconds", [60, 600])
def test_all_bodies_keep_their_joints_and_energy(seconds: int) -> None:
    """Joints within 1e-9 m after every step; no drift of the head.

    Balance: (w h)^2 / 12 = 8e-5 of the swing at 5 Hz as far as levers change with it, 1 mm of a
    metre: 1e-7 of the work to and fro.
    """
    n_steps = round(seconds / DT)
    forces = contact_forces(n_steps)
    forces[0] = 0.0  # it is placed without contact
    pantograph = FullPantograph(paper.data(), STATIC, HEIGHT, Stepping(0.0, DT))
    pantograph.place(HEIGHT + STATIC / 6000.0)
    system, head = pantograph.system, pantograph.motion.numbers[paper.HEAD]
    heights, lengths = np.empty(n_steps + 1), np.empty((n_steps + 1, len(system.lines.names)))
    heights[0] = pantograph.motion.position[head, 2]
    lengths[0] = system.lines.geometry(pantograph.motion)[0]
    before, opened, wall = energy(system, pantograph.motion), 0.0, 0.0
    for number in range(1, n_steps + 1):
        begin = time.perf_counter()
        pantograph.predict(DT * number)
        pantograph.advance(forces[number : number + 1])
        wall += time.perf_counter() - begin
        heights[number] = pantograph.motion.position[head, 2]
        lengths[number] = system.lines.geometry(pantograph.motion)[0]
        opened = max(opened, pantograph.violation[0])
    print(f"{seconds} s in {wall:.1f} s: {1e6 * wall / n_steps:.0f} us a step; open {opened:.1e} m")
    assert opened < 1e-9
    check_no_drift(heights)
    lost, by_actuators = np.zeros(n_steps), 0.0
    for column, name in enumerate(system.lines.names):
        element, length = system.force(name), lengths[:, column]
        if isinstance(element, SpringDamper):
            lost += element.damping * np.diff(length) ** 2 / DT
        elif isinstance(element, Actuator):
            by_actuators += element.force * (length[-1] - length[0])
    gained = energy(system, pantograph.motion) - before
    by_contact = -mean(forces) * np.diff(heights)
    check_balance(gained, by_contact, by_actuators, lost, within=1e-7)
