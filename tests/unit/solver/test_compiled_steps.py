"""Steps in one compiled loop against the same steps from Python, and against each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import paper_pantograph as paper
import pytest
from measuring import registered, start_march
from small_lines import WHOLE, ac_simple_line, mesh_of, numerics, problem_of, train
from studies import few

from catenary import RunBroken
from catenary.mbs.air import Polynomial, Tunnel, Uplift
from catenary.mbs.head.laws import Law, Regulation
from catenary.mbs.head.stepping import Lowering
from catenary.mbs.head.strips import Flexure, Strips, Suspension, Turning
from catenary.mbs.lumped import LumpedData
from catenary.mbs.mechanism.full_pantograph import FullPantograph
from catenary.mbs.rigid.forces import PointForce
from catenary.mbs.vehicle import Harmonic, Irregularity, VehicleMotion
from catenary.meshgen.mesh import CONTACT_WIRE, LineMesh
from catenary.solver.contact_problem import coupling
from catenary.solver.effects.effect import Effect
from catenary.solver.integrators import line_loads
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.loads import FieldLoad, FunctionLoad, ShapeLoad, harmonics, table
from catenary.solver.problem.contact_laws import HertzLaw, KinematicLaw, LinearLaw
from catenary.solver.problem.problem import Placement, Problem
from catenary.solver.schemes.scheme import OneSolve
from catenary.solver.time_loop import march as time_loop
from catenary.solver.time_loop.march import Outcome
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView
from catenary.solver.wind import forces_along

LINE = replace(ac_simple_line(4), stagger=(0.2, -0.2, 0.2, -0.2, 0.2))
TWO = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0))
PAIR = Strips(2, 0.56, 1.6, Suspension(1.0, 8000.0, 10.0))
BENDING = replace(PAIR, flexure=Flexure(600.0, 0.9, 3, 0.01), rake=0.3)
ROLLING = replace(TWO, strips=PAIR, roll=Turning(2.0, 600.0, 4.0))
# A limiter, a pneumatic damper and a spring that stiffens, on head and frame.
LAWS = (
    Law(1, 2, False, (-1.0, 0.0, 1.0), (0.0, 0.0, 2e4)),
    Law(1, 2, True, (-1.0, 0.0, 1.0), (-30.0, 0.0, 200.0)),
    Law(0, 1, False, (-0.05, -0.02, 0.0, 1.0), (-600.0, -60.0, 0.0, 0.0)),
)
TRACK = (Irregularity("fra_6", 3.0, 100.0, 1), Harmonic(0.01, 1.3))
UPLIFT = Uplift(Polynomial((0.0, 0.0, 0.01)), 0.7)
DRAG = (PointForce("drag", "lower_arm", (-80.0, 0.0, 0.0), (-0.82, 0.0, 0.0)),)
# What runs alternately by the loop and from Python: pantographs, contact, effects.
LINEAR = LinearLaw(5e4, 100.0)
SCENES: dict[str, tuple[tuple[Any, ...], Any, set[str]]] = {
    "one": ((TWO,), LinearLaw(5e4, 0.0), set()),
    "light": ((LumpedData((1.0, 15.0), (4200.0, 50.0), (10.0, 90.0)),), LinearLaw(1e6, 0.0), set()),
    "seven bodies": ((paper.data(),), LINEAR, {"contact_damping"}),
    "two kinds": ((TWO, paper.data()), LINEAR, {"contact_damping"}),
    "two strips that roll, on a track": (
        (ROLLING, replace(paper.data(), strips=PAIR)),
        LINEAR,
        {"contact_damping", "head_roll", "vehicle_motion"},
    ),
    "kinematic": ((TWO,), KinematicLaw(), set()),
    "hysteresis": ((TWO, paper.data()), HertzLaw(6e6, 1.5, 0.3, 0.1), {"contact_damping"}),
    "in the air of a tunnel": (
        (replace(TWO, uplift=UPLIFT), replace(paper.data(), wind=DRAG, uplift=UPLIFT)),
        LINEAR,
        {"contact_damping", "pantograph_aerodynamics"},
    ),
    "strips that bend": (
        (replace(TWO, strips=BENDING), replace(paper.data(), strips=BENDING)),
        LINEAR,
        {"contact_damping", "flexible_strips", "raked_strips"},
    ),
    "lowered": ((ROLLING, paper.data()), LINEAR, {"head_roll", "vehicle_motion", "lowering"}),
    "all bodies": (
        (paper.data(motion="all_bodies"), TWO),
        LINEAR,
        {"contact_damping", "vehicle_motion", "lowering"},
    ),
    "moving sideways": (
        (replace(paper.data(motion="all_bodies"), strips=Strips(2, 0.56)), ROLLING),
        LINEAR,
        {"contact_damping", "head_roll", "vehicle_motion", "lateral_motion", "regulated_lift"},
    ),
    "laws and controllers": (
        (replace(ROLLING, laws=LAWS), replace(paper.data(), laws=LAWS), TWO),
        LINEAR,
        {"contact_damping", "head_roll", "vehicle_motion", "pantograph_laws", "regulated_lift"},
    ),
}  # fmt: skip


class Own:
    """A controller that no kernel knows."""

    integral = 0.0

    def added_force(self, time: float, contact_force: float, head_height: float) -> float:
        self.integral += 1e-3 * (150.0 - contact_force)
        return min(max(3.0 * self.integral, -50.0), 50.0)

    def state(self) -> np.ndarray:
        return np.array([self.integral])

    def restore(self, state: np.ndarray) -> None:
        self.integral = float(state[0])


# Lowered after this time [s] by so much, see `problem`.
LOWERED = Lowering(0.15, -90.0, 0.01, 0.002)
LOWERINGS = {
    "lowered": (None, LOWERED),
    "all bodies": (replace(LOWERED, time=0.05, drop=1e-3), None),
}
# Of the pantographs of a scene, in their order.
REGULATORS: dict[str, tuple[Any, ...]] = {
    "moving sideways": (None, Own),
    "laws and controllers": (
        Regulation(False, 170.0, ((0.0, 0.2, 3.0, 0.0),), -50.0, 50.0, 5e-3, 0.05, 0.02),
        Regulation(True, 5.02, ((4.0, 0.0, 1e3, 1.0), (6.0, 0.0, 2e3, 1.0)), -50.0, 50.0, 1e-3),
        Regulation(False, 150.0, ((0.0, 0.1, 2.0, 0.0),), -30.0, 30.0, 0.01),
    ),
}


@pytest.fixture(scope="module")
def mesh() -> LineMesh:
    return mesh_of(LINE, 3)


def problem(scene: str, n_steps: int = 200, raise_time: float = 0.15) -> Problem:
    pantographs, law, effects = SCENES[scene]
    start, speed, dt = 90.0, 75.0, 1e-3
    regulators = REGULATORS.get(scene, (None,) * len(pantographs))
    lowerings = LOWERINGS.get(scene, (None,) * len(pantographs))
    placements = tuple(
        Placement(data, 160.0, 40.0 * number, 5.0, lowering=lowering, regulator=regulator)
        for number, (data, lowering, regulator) in enumerate(
            zip(pantographs, lowerings, regulators, strict=True)
        )
    )
    usual = train(speed, start, start + n_steps * dt * speed, raise_time=raise_time)
    usual = replace(usual, placements=placements, vehicle=VehicleMotion(TRACK, TRACK))
    return problem_of(
        LINE,
        WHOLE | effects,
        contact=law,
        train=usual,
        numerics=numerics(dt),
        evaluation=(95, 100),
        tunnels=(Tunnel(60.0, 100.0, 1.5, 5.0),),
    )


class Rows(Observer):
    """Keeps the rows of all steps, in blocks that end every ``every`` steps."""

    def __init__(self, every: int = 64) -> None:
        self.every, self.rows, self.blocks = every, [], []
        self.last_state: Any = None

    def start(self, stage: Stage) -> None:
        self.stage = stage

    def next_state(self, step: int) -> int:
        return step - step % self.every + self.every

    def observe(self, view: StepView) -> None:
        steps = np.arange(view.first_step, view.step + 1)
        assert steps[0] == len(self.rows)
        assert np.array_equal(view.times, steps * self.stage.dt)
        self.rows += list(view.rows.copy())
        self.blocks.append(len(view.rows))
        if view.step == self.stage.n_steps:
            self.last_state = view.checkpoint()

    def finish(self, outcome: str) -> None:
        self.outcome = outcome


def run(
    scene: Problem, mesh: LineMesh, rows: Rows, stop: Callable[[], bool] = lambda: False
) -> Outcome:
    march, _ = start_march(scene, mesh)
    with march:
        return march.run([rows], stop)


@pytest.fixture
def from_python(monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[Rows, Outcome]]:
    """Runs a scene step by step."""

    def run_so(scene: Problem, mesh: LineMesh) -> tuple[Rows, Outcome]:
        rows = Rows(1)
        with monkeypatch.context() as patch:
            patch.setattr(time_loop, "compiled_steps", lambda *arguments: None)
            return rows, run(scene, mesh, rows)

    return run_so


@pytest.mark.parametrize(
    "scene",
    few(SCENES, "all bodies", "one", "laws and controllers", "two strips that roll, on a track"),
)
def test_a_loop_gives_the_bits_of_steps_from_python(
    scene: str, mesh: LineMesh, from_python: Any
) -> None:
    # A kinematic contact may pull while pantographs are raised.
    raise_time = 0.3 if scene == "kinematic" else 0.15
    asked = problem(scene, raise_time=raise_time)
    expected, outcome = from_python(asked, mesh)
    rows = Rows()
    found = run(asked, mesh, rows)
    assert found.outcome == outcome.outcome == "done"
    assert np.array_equal(rows.rows, expected.rows, equal_nan=True)
    assert len(rows.blocks) < 100  # of which each takes 0.05 s at most
    assert found.counters == outcome.counters
    states = [seen.last_state for seen in (rows, expected)]
    assert states[0].keys() == states[1].keys()
    for name, values in states[0].items():
        assert np.array_equal(values, states[1][name], equal_nan=True), name
    # Those that are lowered are down.
    for number, lowering in enumerate(LOWERINGS.get(scene, ())):
        assert lowering is None or states[0][f"pantograph_{number}"][-1] == 2.0


@pytest.mark.parametrize("law", [LinearLaw(5e4, 0.0), HertzLaw(6e6, 1.5, 0.3, 0.1)])
@pytest.mark.parametrize("fault", ["cycles", "room", "bound"])
def test_steps_that_a_loop_repeats_or_leaves_to_the_scheme_are_those_from_python(
    fault: str, law: Any, mesh: LineMesh, from_python: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sets that are given up at once, room for rows of two droppers, and too small bounds."""
    scene = replace(problem("two kinds"), contact=law)
    scene = replace(scene, train=replace(scene.train, placements=tuple(
        replace(placement, static_force=400.0) for placement in scene.train.placements
    )))  # fmt: skip
    usual = from_python(scene, mesh)[0].rows
    if fault == "cycles":
        monkeypatch.setattr(coupling, "_MAX_ROUNDS", 0)
    elif fault == "room":
        monkeypatch.setattr("catenary.solver.contact_problem.force_exchange._FIRST_CAPACITY", 2)
        monkeypatch.setattr(coupling, "_FIRST_ROOM", 1)
    else:
        monkeypatch.setattr("catenary.solver.schemes.scheme._FIRST_BOUND", 1.0)
        monkeypatch.setattr("catenary.solver.schemes.scheme._FIRST_MARGIN", 1e-3)
    finish, finished = OneSolve.finish, []

    def counted(self: OneSolve, time: float, stop: bool) -> bool:
        finished.append(time)
        return finish(self, time, stop)

    expected, outcome = from_python(scene, mesh)
    monkeypatch.setattr(OneSolve, "finish", counted)
    rows = Rows()
    found = run(scene, mesh, rows)
    # Sets that cycle and bounds that are too small are seen to by the loop itself.
    assert len(finished) < len(rows.rows)
    assert (len(finished) > 0) == (fault == "room")
    assert np.array_equal(rows.rows, expected.rows, equal_nan=True)
    assert found.counters == outcome.counters
    assert found.counters["slack_dropper_steps"] > 0
    # Forces of a law that is not linear are found to 1e-10 of themselves.
    within = 1e-9 if isinstance(law, LinearLaw) else 1e-6
    assert np.abs(np.array(rows.rows) - usual)[:, :8].max() < within
    if fault == "cycles":
        assert found.counters["pivoted_steps"] == found.n_steps
    elif fault == "bound":
        assert found.counters["repeated_steps"] > 0


def test_a_step_that_breaks_amid_a_block_leaves_the_rows_before_it(
    mesh: LineMesh, from_python: Any
) -> None:
    """A kinematic contact that would pull: the loop leaves such a step, which then has no end."""
    scene = problem("kinematic", raise_time=0.07)
    expected, outcome = from_python(scene, mesh)
    assert "would have to pull" in outcome.outcome
    rows = Rows(1000)
    found = run(scene, mesh, rows)
    assert found.outcome == outcome.outcome and found.n_steps == outcome.n_steps > 50
    assert len(rows.rows) == found.n_steps + 1 > max(rows.blocks) > 10
    assert np.array_equal(rows.rows, expected.rows, equal_nan=True)


@pytest.mark.parametrize("method", ["_predict", "_advance"])
def test_a_pantograph_that_breaks_in_python_ends_the_run_as_from_python(
    method: str, mesh: LineMesh, from_python: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual, steps = getattr(FullPantograph, method), 0

    def breaks(self: FullPantograph, *given: Any) -> Any:
        nonlocal steps
        steps += 1
        if steps > 50:
            raise RunBroken("a joint broke")
        return usual(self, *given)

    monkeypatch.setattr(FullPantograph, method, breaks)
    expected, outcome = from_python(problem("all bodies", 100), mesh)
    steps, rows = 0, Rows(1000)
    found = run(problem("all bodies", 100), mesh, rows)
    assert "the step to t = 0.0510 s" in found.outcome and "a joint broke" in found.outcome
    assert found.outcome == outcome.outcome and found.n_steps == outcome.n_steps == 50
    assert found.counters == outcome.counters
    assert np.array_equal(rows.rows, expected.rows, equal_nan=True)


def test_a_wish_to_stop_is_seen_between_blocks(mesh: LineMesh) -> None:
    asked: list[int] = []
    rows = Rows(10**6)

    def stop() -> bool:
        asked.append(len(rows.rows))
        return len(asked) == 3

    found = run(problem("one", 1000), mesh, rows, stop)
    assert found.outcome == rows.outcome == "interrupted"
    # The step after the wish is the last one.
    assert found.n_steps == asked[-1] and len(rows.rows) == asked[-1] + 1
    assert asked[1] > 2


def test_nobody_needs_to_look(mesh: LineMesh) -> None:
    scene = problem("one", 200)
    march, _ = start_march(scene, mesh)
    with march:
        bare = march.run([])
    assert bare.outcome == "done" and bare.n_steps == 200
    assert bare.counters == run(scene, mesh, Rows()).counters


def test_an_observer_that_looks_at_each_state_is_shown_each(mesh: LineMesh) -> None:
    by_blocks, march = Rows(), start_march(problem("one", raise_time=0.0), mesh)[0]
    shown: list[float] = []

    class Looking(Observer):
        def next_state(self, step: int) -> int:
            return step + 1

        def observe(self, view: StepView) -> None:
            shown.append(float(np.abs(view.node_motion("w", False)).max()))

    with march:
        march.run([by_blocks, Looking()])
    assert len(shown) == len(by_blocks.rows) == 201
    # The head meets the wire after a tenth of a second.
    assert by_blocks.blocks == 201 * [1] and len(set(shown)) > 50


def _loads(builder: ModelBuilder) -> None:
    """One load of each kind, along the contact wire."""
    unknowns, weights = forces_along(builder.model, CONTACT_WIRE, ("w", "theta_y"))
    x = builder.mesh.x(builder.mesh.wires[CONTACT_WIRE])
    even = weights @ np.full(x.size, 3.0)
    builder.add_load(ShapeLoad(unknowns, even))
    builder.add_load(ShapeLoad(unknowns, even * 2.0, table([0.0, 0.05, 0.11], [0.0, 1.0, -1.0])))
    builder.add_load(ShapeLoad(unknowns[::7], even[::7], harmonics([7.0], [5.0], [0.1])))

    def fill(first: int, points: slice, slices: np.ndarray) -> None:
        times = 0.013 * (first + np.arange(slices.shape[0]))
        slices[:] = 4.0 * np.sin(0.1 * x[points] - 9.0 * times[:, None])

    builder.add_load(FieldLoad(unknowns, weights, 0.013, fill))
    one = builder.model.dofs(builder.mesh.wires[CONTACT_WIRE][50:52])
    builder.add_load(FunctionLoad("slow", one, lambda time: np.array([9.0, 8.0]) * np.sin(time)))


@pytest.mark.parametrize("slices", [3, 512])
def test_loads_that_change_with_time_are_taken_in_the_loop(
    slices: int, mesh: LineMesh, from_python: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(line_loads, "_MOST_SLICES", slices)
    scene = problem("one")
    with registered(Effect("loads", "loads", "loads", "test", False, build=_loads)):
        loaded = replace(scene, effects=scene.effects | {"loads"})
        expected, outcome = from_python(loaded, mesh)
        rows = Rows()
        found = run(loaded, mesh, rows)
    assert found.outcome == outcome.outcome == "done"
    assert "slow is a Python function" in found.slow_path
    assert max(rows.blocks) > 1 and len(rows.rows) == 201
    assert np.array_equal(rows.rows, expected.rows, equal_nan=True)
    without = Rows()
    run(scene, mesh, without)
    assert np.nanmax(np.abs(np.array(without.rows) - np.array(rows.rows))) > 1.0
