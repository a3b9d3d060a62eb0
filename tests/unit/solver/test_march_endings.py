"""How a march ends or goes on: done, broken with a sentence, one by one, restored."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from measuring import History, registered, start_march
from petsc4py import PETSc
from small_lines import WHOLE, ac_simple_line, en50318_line, mesh_of, numerics, problem_of, train

from catenary import InputError, RunBroken
from catenary.base.errors import NotConverged
from catenary.mbs.head.stepping import Lowering
from catenary.meshgen.mesh import LineMesh
from catenary.solver.contact.forces_on_line import no_links
from catenary.solver.contact.pantographs import Heads
from catenary.solver.contact_problem.coupling import Explicit, InnerProblem
from catenary.solver.contact_problem.force_exchange import LineResponse
from catenary.solver.contact_problem.law_tangents import HertzInSteps, KinematicInSteps, LawInSteps
from catenary.solver.effects.effect import Effect
from catenary.solver.integrators import slow_path
from catenary.solver.integrators.slow_path import single_steps_of
from catenary.solver.kernels import native
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.loads import FunctionLoad
from catenary.solver.problem.contact_laws import HertzLaw, KinematicLaw, LinearLaw
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.form_finding import find_form
from catenary.solver.time_loop import march as time_loop
from catenary.solver.time_loop.compiled_steps import CompiledSteps
from catenary.solver.time_loop.march import Outcome
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.channels import RUN, Channel
from catenary.solver.time_loop.views.observers import StepView

# --- how a march ends -----------------------------------------------------------------------------


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


# --- iterations of a step that do not get there ---------------------------------------------------


SHORT_LINE = en50318_line(2)


def pressed(
    law: LawInSteps, depth: float, by_force: float, rate_by_force: float = 0.0
) -> tuple[InnerProblem, LineResponse, Heads]:
    """A contact ``depth`` [m] deep without force, which takes ``by_force`` [m/N] off it."""
    line, heads = LineResponse(1, 0, early=True), Heads(1)
    line.line.place[:], line.line.by_force[:] = -depth, by_force
    line.line.rate_by_force[:] = rate_by_force
    return InnerProblem(law, no_links()), line, heads


def test_contacts_without_a_common_solution_are_told() -> None:
    """The convective part of a damper outweighs all else: (1 + k b + c b') f = k d < 0 has f < 0,
    and f = 0 asks for f > 0."""
    law = LawInSteps(1, 1e4, 100.0, pulls=False)
    inner, line, heads = pressed(law, 0.01, 1e-5, rate_by_force=-0.1)
    with pytest.raises(NotConverged, match=r"no common solution; take a smaller numerics\.dt_s"):
        inner.solve(line, heads)
    assert inner.pivoted


def test_a_force_that_is_no_number_is_told_in_its_own_step() -> None:
    """1 + k b + c b' is zero exactly: contact that cannot be lost would have a force of k d / 0."""
    law = LawInSteps(1, 2.0, 1.0, pulls=True)
    inner, line, heads = pressed(law, 0.01, 0.5, rate_by_force=-2.0)
    with pytest.raises(RunBroken, match="no finite solution; try a smaller"):
        inner.solve(line, heads)


def test_a_law_whose_tangents_never_agree_is_told() -> None:
    """Tangents of a spring that softens overshoot, to one side and to the other."""
    law = HertzInSteps(HertzLaw(1e3, 0.5, 0.0, 0.1), 1)
    inner, line, heads = pressed(law, 0.01, 1e-3)
    with pytest.raises(NotConverged, match=r"no force within 50 tangents; take a smaller"):
        inner.solve(line, heads)


def test_forces_that_grow_without_bounds_end_the_explicit_coupling() -> None:
    law = LawInSteps(1, 1e9, 0.0, pulls=False)
    inner, line, heads = pressed(law, 0.0, 1e-5)
    heads.early_height[:] = 1.1
    with pytest.raises(RunBroken, match=r'beyond all bounds.*take numerics\.coupling = "implicit"'):
        Explicit(inner).solve(line, heads)


def test_a_kinematic_contact_that_would_pull_is_told() -> None:
    law, zero = KinematicInSteps(2, 1e-3, 0.55, from_time=0.5), np.zeros(2)
    law.accept(0.4, zero, zero, np.array([100.0, -50.0]))  # still being raised
    with pytest.raises(
        RunBroken, match=r"contact 2 would have to pull with 50 N.*take contact\.law"
    ):
        law.accept(0.6, zero, zero, np.array([100.0, -50.0]))


def test_a_line_whose_droppers_find_no_length_is_refused() -> None:
    """Droppers so heavy that each pass changes lengths nearly as much as the one before."""
    heavy = replace(
        SHORT_LINE,
        encumbrance=3.0,
        dropper=replace(SHORT_LINE.dropper, mass_per_length=16.0),
    )
    problem = problem_of(heavy, WHOLE | {"dropper_mass"})
    with pytest.raises(InputError, match=r"do not settle: .*line\.dropper\.mass_kg_per_m smaller"):
        find_form(problem, mesh_of(heavy, 1))


# --- states to continue from ----------------------------------------------------------------------


PROBLEM = problem_of(en50318_line(4), WHOLE, train=train(70.0, 70.0, 77.0), numerics=numerics(1e-3))
MESH = mesh_of(PROBLEM.line, 2)


def forces_and_states(kept: dict[str, Any] | None = None) -> History:
    march, _ = start_march(PROBLEM, MESH)
    with march:
        if kept is not None:
            march.restore(kept)
        history = History(lambda view: view.checkpoint() if view.step == 50 else None)
        march.run([history])
    return history


@pytest.fixture(scope="module")
def whole() -> History:
    return forces_and_states()


def state_of(whole: History) -> dict[str, Any]:
    return dict(next(state for state in whole.watched if state is not None))


def test_a_state_continues_bit_for_bit(whole: History) -> None:
    rest = forces_and_states(state_of(whole))["contact_force"]
    assert np.array_equal(rest, whole["contact_force"][50:])


def reverse(kept: dict[str, Any]) -> None:
    kept["row_of_node"] = kept["row_of_node"][::-1].copy()


def swap_two(kept: dict[str, Any]) -> None:
    """The contact wire and the messenger wire at one place."""
    rows = kept["row_of_node"].copy()
    first, second = (int(np.flatnonzero(rows == row)[0]) for row in (40, 41))
    rows[[first, second]] = rows[[second, first]]
    kept["row_of_node"] = rows


def shorten(kept: dict[str, Any]) -> None:
    kept["row_of_node"] = kept["row_of_node"][:-1]


def move_far(kept: dict[str, Any]) -> None:
    kept["displacement"] = kept["displacement"] + 1e3


# Damage of a state, of which its checksum may know nothing, and what is told.
OTHERS: dict[str, tuple[Callable[[dict[str, Any]], None], str]] = {
    "reversed": (reverse, "row_of_node puts node 0 in row .*, and along this line it is in row"),
    "two nodes": (swap_two, "row_of_node puts node .* in row 41, and along this line it is in row"),
    "short": (shorten, "row_of_node has the shape"),
    "far": (move_far, r"a node is 1000.* m from rest on a line of 2.* m"),
}


@pytest.mark.parametrize("how", OTHERS)
def test_a_state_of_another_line_is_refused(how: str, whole: History) -> None:
    damage, words = OTHERS[how]
    kept = state_of(whole)
    damage(kept)
    with pytest.raises(InputError, match=words):
        forces_and_states(kept)


def test_a_state_that_does_not_tell_its_nodes_is_refused(whole: History) -> None:
    kept = state_of(whole)
    del kept["row_of_node"]
    with pytest.raises(InputError, match="earlier version of Catenary"):
        forces_and_states(kept)


# --- each reason for steps one by one -------------------------------------------------------------


STEPPED_LINE = ac_simple_line(4)
SPRING = LinearLaw(5e4, 0.0)


@pytest.fixture(scope="module")
def stepped_mesh() -> LineMesh:
    return mesh_of(STEPPED_LINE, 3)


@pytest.fixture
def loops(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[bool]]:
    """Of each part of a march whether its steps are taken in a compiled loop."""
    found: list[bool] = []
    make = time_loop.compiled_steps

    def watched(*arguments: Any) -> Any:
        loop = make(*arguments)
        found.append(loop is not None)
        return loop

    monkeypatch.setattr(time_loop, "compiled_steps", watched)
    monkeypatch.setattr(slow_path, "_logged", set())
    yield found


def stepped_problem(law: Any = SPRING, **steps: Any) -> Problem:
    return problem_of(
        STEPPED_LINE,
        WHOLE | {"lowering"},
        contact=law,
        train=train(75.0, 90.0, 91.0, raise_time=0.0),
        numerics=numerics(1e-3, **steps),
    )


def marched(scene: Problem, stepped_mesh: LineMesh) -> Outcome:
    march, _ = start_march(scene, stepped_mesh)
    with march:
        return march.run([])


def lowered() -> Problem:
    scene = stepped_problem()
    placement = replace(scene.train.placements[0], lowering=Lowering(0.01, -60.0, 0.2, 0.4))
    return replace(scene, train=replace(scene.train, placements=(placement,)))


@pytest.mark.parametrize(
    ("scene", "word"),
    [
        (stepped_problem(adaptive_tolerance=5.0), "numerics.adaptive_tolerance_N"),
        (stepped_problem(coupling="iterated"), "iterated"),
    ],
)
def test_a_reason_is_told_where_kernels_do_not_take_steps_alone(
    scene: Problem,
    word: str,
    stepped_mesh: LineMesh,
    loops: list[bool],
    caplog: pytest.LogCaptureFixture,
) -> None:
    told = single_steps_of(scene)
    assert told is not None and word in told.reason and told.factor > 1.0
    with caplog.at_level(logging.WARNING):
        outcomes = [marched(scene, stepped_mesh) for _ in range(2)]
    assert [outcome.slow_path for outcome in outcomes] == 2 * [str(told)]
    # Once for both, as for the runs of a sweep.
    assert [record.message for record in caplog.records] == [str(told)]
    assert loops == [False, False]


@pytest.mark.parametrize(
    "scene",
    [
        stepped_problem(),
        stepped_problem(KinematicLaw()),
        stepped_problem(HertzLaw(1e6, 1.5, 0.0, 0.1)),
        lowered(),
    ],
)
def test_nothing_is_told_of_steps_in_the_loop(
    scene: Problem, stepped_mesh: LineMesh, loops: list[bool], caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        outcome = marched(scene, stepped_mesh)
    assert (outcome.slow_path, loops, caplog.records) == ("", [True], [])


def test_a_channel_that_is_a_function_is_told_by_its_march(
    stepped_mesh: LineMesh, loops: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    count = Channel("count", "-", "a count", RUN, lambda now: lambda: np.ones(1))  # type: ignore[arg-type, return-value]
    monkeypatch.setitem(channels.CHANNELS, "count", count)
    scene = stepped_problem()
    assert single_steps_of(scene) is None
    assert "a channel is a Python function" in marched(scene, stepped_mesh).slow_path
    assert loops == [False]


def test_other_ways_through_a_step_have_reasons_of_their_own() -> None:
    adapted = {"adaptive_tolerance": 5.0}
    assert single_steps_of(stepped_problem(scheme="fixed_point", **adapted)) is None
    assert single_steps_of(stepped_problem(coupling="explicit", **adapted)) is None


def test_the_reason_that_costs_most_is_told() -> None:
    adapted, both = {"adaptive_tolerance": 5.0}, {"adaptive_tolerance": 5.0, "coupling": "iterated"}
    of_one, of_both = (
        single_steps_of(stepped_problem(**adapted)),
        single_steps_of(stepped_problem(**both)),
    )
    assert of_one is not None and of_both is not None and "iterated" in of_both.reason
    assert of_both.factor > of_one.factor > 1.0


def test_steps_whose_free_part_others_take_are_refused_as_a_prepared_line(
    stepped_mesh: LineMesh,
) -> None:
    class Apart(CompiledSteps):
        """Steps as an ensemble takes them."""

        def _made(self, parts: native.StepParts, block: native.Block) -> Any:
            return super()._made(parts._replace(free=None), block)

    march, _ = start_march(stepped_problem(), stepped_mesh)
    with march, pytest.raises(ValueError, match="these steps are taken by an ensemble"):
        Apart(*march.in_loop(), shows=False).steps().write("nowhere", None)
