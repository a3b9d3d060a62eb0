"""Stops above steady arms, of vertical lines and of lines with lateral motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from measuring import check, march
from program import catenary
from small_lines import WHOLE, ac_simple_line, mesh_of, problem_of, train

from catenary.postproc.read.results import Results
from catenary.solver.problem.problem import Damping

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


def test_a_file_has_forces_of_stops_where_there_are_some(tmp_path: Path) -> None:
    short = [
        "--short",
        *("--set train.end_m=170 --set line.n_spans=4 --set train.raise_time_s=0.1").split(),
    ]
    stretch = ["--set", "evaluation.from_m=120", "--set", "evaluation.to_m=160"]
    stop = ["--set", "line.steady_arm.uplift_stop_m=0.01", "--set", "line.damping.alpha_s=0"]
    for name, more in (("with", stop), ("without", [])):
        run = catenary(
            "run", "ac_simple", "-o", str(tmp_path / name), *short, *stretch, *more, cwd=tmp_path
        )
        assert run.code == 0, run.stderr
    with Results(tmp_path / "with" / "run.h5") as results:
        force, uplift = results.channel("stop_force"), results.channel("arm_uplift")
        pushed = 1e5 * np.maximum(0.0, uplift - 0.01)
        check("force in the file [N]", force, pushed, within=1e-6 * pushed.max())
        assert results.extremes("stop_force")[1].max() == force.max() > 50.0
        assert results.line_record.whole
    with Results(tmp_path / "without" / "run.h5") as results:
        assert not results.has("stop_force") and results.line_record.whole


def test_a_stiffness_without_a_stop_is_refused(tmp_path: Path) -> None:
    key = "line.steady_arm.uplift_stop_stiffness_N_per_m"
    run = catenary("check", "ac_simple", "--set", f"{key}=1e5", cwd=tmp_path)
    assert run.code == 2 and "no uplift_stop_m" in run.stderr
