"""An undamped train at rest lifts a line and lets it swing; the energy that is conserved."""

from __future__ import annotations

import numpy as np
from measuring import History, march
from small_lines import HANGING, en50318_line, mesh_of, numerics, problem_of, train

from catenary.mbs.lumped import LumpedData
from catenary.solver.problem.problem import Problem

# Moves by a nanometre: its power is the force times 1e-10 m/s times a slope below 1.
CREEP = 1e-10


def swinging_train(
    place: float, lift: float, duration: float, dt: float, *effects: str
) -> tuple[Problem, History, np.ndarray, np.ndarray]:
    """Problem, history, the line's own energy and the conserved energy of each state (n,) [J].

    Conserved is the sum of the line's energy, the pantograph's, the contact spring's f^2 / (2 k)
    and the potential of the constant ``lift`` [N] at a ``place`` [m].
    """
    line = en50318_line(3)
    data = LumpedData((7.2, 15.0), (4200.0, 50.0), (0.0, 0.0))
    run = train(
        CREEP,
        place,
        place + CREEP * duration,
        data=data,
        static_force=lift,
        raise_time=0.0,
        nominal_height=5.5,
    )
    problem = problem_of(line, HANGING | set(effects), train=run, numerics=numerics(dt))
    history = march(
        problem, mesh_of(line, 3), lambda view: (sum(view.energies()), view.checkpoint())
    )
    masses = np.asarray(data.masses)
    totals = []
    for (energy, checkpoint), force in zip(
        history.watched, history["contact_force"][:, 0], strict=True
    ):
        position, velocity, _ = np.split(checkpoint["pantograph_0"], 3)
        # The base spring is relaxed when the spring above it carries the lift at 5.5 m.
        stretch = position - (5.5 + lift / data.stiffnesses[0])
        pantograph = 0.5 * masses @ velocity**2
        pantograph += 0.5 * stretch @ data.chain(data.stiffnesses) @ stretch
        contact = force**2 / (2 * problem.contact.stiffness)
        totals.append(energy + pantograph + contact - lift * stretch[-1])
    return problem, history, np.array([energy for energy, _ in history.watched]), np.array(totals)
