"""Twin wires that move as one against the same wires with unknowns of their own.

Let w_1 and w_2 be what two like wires do, and s = (w_1 + w_2) / 2, d = w_1 - w_2. Where both hang
alike and the head presses both alike, nothing loads d: from rest it stays zero, and what is left
are the equations of s. Both programs solve these, in another order of sums.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from measuring import History, march
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of
from studies import few
from windowed import apart
from windowed import march as march_in_window

from catenary.cases.studies.hard import runs as hard_runs
from catenary.solver.problem.problem import EXACT, WindowChoice
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.time_loop.views.observers import StepView

# 40 m in the middle of eight spans.
RUN = [
    "line.n_spans=8", "train.start_m=190", "train.end_m=230", "evaluation.from_m=205",
    "evaluation.to_m=220", "train.raise_time_s=0.05", "mesh.elements_per_gap=4",
]  # fmt: skip
# Round-off of a step is some 1e-16 of the largest force. Where nothing switches it is carried on by
# vibrations, which do not grow, and adds up over n steps to n 1e-16 at most: 1e-13 here. Stiffness
# over dt^2 masses makes some ten times as much of it in forces.
SMOOTH = 1e-11
# What slackens or lifts off does so a little earlier or later, which each time makes up to a
# hundred times as much of a difference: see `test_windows_of_all_cases.py`.
SWITCHING = 1e-7
TWO_STRIPS = "pantographs.three_masses.strips={number=2,spacing_m=0.4,length_m=1.0}"
HOPPING = [
    "train.speed_km_h=360", "train.start_below_m=0.05", "train.raise_time_s=0",
    "pantographs.three_masses.masses_kg=[1.5,9,6]", "pantographs.three_masses.static_force_N=250",
    "pantographs.three_masses.static_force_by_speed=",
]  # fmt: skip
LINES: dict[str, tuple[list[str], float]] = {
    "as shipped": ([], SMOOTH),
    "two messenger wires": (["line.topology=twin_messenger"], SMOOTH),
    "overlap": (["line.overlap={first_span=3,n_spans=3,rise_m=0.3,distance_m=0.2}"], SMOOTH),
    "two pantographs, two strips": ([
        TWO_STRIPS,
        "train.pantographs=[{name='three_masses'},{name='three_masses',behind_m=15}]",
        "evaluation.to_m=210",
    ], SMOOTH),
    "damped contact": (
        ["effects.contact_damping=true", "contact.damping_N_s_per_m=50"], SMOOTH),
    "slack droppers, contact lost": ([
        *HOPPING, "contact.stiffness_N_per_m=3e5",
    ], SWITCHING),
    "residual stiffness, kept dampers": ([
        *HOPPING,
        "effects.residual_dropper_stiffness=true", "line.dropper.residual_stiffness_ratio=0.01",
        "line.dropper.slack_damping=kept",
    ], SWITCHING),
    "stops": (["line.steady_arm.uplift_stop_m=0.01", "train.end_m=260"], SWITCHING),
    "layers that absorb": ([
        *(f"line.ends.{side}.kind=absorbing_layer" for side in ("start", "end")),
        *(f"line.ends.{side}.spans=2" for side in ("start", "end")),
    ], SMOOTH),
    "ends that go on": (["line.ends.start.kind=periodic", "line.ends.end.kind=periodic"], SMOOTH),
    "fixed point": (["numerics.scheme=fixed_point"], SMOOTH),
    "generalized alpha, explicit": ([
        "numerics.integrator=generalized_alpha", "numerics.spectral_radius=0.8",
        "numerics.coupling=explicit", "numerics.dt_s=2e-4", "train.end_m=220",
    ], SMOOTH),
    "steps that adapt": (["numerics.adaptive_tolerance_N=1"], SMOOTH),
    "Hertz's law": (["contact.law=hertz"], SMOOTH),
    "damping of its own": ([
        "line.damping.per_component.droppers={alpha_s=1e-3,beta_per_s=0}",
        "line.damping.per_component.droppers_2={alpha_s=1e-3,beta_per_s=0}",
    ], SMOOTH),
}  # fmt: skip


@cache
def rest_of(name: str, relative: bool) -> LineAtRest:
    words = [*RUN, *LINES[name][0], f"effects.relative_motion={str(relative).lower()}"]
    scene = load_scene("dc_twin", words)
    return line_at_rest(problem_of(scene), mesh_of(scene))


def seen(view: StepView) -> dict[str, np.ndarray]:
    motion = [view.node_motion("w", rate).copy() for rate in (False, True)]
    return {
        "contact force": view.contact_force.copy(),
        "force on each wire": view.contact_wire_force.copy(),
        "head height": view.head_height.copy(),
        "dropper force": view.dropper_force.copy(),
        "uplift at arms": view.arm_uplift.copy(),
        "displacement of nodes": motion[0],
        "velocity of nodes": motion[1],
        "energy": np.array(view.energies()[:2]),
    }


@cache
def history_of(name: str, relative: bool) -> History:
    rest = rest_of(name, relative)
    return march(rest.problem, rest.mesh, seen)


def table(history: History) -> dict[str, np.ndarray]:
    return {name: np.array([row[name] for row in history.watched]) for name in history.watched[0]}


@pytest.mark.parametrize(
    "name",
    few(
        LINES,
        "as shipped",
        "overlap",
        "stops",
        "two messenger wires",
        "slack droppers, contact lost",
        "Hertz's law",
    ),
)
def test_they_do_what_wires_with_unknowns_of_their_own_do(name: str) -> None:
    """Forces, droppers, arms, every node's motion and energies, each by its own largest value."""
    apart_, one = (table(history_of(name, relative)) for relative in (True, False))
    worst = 0.0
    for what, expected in apart_.items():
        assert one[what].shape == expected.shape
        scale = np.abs(expected).max()
        assert scale > 0.0
        off = np.abs(one[what] - expected).max() / scale
        print(f"{name}: {what} of up to {scale:.4g}, {off:.1e} apart")
        worst = max(worst, off)
    assert worst < LINES[name][1]


def test_each_wire_has_its_share_and_not_the_sum() -> None:
    rows = table(history_of("as shipped", False))
    left, right = rows["force on each wire"].T
    assert np.abs(left - right).max() <= 1e-12 * left.max()
    assert np.abs(left + right - rows["contact force"][:, 0]).max() <= 1e-12 * left.max()
    assert left.max() > 50.0


def test_the_scenes_lift_off_and_slacken_where_they_should() -> None:
    rows = table(history_of("slack droppers, contact lost", False))
    assert (rows["contact force"][50:] == 0.0).sum() > 10
    slack = (np.abs(rows["dropper force"]) < 1e-9).sum(axis=0)
    x = rest_of("slack droppers, contact lost", False).mesh
    group = x.dropper_group[slack > 0]
    # Both droppers of a pair, each with a record of its own.
    assert (group == 0).sum() == (group == 1).sum() > 0


@pytest.mark.parametrize("name", ["as shipped", "two messenger wires"])
def test_the_line_at_rest_is_the_same_to_the_last_digit(name: str) -> None:
    """Wires hang, and give way to forces on one of them alone, each by itself."""
    apart_, one = (rest_of(name, relative) for relative in (True, False))
    assert one.model.numbering.width == 4
    assert apart_.model.numbering.width == 2 * len(one.mesh.wires)
    for field in ("height", "slope", "dropper_force", "dropper_length"):
        assert np.array_equal(getattr(one.form, field), getattr(apart_.form, field)), field
    assert np.array_equal(one.lift.compliance, apart_.lift.compliance)
    # Droppers join the two but softly: one wire alone gives way further.
    assert one.lift.of_wires[0, 0] > 1.3 * one.lift.lift[0]


def test_the_line_holds_what_the_contact_forces_give_it() -> None:
    """Average acceleration takes from the balance of energy what damping takes, and nothing else:
    that of each wire's contact force, which a sum in place of a share would double."""
    run = hard_runs.run(rest_of("as shipped", False), MPI.COMM_SELF, with_work=True)
    print(f"energy gained: {run.energy_gain():.1e} of {run.energy_scale():.3g} J")
    assert abs(run.energy_gain()) < 1e-9 and run.energy_scale() > 1.0


@pytest.mark.parametrize("name", ["as shipped", "two messenger wires"])
def test_an_exact_window_gives_the_forces_of_the_whole_line(name: str) -> None:
    rest = rest_of(name, False)
    whole = hard_runs.run(rest, MPI.COMM_SELF)
    found = march_in_window(rest, WindowChoice(EXACT))
    off = apart(found, whole)
    print(f"{name}: forces {off:.1e} apart")
    assert found.outcome == "done" and off < 1e-10
