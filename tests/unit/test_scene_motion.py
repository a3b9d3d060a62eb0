"""Which bodies of a mechanism are moved in the time loop: keys, what they become, what is told."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import Scene, load_scene, problem_of, recorded, resolved, with_words

import catenary
from catenary import InputError, RunBroken
from catenary.cases.scene.checks.mesh_size import estimate_march
from catenary.mbs.build import has_joints
from catenary.mbs.head.stepping import Stepping
from catenary.mbs.lumped import LumpedData
from catenary.mbs.mechanism.full_pantograph import FullPantograph
from catenary.mbs.mechanism.multibody_pantograph import AllBodies, MultibodyData, reduced
from catenary.mbs.mechanism.reduction import RaisingPantograph
from catenary.mbs.rigid.joints import Constant, PrescribedPoint

CASE, KIND = "ambrosio2012", "pantographs.seven_body"
ALL = f"{KIND}.motion=all_bodies"
OWN_KEYS = {"constraint_handling", "substeps"}


def load(*overrides: str) -> Scene:
    return load_scene(CASE, overrides)


def data(scene: Scene) -> MultibodyData:
    found = problem_of(scene).train.placements[0].data
    assert isinstance(found, MultibodyData)
    return found


def test_a_mechanism_is_reduced_unless_the_scene_says_otherwise() -> None:
    assert data(load()).all_bodies is None
    assert not has_joints(data(load()))
    assert not has_joints(LumpedData((1.0,), (0.0,), (0.0,)))


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        ([], AllBodies("coordinate_partitioning", 1)),
        ([f"{KIND}.constraint_handling=baumgarte"], AllBodies("baumgarte", 1)),
        (
            [f"{KIND}.constraint_handling=augmented_lagrangian", f"{KIND}.substeps=4"],
            AllBodies("augmented_lagrangian", 4),
        ),
    ],
)
def test_all_bodies_reach_the_time_loop(overrides: list[str], expected: AllBodies) -> None:
    found = data(load(ALL, *overrides))
    assert found.all_bodies == expected
    assert has_joints(found)


def test_the_model_is_the_one_that_was_asked_for() -> None:
    from catenary.mbs.build import Operation, make_pantograph

    operation = Operation(150.0, 5.08, Stepping(0.5, 1e-3))
    assert isinstance(make_pantograph(data(load(ALL)), operation), FullPantograph)
    assert isinstance(make_pantograph(data(load()), operation), RaisingPantograph)


@pytest.mark.parametrize("overrides", [[], [ALL], [ALL, f"{KIND}.substeps=3"]])
def test_resolved_scene_is_the_same_again_and_holds_only_what_acts(overrides: list[str]) -> None:
    scene = load(*overrides)
    table = resolved(scene)["pantographs"]["seven_body"]
    assert OWN_KEYS & set(table) == (OWN_KEYS if overrides else set())
    again = recorded(scene)
    assert problem_of(again) == problem_of(scene)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ([f"{KIND}.substeps=2"], "substeps with motion = reduced, because it acts only with"),
        ([f"{KIND}.motion=reduced", f"{KIND}.constraint_handling=baumgarte"], "must not have"),
        ([ALL, f"{KIND}.substeps=0"], f"{KIND}.substeps is 0"),
        ([ALL, f"{KIND}.substeps=1.5"], "must be a whole number"),
        ([ALL, f"{KIND}.constraint_handling=lagrange"], "coordinate_partitioning"),
        ([f"{KIND}.motion=full"], "must be reduced or all_bodies"),
        (
            [ALL, f"{KIND}.strips.mass_kg=1", f"{KIND}.strips.stiffness_N_per_m=5000"],
            "strips on springs of their own are no bodies",
        ),
        (["pantographs.lumped.motion=all_bodies"], "pantographs.lumped.motion on the command line"),
        ([f"{KIND}.nominal_height_m=9"], "-3.973 m away from there, beyond the reach"),
        ([ALL, f"{KIND}.nominal_height_m=9"], "-3.973 m away from there, beyond the reach"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_sentence(overrides: list[str], words: str) -> None:
    with pytest.raises(InputError) as refused:
        load(*overrides)
    assert words in str(refused.value) and "\n" not in str(refused.value)


def test_bodies_go_where_their_loops_still_close_and_tables_where_they_end() -> None:
    """0.65 m below its working height the arm is beyond its tables, but not beyond its joints."""
    below = f"{KIND}.nominal_height_m=4.4"
    assert load(ALL, below).pantographs["seven_body"].nominal_height_m == 4.4
    with pytest.raises(InputError, match="beyond the reach of its mechanism"):
        load(below)
    lowest = reduced(data(load())).heights[0]
    bodies = data(load()).system
    arm = PrescribedPoint("arm low", "stabilisation_arm", Constant(lowest - 0.05))
    held = bodies.with_joints(arm)
    closed = held.assemble(bodies.start())
    assert np.abs(held.constraints(closed, 0.0).value).max() < 1e-9


def test_a_wire_beyond_the_bodies_reach_breaks_the_start_in_one_sentence() -> None:
    pantograph = FullPantograph(data(load(ALL)), 150.0, 5.08, Stepping(0.5, 1e-3))
    with pytest.raises(RunBroken, match="'seven_body' does not reach a wire at a height of 9 m"):
        pantograph.place(9.0)


def test_plan_names_the_model_and_counts_its_cost_and_channel() -> None:
    flushes = "output.flush_every_steps=100"
    reduced_plan = catenary.plan(with_words(CASE, [flushes]))
    plan = catenary.plan(with_words(CASE, [ALL, f"{KIND}.substeps=2", flushes]))
    assert "reduced to tables over its height" in str(reduced_plan)
    told = "all bodies in the time loop in 2 substeps, joints kept by coordinate_partitioning"
    assert told in str(plan)
    n = plan.figures["n_steps"]
    more = plan.figures["wall_s"] - reduced_plan.figures["wall_s"]
    expected = estimate_march(0, n, "one_solve", 2) - estimate_march(0, n, "one_solve")
    assert more == pytest.approx(expected, rel=1e-9)
    # 0.2 to 0.4 ms a substep.
    assert 2 * 2e-4 * n < more < 2 * 4e-4 * n
    # A number a row, in chunks that are kept whole, each with its entry in an index.
    more = plan.figures["result_B"] - reduced_plan.figures["result_B"]
    assert 8 * (n + 1) < more < 1.2 * 8 * (n + 1)
