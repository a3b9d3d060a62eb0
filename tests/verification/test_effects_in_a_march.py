"""Laws that act in the time loop: switched off they leave no trace, switched on only their own."""

from __future__ import annotations

import numpy as np
import pytest
from measuring import History, check, march
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.meshgen.mesh import LineMesh
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Problem

LINE = en50318_line(5)
EPS = np.finfo(float).eps


@pytest.fixture(scope="module")
def mesh() -> LineMesh:
    return mesh_of(LINE, 3)


def scene(effects: frozenset[str], kept: float = 0.0, damping: float = 0.0) -> Problem:
    """Fast and strong enough for slack droppers and loss of contact."""
    return problem_of(
        LINE,
        effects,
        contact=LinearLaw(5e4, damping),
        # From the dropper before a mast: the wire sags behind it, so that the head presses at once.
        train=train(80.0, 115.0, 195.0, static_force=150.0, raise_time=0.2, nominal_height=5.6),
        numerics=numerics(1e-3),
        residual_stiffness_ratio=kept,
    )


def same_until(first: History, second: History, event: int) -> None:
    """Both runs agree before the step ``event`` but for round-off of as many steps."""
    assert event > 20, "the event comes too early to compare anything"
    # A contact force is a difference of heights of 5.5 m on the contact spring.
    within = 8 * np.sqrt(event) * EPS * 5.5 * 5e4
    check(
        f"contact force before step {event} [N]",
        first["contact_force"][:event],
        second["contact_force"][:event],
        within=within,
    )


def test_without_slackening_droppers_push(mesh: LineMesh) -> None:
    slackening = march(scene(WHOLE), mesh)
    linear = march(scene(WHOLE - {"dropper_slackening"}), mesh)
    assert slackening["dropper_force"].min() == 0.0
    assert linear["dropper_force"].min() < -10.0
    assert linear.outcome.counters["slack_dropper_steps"] == 0
    event = int(np.argmax((linear["dropper_force"] < 0).any(axis=1)))
    same_until(slackening, linear, event)
    apart = np.abs(slackening["contact_force"] - linear["contact_force"]).max()
    print(f"afterwards they differ by up to {apart:.1f} N")
    assert apart > 1.0


def test_without_contact_loss_the_wire_pulls(mesh: LineMesh) -> None:
    unilateral = march(scene(WHOLE), mesh)
    bilateral = march(scene(WHOLE - {"contact_loss"}), mesh)
    assert unilateral["contact_force"].min() == 0.0
    assert bilateral["contact_force"].min() < -1.0
    event = int(np.argmax((bilateral["contact_force"] < 0).any(axis=1)))
    same_until(unilateral, bilateral, event)


@pytest.mark.parametrize(
    ("name", "with_value", "without_value"),
    [
        ("residual_dropper_stiffness", {"kept": 0.3}, {"kept": 0.0}),
        ("contact_damping", {"damping": 200.0}, {"damping": 0.0}),
    ],
)
def test_a_value_without_its_effect_is_as_if_it_were_zero(
    name: str, with_value: dict[str, float], without_value: dict[str, float], mesh: LineMesh
) -> None:
    off = march(scene(WHOLE, **with_value), mesh)
    zero = march(scene(WHOLE, **without_value), mesh)
    on = march(scene(WHOLE | {name}, **with_value), mesh)
    assert np.array_equal(off["contact_force"], zero["contact_force"])
    assert np.abs(on["contact_force"] - off["contact_force"]).max() > 1.0


def test_a_compressed_dropper_keeps_the_share_of_its_stiffness(mesh: LineMesh) -> None:
    """r = 1 is the linear dropper, r = 0 the slack one; a small r changes things in proportion."""
    whole = WHOLE | {"residual_dropper_stiffness"}
    linear = march(scene(WHOLE - {"dropper_slackening"}), mesh)
    nothing_released = march(scene(whole, kept=1.0), mesh)
    slack, little = march(scene(WHOLE), mesh), march(scene(whole, kept=1e-4), mesh)
    same_until(nothing_released, linear, len(linear.time))
    assert nothing_released["dropper_force"].min() < 0.0
    assert little["dropper_force"].min() < 0.0 == slack["dropper_force"].min()
    # Soon after the first dropper has gone slack, what r changes is proportional to r. Its square
    # counts as r k compared to the stiffness of the line there, 1 / (0.5 mm/N).
    event = int(np.argmax((slack["dropper_force"] == 0).any(axis=1)))
    twice = march(scene(whole, kept=2e-4), mesh)
    force = [run["contact_force"][event : event + 100] for run in (slack, little, twice)]
    once, double = np.abs(force[1] - force[0]).max(), np.abs(force[2] - force[0]).max()
    print(f"r = 1e-4 changes the contact force by {once:.2e} N")
    following = 2e-4 * LINE.dropper.stiffness * 0.5e-3
    check("effect of twice the residual stiffness", double / once, 2.0, within=2 * following)


def test_pantographs_far_apart_do_not_know_each_other() -> None:
    """Two on one train, 140 m apart, and each alone, until waves pass from one to the other.

    Within 0.35 s they would have to run at 400 m/s, 80 m/s less towards the trailing one; the wires
    carry 122 m/s, and the shortest waves of this mesh are a fifth faster.
    """
    line = en50318_line(8)
    mesh = mesh_of(line, 3)

    def run(start: float, behind: tuple[float, ...]) -> History:
        pair = train(
            80.0,
            start,
            start + 28.0,
            behind=behind,
            static_force=150.0,
            raise_time=0.2,
            nominal_height=5.6,
        )
        return march(problem_of(line, WHOLE, train=pair, numerics=numerics(1e-3)), mesh)

    both, leading, trailing = run(260.0, (0.0, 140.0)), run(260.0, (0.0,)), run(120.0, (0.0,))
    steps = len(both.time)
    distance = both["contact_position"][:, 0] - both["contact_position"][:, 1]
    check("distance [m]", distance, 140.0, within=4 * EPS * 300.0)
    alone = np.column_stack([leading["contact_force"], trailing["contact_force"]])
    print(f"largest forces {alone.max(axis=0)} N")
    assert (alone.max(axis=0) > 100.0).all()
    # Round-off of so many steps, of heights of 5.5 m on the contact spring.
    within = 8 * np.sqrt(steps) * EPS * 5.5 * 5e4
    check("contact forces [N]", both["contact_force"], alone, within=within)
