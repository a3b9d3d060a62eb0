"""Energy of undamped motion in which droppers slacken: their own energy is counted as they are.

A train at rest lifts the wire until droppers are slack and lets it swing. Conserved is the sum of
the line's energy, the pantograph's, the contact spring's and the potential of the constant lift.
Average acceleration keeps it exactly between two switches of a dropper; a step in which one
switches misses a share of the work k (dt e')^2 / 2 of that dropper, so that the error is of
second order in the step. Were slack droppers counted as springs, it would not fall with the step.
"""

from __future__ import annotations

import numpy as np
import pytest
from measuring import march
from small_lines import HANGING, en50318_line, mesh_of, numerics, problem_of, train
from swinging_train import swinging_train

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.model.beam import shape_values
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.form_finding import find_form


def test_energy_is_conserved_to_second_order_when_droppers_slacken() -> None:
    steps = (2e-3, 1e-3, 5e-4)
    errors = []
    for dt in steps:
        _, history, own, total = swinging_train(90.0, 300.0, 2.0, dt, "dropper_slackening")
        assert (history["dropper_force"].min(axis=0) <= 0.0).any(), "no dropper slackened"
        error, largest = float(np.abs(total - total[0]).max()), float(own.max())
        print(f"dt {dt:g} s: largest error {error:.3e} J, energy of the line up to {largest:.2f} J")
        errors.append(error)
    # Second order over a factor of 4 in dt is 16; contact is lost and regained too, at instants
    # that the step hits more or less closely, which spreads single errors by a factor of two.
    assert errors[0] / errors[-1] > 8.0
    assert errors[-1] < 1e-3 * largest


@pytest.mark.study
def test_dampers_that_are_kept_take_energy_and_give_none() -> None:
    """Of dampers in the droppers alone: what they take, slack droppers' included, closes the
    balance to second order, and without switches nothing is made.

    Average acceleration moves a dropper by dt times the mean of its rates at both ends of a step,
    against the mean of the damper's forces there: c dt (mean rate)^2 is what a step takes.
    """
    line, alpha = en50318_line(3), 5e-3
    steps, errors = (2e-3, 1e-3, 5e-4), []
    for dt in steps:
        run = train(70.0, 30.0, 100.0, static_force=220.0, raise_time=0.0, nominal_height=5.5)
        problem = problem_of(
            line,
            HANGING | {"dropper_slackening", "structural_damping", "contact_loss"},
            train=run,
            damping=Damping(0.0, 0.0, {"droppers": (alpha, 0.0)}),
            numerics=numerics(dt),
            slack_dampers_act=True,
        )
        mesh = mesh_of(line, 3)
        model, _ = find_form(problem, mesh)
        history = march(problem, mesh, lambda view: (sum(view.energies()), view.checkpoint()))
        upper, lower = model.dofs(mesh.droppers).T
        nodes = mesh.wires[CONTACT_WIRE]
        unknowns = np.stack([model.dofs(nodes), model.dofs(nodes, "theta_y")], axis=1)
        x = mesh.x(nodes)
        energy = np.array([one for one, _ in history.watched])
        done = np.zeros(energy.size)  # by contact forces, as the mean of both ends of a step
        taken = np.zeros(energy.size)
        last: tuple[np.ndarray, ...] | None = None
        for number, (_, state) in enumerate(history.watched):
            u, v = state["displacement"], state["velocity"]
            place = history["contact_position"][number, 0]
            e = min(max(int(np.searchsorted(x, place)) - 1, 0), x.size - 2)
            length = x[e + 1] - x[e]
            push = np.zeros(u.size)
            push[unknowns[e : e + 2].ravel()] = history["contact_force"][number, 0] * shape_values(
                (place - x[e]) / length, length
            )
            rate = v[upper] - v[lower]
            if last is not None:
                moved, pushed, rated = last
                done[number] = 0.5 * (push + pushed) @ (u - moved)
                taken[number] = dt * alpha * 1e5 * ((0.5 * (rate + rated)) ** 2).sum()
            last = u.copy(), push, rate
        balance = energy - energy[0] - np.cumsum(done) + np.cumsum(taken)
        slack = (history["dropper_force"] == 0.0).sum()
        errors.append(float(np.abs(balance).max()))
        print(f"dt {dt:g} s: balance open by {errors[-1]:.3e} J, dampers took {taken.sum():.1f} J, "
              f"{slack} slack droppers")  # fmt: skip
        assert slack * dt > 0.05
        # Steps in which no dropper switches keep the balance to round-off.
        switched = np.diff(history["dropper_force"] > 0.0, axis=0).any(axis=1)
        open_by = np.abs(np.diff(balance))[~switched]
        assert open_by.max() < 1e-9 * energy.max()
    assert errors[0] / errors[-1] > 8.0
    assert errors[-1] < 1e-3 * taken.sum()
