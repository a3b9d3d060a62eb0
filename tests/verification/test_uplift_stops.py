"""Stops above steady arms, of vertical lines and of lines with lateral motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check, march
from small_lines import WHOLE, ac_simple_line, mesh_of, problem_of, train

import catenary
from catenary.meshgen.mesh import MESSENGER_WIRE
from catenary.solver.problem.defects import WrongTension
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.form_finding import find_form

GAP, STIFFNESS = 0.03, 1e5


@pytest.mark.parametrize("lateral", [False, True])
def test_a_stop_ends_the_uplift_of_its_arm(lateral: bool) -> None:
    """Its force is k max(0, w - gap) in every step of a line without damping; without it the wire
    goes much higher."""
    line = ac_simple_line(4)
    free = replace(line.steady_arm, inclination=np.deg2rad(10.0) if lateral else None)
    names = WHOLE | ({"lateral_motion"} if lateral else set())
    going = train(80.0, 70.0, 125.0, static_force=250.0, raise_time=0.1)
    seen = {}
    for name, arm in {
        "free": free,
        "stopped": replace(free, uplift_stop=GAP, stop_stiffness=STIFFNESS),
    }.items():
        own = replace(line, steady_arm=arm)
        still = Damping(0.0, 0.0)
        problem = problem_of(own, names | {"uplift_stops"}, train=going, damping=still)
        seen[name] = march(problem, mesh_of(own, 3), lambda view: view.stop_force.copy())
    force, uplift = np.array(seen["stopped"].watched), seen["stopped"]["arm_uplift"]
    pushed = STIFFNESS * np.maximum(0.0, uplift - GAP)
    check("force of the stops [N]", force, pushed, within=1e-8 * STIFFNESS * GAP)
    assert force.max() > 100.0 and (force.max(axis=1) > 0.0).mean() < 0.5
    assert seen["free"]["arm_uplift"].max() > 1.3 * GAP and uplift.max() < 1.7 * GAP
    assert np.array(seen["free"].watched).size == 0


@pytest.mark.parametrize("lateral", [False, True])
@pytest.mark.parametrize("factor", [0.92, 1.05])
def test_stops_stay_where_they_were_installed(lateral: bool, factor: float) -> None:
    """A messenger wire of another tension lowers or raises the arms: the stops do not go along, so
    that their force counts from the height at the installation."""
    line = ac_simple_line(4)
    slope = np.deg2rad(10.0) if lateral else None
    arm = replace(line.steady_arm, inclination=slope, uplift_stop=GAP, stop_stiffness=STIFFNESS)
    problem = problem_of(
        replace(line, steady_arm=arm),
        WHOLE | {"uplift_stops", "wrong_tension"} | ({"lateral_motion"} if lateral else set()),
        train=train(80.0, 70.0, 125.0, static_force=300.0, raise_time=0.1),
        damping=Damping(0.0, 0.0),
        defects=(WrongTension(MESSENGER_WIRE, factor),),
    )
    mesh = mesh_of(problem.line, 3)
    arms = mesh.steady_arms
    sound = find_form(replace(problem, effects=problem.effects - {"wrong_tension"}), mesh)[1]
    raised = (find_form(problem, mesh)[1].height - sound.height)[arms]
    assert np.abs(raised).max() > 2e-3 and (raised > 0.0).all() == (factor > 1.0)
    seen = march(problem, mesh, lambda view: view.stop_force.copy())
    force, uplift = np.array(seen.watched), seen["arm_uplift"]
    pushed = STIFFNESS * np.maximum(0.0, raised + uplift - GAP)
    check("force of the stops [N]", force, pushed, within=1e-8 * STIFFNESS * GAP)
    assert force.max() > 100.0


def test_a_line_that_rests_on_a_stop_is_refused() -> None:
    scene = catenary.load("ac_simple", short=True)
    errors = {"dropper_lengths": {"by_dropper": [[3, 9, -60.0], [4, 1, -60.0]]}}
    line = {"steady_arm.uplift_stop_m": 0.03}
    sentence = r"uplift_stop_m is 0\.03 m, but the steady arm at 165 m rests 0\.0\d+ m above"
    with pytest.raises(catenary.InputError, match=sentence):
        catenary.static(scene.replace(line=line, irregularities=errors))
    line = {"steady_arm.uplift_stop_m": 0.08}
    catenary.static(scene.replace(line=line, irregularities=errors))


def test_a_file_has_forces_of_stops_where_there_are_some() -> None:
    scene = catenary.load("ac_simple", short=True).replace(
        train={"end_m": 170, "raise_time_s": 0.1},
        line={"n_spans": 4},
        evaluation={"from_m": 120, "to_m": 160},
        output={"field_every_s": 0},
    )
    stopped = {"steady_arm.uplift_stop_m": 0.01, "damping.alpha_s": 0}
    run = catenary.run(scene.replace(line=stopped))
    force, uplift = run.channel("stop_force").values, run.channel("arm_uplift").values
    pushed = 1e5 * np.maximum(0.0, uplift - 0.01)
    check("force in the file [N]", force, pushed, within=1e-6 * pushed.max())
    assert force.max() > 50.0
    assert "stop_force" not in catenary.run(scene).channels


def test_a_stiffness_without_a_stop_is_refused() -> None:
    key = "line.steady_arm.uplift_stop_stiffness_N_per_m"
    with pytest.raises(catenary.InputError, match="no uplift_stop_m"):
        catenary.load("ac_simple").replace({key: 1e5})
