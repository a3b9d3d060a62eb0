"""The damper of a slack dropper: released with the spring, or kept in action as the paper prints.

With it kept a dropper carries max(E, r E) + c e', E = N0 + k e. Every state of marches is held
against that law, and a whole march against dense matrices with every set of slack droppers tried.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from dense_line import DenseLine
from equations import Residual
from measuring import COMM, check, continued, march, matrix_of
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train
from studies import few_values
from ts_alpha2 import TS_ALPHA2

from catenary.meshgen.line import DropperPlace
from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.model.partition import distribute
from catenary.solver.problem.defects import DropperBreak
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.after_incidents import acceleration_jump, changed_line, unchanged
from catenary.solver.statics.form_finding import find_form
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March

EPS = np.finfo(float).eps
# The damping of the paper's average line; the droppers' is 2.75 kN s/m with it.
AVERAGE = Damping(alpha=0.0275, beta=0.0)
RESIDUAL = frozenset({"residual_dropper_stiffness"})


def short_line() -> LineData:
    """Two spans of 24 m with three droppers each."""
    return replace(
        en50318_line(2),
        span_lengths=(24.0, 24.0),
        dropper_positions=((4.0, 12.0, 20.0),) * 2,
        pre_sag=((0.0,) * 3,) * 2,
    )


def problem_on(line: LineData, **changes: Any) -> Problem:
    """A head that rises into the wire, fast and strong enough to leave droppers slack."""
    run = train(100.0, 6.0, 42.0, static_force=260.0, raise_time=0.0, nominal_height=5.5)
    usual = problem_of(
        line,
        WHOLE,
        damping=AVERAGE,
        train=replace(run, start_below=0.02),
        numerics=numerics(1e-3),
        slack_dampers_act=True,
    )
    return replace(usual, **changes)


@pytest.mark.parametrize("share", [0.0, pytest.param(0.01, marks=pytest.mark.study)])
@pytest.mark.parametrize("dampers_act", [True, False], ids=["kept", "released"])
def test_a_march_is_that_of_dense_matrices_with_every_set_tried(
    dampers_act: bool, share: float
) -> None:
    line = short_line()
    mesh = mesh_of(line, 2)
    effects = WHOLE | (RESIDUAL if share else frozenset())
    problem = problem_on(
        line,
        effects=effects,
        damping=Damping(alpha=5e-3, beta=0.0),
        slack_dampers_act=dampers_act,
        residual_stiffness_ratio=share,
    )
    model, form = find_form(problem, mesh)
    seen = march(problem, mesh, lambda view: view.checkpoint() if view.step == 0 else None)
    dense = DenseLine(problem, mesh, form, dampers_act, share)
    start = seen.watched[0]
    dense.state = np.zeros((3, dense.size))
    dense.state[:, -2:] = start["pantograph_0"].reshape(3, 2)
    assert not any(start[name].any() for name in ("displacement", "velocity", "acceleration"))
    slack, forces, droppers = set(), [], []
    for number, x in enumerate(seen["contact_position"][1:, 0]):
        whole = number % 100 == 50
        force, carried = dense.step(x, every_set=whole)
        assert not whole or dense.tried == 1  # of 128 sets
        slack.add(dense.acting)
        forces.append(force)
        droppers.append(carried)
    lost = sum(force == 0.0 for force in forces)
    print(f"{len(slack)} sets met, contact lost in {lost} of {len(forces)} steps")
    assert len(slack) > 7 and lost > 40 and any(len(acts - {-1}) > 2 for acts in slack)
    for name, own, expected in (
        ("contact force [N]", seen["contact_force"][1:, 0], forces),
        ("dropper forces [N]", seen["dropper_force"][1:], droppers),
    ):
        check(name, own, expected, within=1e-9 * np.abs(expected).max())


def test_the_laws_differ_by_the_damper_of_slack_droppers_only() -> None:
    """Without damping in the droppers both are the same, bit for bit."""
    line = short_line()
    mesh = mesh_of(line, 2)
    own = replace(AVERAGE, per_component={"droppers": (0.0, 0.0)})
    for damping, same in ((own, True), (AVERAGE, False)):
        kept, released = (
            march(problem_on(line, damping=damping, slack_dampers_act=acts), mesh)
            for acts in (True, False)
        )
        assert (released["dropper_force"] == 0.0).any()
        apart = np.abs(kept["contact_force"] - released["contact_force"]).max()
        print(f"contact forces differ by up to {apart:.3g} N")
        assert (apart == 0.0) == same and (same or apart > 10.0)


LINE = replace(en50318_line(3), dropper_positions=((6.0, 18.0, 30.0, 42.0, 54.0),) * 3,
               pre_sag=((0.0,) * 5,) * 3)  # fmt: skip
WAYS: dict[str, dict[str, Any]] = {
    "implicit": {},
    "iterated": {"coupling": "iterated"},
    "explicit": {"coupling": "explicit"},
    "hht": {"integrator": "hht", "spectral_radius": 0.8},
    "generalized alpha": {"integrator": "generalized_alpha", "spectral_radius": 0.6},
    "newmark 0.6": {"gamma": 0.6, "beta": 0.3025},
    "fixed point": {"scheme": "fixed_point"},
    "adaptive": {"adaptive_tolerance": 0.5, "smallest_dt": 2.5e-4},
}


def on_its_way(**changes: Any) -> Problem:
    """One pantograph over the middle span."""
    run = train(70.0, 62.0, 97.0, static_force=300.0, raise_time=0.0, nominal_height=5.5)
    return problem_on(LINE, train=run, **changes)


@pytest.mark.parametrize(
    "share", [0.0, pytest.param(0.05, marks=pytest.mark.study)], ids=["", "residual stiffness"]
)
@pytest.mark.parametrize(
    "way", few_values(WAYS, "implicit", "generalized alpha", "fixed point", "adaptive")
)
def test_every_scheme_satisfies_the_law(way: dict[str, Any], share: float) -> None:
    effects = WHOLE | (RESIDUAL if share else frozenset())
    problem = on_its_way(
        numerics=numerics(1e-3, **way), effects=effects, residual_stiffness_ratio=share
    )
    rest = line_at_rest(problem, mesh_of(LINE, 2))
    seen = Residual(rest)
    with March(COMM, *rest) as marching:
        assert marching.run([seen]).outcome == "done"
    print(f"{seen.n_slack} times a slack dropper")
    assert seen.n_slack > 40
    # A row has up to 16 entries. The correction stops when displacements change by eps_d and
    # velocities by eps_v, in terms of forces of 1 kN and more.
    loose = 1e5 * 1e-13 + 2.75e3 * 1e-10 if "scheme" in way else 0.0
    off = seen.largest
    check("residual of motion / largest force", off, 0.0, within=16 * EPS + 1e-3 * loose)
    check("forces of droppers [N]", seen.shown_off, 0.0, within=1e-8 + loose)


@pytest.mark.parametrize("scheme", ["one_solve", "fixed_point"])
def test_a_slack_dropper_that_breaks_takes_its_damper_along(scheme: str) -> None:
    """It breaks while its spring is slack and its damper acts."""
    mesh = mesh_of(LINE, 2)
    problem = on_its_way(numerics=numerics(1e-3, scheme))
    whole = march(problem, mesh, lambda view: view.checkpoint())
    number = int((whole["dropper_force"] == 0.0).sum(axis=0).argmax())
    step = int(np.flatnonzero(whole["dropper_force"][:, number] == 0.0)[5])
    model, form = find_form(problem, mesh)
    state = whole.watched[step]
    upper, lower = model.dofs(mesh.droppers[number])
    rate = state["velocity"][upper] - state["velocity"][lower]
    pushed = model.dropper_damping[number] * rate
    assert abs(pushed) > 10.0
    incident = DropperBreak(step * 1e-3, DropperPlace(float(mesh.x(mesh.droppers[number, 1]))))
    broken = replace(problem, effects=WHOLE | {"dropper_break"}, incidents=(incident,))
    first, later = unchanged(model, form), changed_line(model, form, (incident,))
    ownership = distribute(model, COMM.size, COMM.rank)
    moving = state["displacement"], state["velocity"]
    jump = acceleration_jump(COMM, ownership, first, later, moving)
    # The line loses the damper's force and nothing else: the spring carried none.
    force = np.zeros(model.n_dofs)
    force[upper], force[lower] = pushed, -pushed
    mass = matrix_of(model, mass=1.0)
    lost = mass @ jump - force
    lost[model.constrained] = 0.0
    check("force lost [N]", lost, 0.0, within=1e-9 * abs(pushed))
    after = march(broken, mesh)
    assert np.array_equal(after["contact_force"][: step + 1], whole["contact_force"][: step + 1])
    assert not after["dropper_force"][step + 1 :, number].any()


@pytest.mark.parametrize("way", ["implicit", "generalized alpha", "fixed point", "adaptive"])
def test_a_continued_run_is_the_uninterrupted_one(way: str) -> None:
    mesh, at = mesh_of(LINE, 2), 222
    problem = on_its_way(numerics=numerics(1e-3, **WAYS[way]))
    whole, rest = continued(problem, mesh, at)
    for name in ("contact_force", "dropper_force"):
        assert np.array_equal(rest[name], whole[name][at:]), name


@pytest.mark.study
def test_petsc_steps_the_same_law() -> None:
    """TSALPHA2 shares the matrices alone; differences of second-order methods fall by four."""
    mesh = mesh_of(short_line(), 2)
    alpha: dict[str, Any] = {"integrator": "generalized_alpha", "spectral_radius": 0.8}
    errors = []
    for dt in (5e-4, 2.5e-4, 1.25e-4):
        run = train(100.0, 6.0, 36.0, static_force=400.0, raise_time=0.05, nominal_height=5.5)
        own, second = (
            march(
                problem_on(
                    short_line(), train=run, effects=WHOLE - {"contact_loss"},
                    numerics=numerics(dt, scheme, **alpha),
                ),
                mesh,
            )
            for scheme in ("one_solve", TS_ALPHA2)
        )  # fmt: skip
        apart = (own["contact_force"] - second["contact_force"])[:: round(5e-4 / dt)]
        errors.append(float(np.sqrt((apart**2).mean())))
        slack = (own["dropper_force"] == 0.0).sum()
    print(f"rms differences [N]: {errors}; {slack} slack droppers")
    assert slack > 100
    assert errors[0] / errors[-1] > 10.0
