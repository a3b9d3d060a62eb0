"""The running energy balance of a march, and what its watch tells and ends.

Average acceleration changes the energy of an undamped line by the work of the contact forces, in
every step and to round-off, whatever the contact does (S. Krenk, Comput. Methods Appl. Mech. Engrg.
195 (2006) 6110-6124). Droppers that slacken are the only part that may break the balance.
"""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest
from measuring import COMM, History, check, march
from small_lines import HANGING, en50318_line, mesh_of, numerics, problem_of, train

from catenary.meshgen.line import DropperKind
from catenary.postproc.record.run_watch import RunWatch
from catenary.solver.effects.shipped.line_effects import NAME
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import StepView

SLACKENS = HANGING | {"contact_loss", "dropper_slackening"}
# Stiff for steps of 3 ms: k dt^2 = 9 N s2/m.
STIFF, STEP = 1e6, 3e-3


def energies(view: StepView) -> tuple[float, float]:
    return sum(view.energies()), view.contact_work()


@pytest.mark.parametrize("gamma", [0.5, 0.6])
@pytest.mark.parametrize("scheme", ["one_solve", "fixed_point"])
def test_an_undamped_line_has_the_energy_that_contacts_gave_it(scheme: str, gamma: float) -> None:
    """With a contact that is lost and regained, at steps in which the train passes a third of an
    element; numerical damping (gamma > 1/2) only takes."""
    line = en50318_line(3)
    course = train(70.0, 60.0, 130.0, static_force=180.0, raise_time=0.0)
    steps = numerics(STEP, scheme, gamma=gamma, beta=0.25 * (gamma + 0.5) ** 2)
    damping = Damping(0.0, 0.0)
    problem = problem_of(
        line, HANGING | {"contact_loss"}, train=course, numerics=steps, damping=damping
    )
    history = march(problem, mesh_of(line, 3), energies)
    energy, work = np.array(history.watched).T
    assert (history["contact_force"] == 0.0).any(), "contact is never lost"
    if gamma == 0.5:
        # Round-off of some hundred steps of energies that are differences of larger ones; schemes
        # that iterate leave their tolerance of 1e-10 m/s times 180 N in each.
        check(
            "energy less work [J]", energy - energy[0], work - work[0], within=1e-7 * energy.max()
        )
    else:
        assert energy[-1] - energy[0] < 0.99 * (work[-1] - work[0])


def stiff_line(effects: frozenset[str], alpha: float = 0.0) -> Problem:
    line = replace(en50318_line(6), dropper=DropperKind(STIFF, None, 0.0, 0.0, 0.0))
    course = train(70.0, 60.0, 300.0, static_force=180.0)
    return problem_of(
        line, effects, train=course, numerics=numerics(STEP), damping=Damping(alpha, 0.0)
    )


@functools.cache
def energy_made(effects: frozenset[str]) -> tuple[float, float]:
    """Largest excess of the line's energy over the work of the contacts, and that work [J]."""
    history = march(stiff_line(effects), mesh_of(en50318_line(6), 5), energies)
    energy, work = np.array(history.watched).T
    made = float((energy - energy[0] - work + work[0]).max())
    print(f"energy made {made:.4g} J, work of the contacts {work[-1] - work[0]:.4g} J")
    return made, float(np.abs(work - work[0]).max())


def test_stiff_droppers_make_no_energy_with_numerical_damping() -> None:
    made, work = energy_made(SLACKENS | {NAME})
    # The balance of a step is kept to round-off of the line's energy.
    assert made < 1e-9 * work


def test_stiff_droppers_make_energy_without_it() -> None:
    """The case is one in which average acceleration makes energy; it could not be seen else."""
    made, work = energy_made(SLACKENS)
    assert made > 0.05 * work


def watch_of(problem: Problem) -> tuple[RunWatch, str]:
    rest = line_at_rest(problem, mesh_of(problem.line, 5))
    watch = RunWatch(COMM, rest, every=20)
    with March(COMM, *rest) as run:
        outcome = run.run([watch, History()]).outcome
    return watch, outcome


def test_energy_from_nothing_is_told_and_ends_a_march(caplog: pytest.LogCaptureFixture) -> None:
    problem = stiff_line(SLACKENS)
    problem = replace(problem, train=replace(problem.train, end=330.0))
    watch, outcome = watch_of(problem)
    assert "The time integration makes energy" in watch.remarks[0]
    assert watch.remarks[0] in caplog.text
    assert outcome.startswith("at ") and "has made more energy" in outcome
    facts = watch.facts()
    assert facts["energy_made_J"] > 0.05 * abs(facts["contact_work_J"])


def test_a_sound_march_is_told_nothing() -> None:
    problem = stiff_line(SLACKENS | {NAME, "structural_damping"}, alpha=1e-4)
    watch, outcome = watch_of(problem)
    assert (outcome, watch.remarks) == ("done", [])
    assert watch.facts()["energy_made_J"] == 0.0


def test_a_contact_that_is_lost_for_good_is_told() -> None:
    """A static force of 1 N does not follow a wire that the trailing head lifts before it."""
    line = en50318_line(4)
    course = train(70.0, 60.0, 200.0, static_force=1e-3, nominal_height=5.0, raise_time=0.0)
    course = replace(course, start_below=0.3)
    problem = problem_of(line, SLACKENS, train=course, numerics=numerics(2e-3))
    watch, outcome = watch_of(problem)
    assert outcome == "done"
    assert "has not touched a wire for more than a span, from" in watch.remarks[0]
    assert "touches no wire from" in watch.remarks[1]


@pytest.mark.parametrize(("force", "ends"), [(900.0, False), (2e4, True)])
def test_motion_beyond_linear_theory_is_told_and_ends_a_march(force: float, ends: bool) -> None:
    """Some 0.8 mm/N on the way lift the wire, and with it arms of 1 m, by 0.7 and 16 m."""
    line = en50318_line(4)
    course = train(70.0, 60.0, 150.0, static_force=force, nominal_height=5.5)
    problem = problem_of(
        line, SLACKENS | {"structural_damping"}, train=course, numerics=numerics(2e-3)
    )
    watch, outcome = watch_of(problem)
    assert any("is lifted by" in text and "holds up to 0.5" in text for text in watch.remarks)
    assert (outcome != "done") == ends
    if ends:
        assert outcome.startswith("at ") and "ends at 1:" in outcome
        assert "coupling" not in outcome
        # One that is not stable at any step may be the reason.
        steps = replace(problem.numerics, coupling="explicit")
        _, outcome = watch_of(replace(problem, numerics=steps))
        assert 'the explicit coupling (numerics.coupling = "implicit")' in outcome
