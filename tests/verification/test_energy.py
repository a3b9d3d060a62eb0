"""Energy of undamped motion: average acceleration keeps kinetic plus elastic energy.

With beta = 1/4 and gamma = 1/2 a step keeps E = (v M v + d K d) / 2 exactly; what is left is
round-off. A step adds a relative error of about eps, of either sign; over n steps they add up to
between sqrt(n) eps and, should they all have one sign, n eps.
"""

from __future__ import annotations

import numpy as np
from measuring import check, energies_of_free_motion
from scipy.sparse import linalg as sparse_linalg
from small_lines import HANGING, en50318_line, mesh_of, problem_of
from swinging_train import swinging_train

from catenary.solver.model.matrices import stiffness_matrix
from catenary.solver.statics.form_finding import find_form

EPS = np.finfo(float).eps


def test_energy_stays_over_a_hundred_thousand_steps() -> None:
    """Two spans with droppers, supports and arms, let go from their lift under a force."""
    line = en50318_line(2)
    model, _ = find_form(problem_of(line, HANGING), mesh_of(line, 3))
    assert "structural_damping" not in model.terms_of
    load = np.zeros(model.n_dofs)
    load[model.dofs(model.mesh.droppers[4, 1])] = 200.0
    lifted = sparse_linalg.spsolve(stiffness_matrix(model), load)
    n_steps = 100_000
    kinetic, total = energies_of_free_motion(model, lifted, np.zeros_like(lifted), n_steps, 1000)
    kinetic_share = kinetic / total
    # The work of the force that lifted it; one solve with K, whose condition number is below 1e5.
    check("energy at the start [J]", total[0], 0.5 * lifted @ load, within=1e5 * EPS * total[0])
    drift = np.abs(total / total[0] - 1)
    print(f"kinetic share of the energy: {min(kinetic_share):.3f} to {max(kinetic_share):.3f}")
    assert max(kinetic_share) > 0.3
    check("relative change of the energy", drift.max(), 0.0, within=n_steps * EPS)


def test_energy_of_line_and_pantograph_stays_while_they_are_in_contact() -> None:
    """All that is linear, contact spring and pantograph included; weights are in equilibrium."""
    lift = 80.0
    problem, _, own, total = swinging_train(80.0, lift, 4.0, 1e-3)
    print(f"{total.size} states; the line's own energy varies by {np.ptp(own):.3f} J")
    assert np.ptp(own) > 0.01
    # Round-off: forces come from differences of heights of 5 m on springs of 5e4 N/m, and the
    # potential is a product of the lift with such a height.
    within = total.size * EPS * (problem.contact.stiffness * 5.5 * 1e-3 + lift * 5.5)
    check("energy [J]", total, total[0], within=within)


def test_energy_is_conserved_to_second_order_when_droppers_slacken() -> None:
    """A train at rest lifts the wire until droppers are slack and lets it swing. Conserved is the
    sum of the line's energy, the pantograph's, the contact spring's and the potential of the
    constant lift: exactly between two switches of a dropper; a step in which one switches misses a
    share of the work k (dt e')^2 / 2 of that dropper, so that the error is of second order in the
    step. Were slack droppers counted as springs, it would not fall with the step.
    """
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
