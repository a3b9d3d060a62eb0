"""Steps that adapt end where shorter fixed steps end, and change nothing where they are idle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check, march, start_march
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.meshgen.line import DropperPlace
from catenary.meshgen.mesh import LineMesh
from catenary.solver.problem.contact_laws import HertzLaw, LinearLaw
from catenary.solver.problem.defects import DropperBreak
from catenary.solver.problem.problem import Numerics, Problem

DT = 1e-3


@pytest.fixture(scope="module")
def mesh() -> LineMesh:
    return mesh_of(en50318_line(3), 3)


def landing(steps: Numerics, **changes: object) -> Problem:
    """A head that starts 2 cm below the wire, pressed upward, and lands on a contact of 3e5 N/m,
    which damps its hops."""
    raised = replace(train(60.0, 40.0, 64.0, raise_time=0.05), start_below=0.02)
    usual = {"contact": LinearLaw(3e5, 300.0), "train": raised, "numerics": steps}
    return problem_of(en50318_line(3), WHOLE | {"contact_damping"}, **{**usual, **changes})


def rms(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.sqrt(np.mean((found - expected) ** 2)))


def test_errors_fall_with_the_tolerance(mesh: LineMesh) -> None:
    """The error of a step is of third order and that of a run of second: an 8th of the tolerance is
    half of the steps' size and a 4th of the error. Sizes are powers of two that end with the
    interval, which may change either error by a root of two: a factor from 2 to 8."""
    fine = march(landing(numerics(DT / 64)), mesh)["contact_force"][::64]
    errors = []
    for tolerance in (0.2, 0.025):
        adapting = numerics(DT, adaptive_tolerance=tolerance, smallest_dt=DT / 256)
        adapted = march(landing(adapting), mesh)
        errors.append(rms(adapted["contact_force"], fine))
        counted = adapted.outcome.counters
        print(tolerance, errors[-1], counted)
        assert counted["steps_above_tolerance"] == 0
        assert counted["steps_of_1_ms"] > 0 and counted["rejected_steps"] > 0
        taken = sum(n * float(k.split("_")[2]) for k, n in counted.items() if k[:9] == "steps_of_")
        check("sum of all steps [ms]", taken, 400.0, within=0.2)  # sizes have four digits in names
    fixed = rms(march(landing(numerics(DT)), mesh)["contact_force"], fine)
    print(f"fixed {fixed:.3g}, adapted {errors}")
    assert 2.0 < errors[0] / errors[1] < 8.0
    assert errors[1] < fixed / 4.0


def test_a_tolerance_that_is_never_met_changes_nothing(mesh: LineMesh) -> None:
    """Bit for bit, with no other set of matrices; without the key there are no counts either."""
    plain = march(landing(numerics(DT)), mesh)
    idle = march(landing(numerics(DT, adaptive_tolerance=1e6)), mesh)
    assert np.array_equal(plain["contact_force"], idle["contact_force"])
    assert np.array_equal(plain["dropper_force"], idle["dropper_force"])
    assert not {"rejected_steps", "steps_of_1_ms"} & set(plain.outcome.counters)
    steps = len(plain.time) - 1
    assert idle.outcome.counters["steps_of_1_ms"] == steps == plain.outcome.counters["steps"]


@pytest.mark.study
def test_steps_without_a_solution_are_halved(mesh: LineMesh) -> None:
    """Hertz's spring stiffens as the head lands, so that exchanges of forces do not converge at
    1 ms; with shorter steps there they do, and end where the implicit coupling of short steps ends.
    """
    hertz = {"contact": HertzLaw(1e8, 1.5, 0.8, 1e-3)}
    exchanged = {"coupling": "iterated", "eps_force": 1e-8, "max_iterations": 50}
    run, _ = start_march(landing(numerics(DT, **exchanged), **hertz), mesh)
    broken = run.run([])
    run.destroy()
    assert "do not agree on the contact forces" in broken.outcome
    # A tolerance that is never met: only failures shorten steps.
    halved = numerics(DT, **exchanged, adaptive_tolerance=1e6, smallest_dt=DT / 64)
    found = march(landing(halved, **hertz), mesh)
    assert found.outcome.outcome == "done"
    assert found.outcome.counters["failed_steps"] > 0
    assert found.outcome.counters["rejected_steps"] == 0
    fine = march(landing(numerics(DT / 16), **hertz), mesh)["contact_force"][::16]
    same = march(landing(numerics(DT), **hertz), mesh)["contact_force"]
    # No further from the truth than the implicit coupling with the same longest step.
    print(rms(found["contact_force"], fine), rms(same, fine))
    assert rms(found["contact_force"], fine) <= 1.5 * rms(same, fine)


@pytest.mark.parametrize("scheme", ["one_solve", "fixed_point"])
def test_a_continued_run_is_the_uninterrupted_one(scheme: str, mesh: LineMesh) -> None:
    """Over a landing, from a checkpoint amid short steps."""
    adapted = numerics(DT, scheme, adaptive_tolerance=0.05)
    checkpoints = []
    problem = landing(adapted, contact=LinearLaw(5e4, 100.0))
    whole = march(problem, mesh, lambda view: checkpoints.append(view.checkpoint()))
    levels = [int(state["contacts"][0]) for state in checkpoints]
    at = int(np.argmax(levels))
    assert 0 < at < len(levels) - 1 and levels[at] > 0
    again = march(problem, mesh, since=checkpoints[at])
    # The same operations on the same numbers.
    assert np.array_equal(again["contact_force"], whole["contact_force"][at:])


def test_incidents_under_short_steps(mesh: LineMesh) -> None:
    """A dropper breaks ahead of the head. With a tolerance that is never kept all steps with a
    contact are the shortest: the run is that of fixed short steps but for the time without a force,
    which must leave far less of an error than long steps do."""
    changes = {
        "contact": LinearLaw(5e4, 0.0),
        "train": train(60.0, 70.0, 94.0, raise_time=0.3),
        "incidents": (DropperBreak(0.2, DropperPlace(89.5)),),
    }
    short = march(landing(numerics(DT / 4), **changes), mesh)["contact_force"][::4]
    least = numerics(DT, adaptive_tolerance=1e-9, smallest_dt=DT / 4)
    adapted = march(landing(least, **changes), mesh)
    touching = adapted["contact_force"][:, 0] > 0.0
    # But for the three steps without an estimate.
    assert adapted.outcome.counters["steps_of_0.25_ms"] >= 4 * (touching.sum() - 3)
    long = march(landing(numerics(DT), **changes), mesh)["contact_force"]
    print(rms(adapted["contact_force"], short), rms(long, short))
    assert rms(adapted["contact_force"], short) < 0.25 * rms(long, short)
