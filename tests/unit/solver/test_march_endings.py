"""How a march ends: done, on request, or broken with a sentence; what observers have then seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import History, registered, start_march
from petsc4py import PETSc
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary import InputError, RunBroken
from catenary.meshgen.mesh import LineMesh
from catenary.solver.effects.effect import Effect
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.loads import FunctionLoad
from catenary.solver.problem.problem import Problem
from catenary.solver.time_loop.views.observers import StepView

LINE = en50318_line(3)
BREAKS_AT = 0.0105


@pytest.fixture(scope="module")
def mesh() -> LineMesh:
    return mesh_of(LINE, 2)


def problem(scheme: str = "one_solve", **changes: object) -> Problem:
    usual = problem_of(
        LINE, train=train(70.0, 70.0, 72.1), numerics=numerics(1e-3, scheme, max_iterations=200)
    )
    return replace(usual, **changes)


def explosion(builder: ModelBuilder) -> None:
    """A load that is no number from some time on."""

    def values(time: float) -> np.ndarray:
        return np.array([np.nan if time > BREAKS_AT else 0.0])

    at = builder.model.dofs(builder.mesh.droppers[:1, 1])
    builder.add_load(FunctionLoad("explosion", at, values))


EXPLODING = Effect(
    "explosion",
    "a load that is no number",
    "nothing good",
    "test",
    default=False,
    build=explosion,
)


def test_a_march_runs_to_the_end_of_its_stretch(mesh: LineMesh) -> None:
    run, _ = start_march(problem(), mesh)
    history = History()
    outcome = run.run([history])
    run.destroy()
    assert outcome.outcome == "done"
    # 2.1 m at 70 m/s are 30 ms.
    assert run.n_steps == outcome.n_steps == 30
    assert history.time == pytest.approx(1e-3 * np.arange(31), abs=1e-15)
    assert history.stage.n_steps == 30 and history.stage.dt == 1e-3
    assert history["contact_position"][:, 0] == pytest.approx(70.0 + 0.07 * np.arange(31))
    assert outcome.counters["steps"] == 30


def test_a_stop_request_ends_it_after_the_step(mesh: LineMesh) -> None:
    run, _ = start_march(problem(), mesh)
    history, asked = History(lambda view: None), []

    def stop() -> bool:
        asked.append(True)
        return len(asked) == 8

    outcome = run.run([history], stop)
    run.destroy()
    assert outcome.outcome == "interrupted"
    assert outcome.n_steps == 8
    assert len(history.time) == 9


@pytest.mark.parametrize("scheme", ["one_solve", "fixed_point"])
def test_what_is_no_number_breaks_the_run_with_a_sentence(scheme: str, mesh: LineMesh) -> None:
    with registered(EXPLODING):
        run, _ = start_march(problem(scheme, effects=WHOLE | {"explosion"}), mesh)
        history = History()
        outcome = run.run([history])
        run.destroy()
    # The step to 11 ms is the first to see it; everything up to 10 ms has been shown, and is good.
    assert "t = 0.0110 s" in outcome.outcome
    assert outcome.n_steps == 10
    assert len(history.time) == 11
    assert np.isfinite(history["contact_force"]).all()


@pytest.mark.parametrize("scheme", ["one_solve", "fixed_point"])
def test_a_head_that_is_no_number_breaks_the_run(scheme: str, mesh: LineMesh) -> None:
    run, _ = start_march(problem(scheme), mesh)
    history = History(lambda view: view.checkpoint())
    run.run([history])
    run.destroy()
    lost = history.watched[10]
    lost["pantograph_0"][:] = 1e308  # a number still, but none after the next step
    again, _ = start_march(problem(scheme), mesh)
    again.restore(lost)
    outcome = again.run([])
    again.destroy()
    assert "t = 0.0110 s" in outcome.outcome
    assert outcome.n_steps == 0


def test_an_observer_that_cannot_go_on_ends_the_run(mesh: LineMesh) -> None:
    def full_disk(view: StepView) -> None:
        if view.step == 5:
            raise RunBroken("the disk is full")

    run, _ = start_march(problem(), mesh)
    outcome = run.run([History(full_disk)])
    run.destroy()
    assert outcome.outcome == "the disk is full"
    assert outcome.n_steps == 5


def test_a_correction_that_does_not_settle_breaks_the_run(mesh: LineMesh) -> None:
    bad = problem("fixed_point", numerics=numerics(1e-3, "fixed_point", max_iterations=1))
    run, _ = start_march(bad, mesh)
    history = History()
    outcome = run.run([history])
    run.destroy()
    assert "does not converge" in outcome.outcome and "max_iterations" in outcome.outcome
    assert outcome.counters["unconverged_steps"] == 1
    assert len(history.time) == outcome.n_steps + 1 < 31


def test_exchanges_that_do_not_agree_break_the_run(mesh: LineMesh) -> None:
    """Four of them do not bring forces of 100 N to 1e-6 N."""
    bad = problem(numerics=numerics(1e-3, coupling="iterated", max_iterations=4))
    run, _ = start_march(bad, mesh)
    history = History()
    outcome = run.run([history])
    run.destroy()
    for words in (
        f"the step to t = {1e-3 * (outcome.n_steps + 1):.4f} s",
        "with the train at 7",
        "within 4 exchanges (numerics.max_iterations)",
        'take numerics.coupling = "implicit" or a smaller numerics.dt_s',
    ):
        assert words in outcome.outcome
    assert outcome.counters["unconverged_steps"] == 1
    assert len(history.time) == outcome.n_steps + 1 < 31


def test_the_time_step_cannot_be_changed_by_an_option(mesh: LineMesh) -> None:
    options = PETSc.Options()
    options["march_ts_dt"] = 5e-4
    try:
        run, _ = start_march(problem(), mesh)
        with pytest.raises(InputError, match=r"march_ts_dt.*numerics\.dt_s"):
            run.run([])
        run.destroy()
    finally:
        del options["march_ts_dt"]
