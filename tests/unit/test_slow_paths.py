"""What makes steps of a line slower than they could be, as plan, log and march tell it."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from measuring import start_march
from mpi4py import MPI
from scenes import load_scene, with_words
from scenes import mesh_of as mesh_of_scene
from scenes import problem_of as problem_of_scene
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

import catenary
from catenary.cases.run.needs import needs_with_mesh
from catenary.cases.scene.checks.mesh_size import (
    SEVERAL_TYPES,
    STATION_COST,
    STEP_OVERHEAD,
    STEP_PER_UNKNOWN,
    cost_of_stations,
    estimate_march,
)
from catenary.solver.effects.build_model import numbering_of
from catenary.solver.integrators import slow_path
from catenary.solver.integrators.slow_path import PARTS, slow_path_of
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March

HHT = 'numerics.integrator="hht"', "numerics.spectral_radius=0.8"
BY_COMPONENT = "line.damping.per_component={contact_wire={alpha_s=0.01,beta_per_s=0.02}}"


def test_the_plan_says_what_makes_steps_slower_and_by_how_much() -> None:
    plain, damped, slow = (
        catenary.plan(with_words("en50318_2002", more))
        for more in ([], [*HHT, BY_COMPONENT], ['numerics.coupling="explicit"'])
    )
    for plan in (plain, damped):
        assert "slower" not in str(plan)
    (told,) = (line for line in str(slow).splitlines() if "slower" in line)
    assert "numerics.coupling" in told
    assert slow.figures["wall_s"] == pytest.approx(PARTS * plain.figures["wall_s"])


def test_log_and_outcome_of_a_march_say_the_same(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Warnings are given once a process, of which other tests are a part.
    monkeypatch.setattr(slow_path, "_logged", set())
    damping = Damping(1e-4, 0.0125, {"contact_wire": (2e-3, 0.3)})
    line = en50318_line(3)
    for coupling, slower in (("implicit", False), ("explicit", True)):
        steps = numerics(1e-3, integrator="hht", spectral_radius=0.8, coupling=coupling)
        problem = problem_of(
            line, WHOLE, damping=damping, train=train(70.0, 70.0, 70.5), numerics=steps
        )
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            marched, _ = start_march(problem, mesh_of(line, 3))
            with marched:
                outcome = marched.run([])
        assert bool(outcome.slow_path) is slower
        assert [record.message for record in caplog.records] == [outcome.slow_path] * slower
        told = slow_path_of(problem, numbering_of(problem, mesh_of(line, 3)))
        assert (str(told) if told else "") == outcome.slow_path


@pytest.mark.parametrize(
    ("damped", "general"),
    [pytest.param((), False, marks=pytest.mark.study), ((BY_COMPONENT,), True)],
)
def test_a_march_tells_that_no_kernels_are_compiled_for_its_line(
    damped: tuple[str, ...], general: bool
) -> None:
    scene = load_scene("shinkansen_compound", ["effects.lateral_motion=true", *damped])
    rest = line_at_rest(problem_of_scene(scene), mesh_of_scene(scene))
    with March(MPI.COMM_SELF, *rest) as march:
        told = march.slow_path
    assert (told is not None) is general
    if told:
        assert told.factor == slow_path.GENERAL and "kernels are compiled for" in told.reason


def test_estimates_know_the_unknowns_of_stations() -> None:
    assert cost_of_stations({4: 20}) == 1.0
    assert cost_of_stations({8: 3}) == pytest.approx(0.5 * STATION_COST[8])
    # Half of the stations have six: ten unknowns on two stations.
    both = (1.0 + STATION_COST[6]) * 4.0 / 10.0
    assert cost_of_stations({4: 7, 6: 7}) == pytest.approx(SEVERAL_TYPES * both)
    step = [estimate_march(n, 1, "one_solve", 0, {size: 1}) for n, size in ((4000, 4), (12000, 12))]
    empty = estimate_march(0, 1, "one_solve")
    assert np.diff(np.array(step) - empty)[0] > 0
    ratio = (step[1] - empty) / (step[0] - empty)
    assert ratio == pytest.approx(STATION_COST[12])


def test_estimates_count_the_stations_of_each_station_type() -> None:
    elastic = [
        f"line.{wire}.{key}"
        for wire in ("contact_wire", "messenger_wire")
        for key in ("section_mm2=100", "youngs_modulus_GPa=110")
    ]
    scenes = {
        "plain": load_scene("ambrosio2012", ["train.pantographs.0.name=lumped"]),
        "planes": load_scene(
            "ambrosio2012",
            [
                "train.pantographs.0.name=lumped",
                *("effects.axial_motion=true", "effects.lateral_motion=true"),
                *("line.steady_arm.inclination_deg=10", *elastic),
            ],
        ),
        "overlap": load_scene("overlap", []),
    }
    needs = {name: needs_with_mesh(scene, mesh_of_scene(scene)) for name, scene in scenes.items()}
    of_line = {n: own.march / own.n_steps - STEP_OVERHEAD for n, own in needs.items()}
    assert of_line["planes"] == pytest.approx(STATION_COST[10] * of_line["plain"], rel=0.01)
    # Four unknowns but where the other section's wires hang beside, which is eight there.
    overlap = scenes["overlap"]
    numbering = numbering_of(problem_of_scene(overlap), mesh_of_scene(overlap))
    counts = np.bincount(np.diff(numbering.starts))
    stations = {size: int(counts[size]) for size in (4, 8)}
    assert sum(counts) == sum(stations.values())
    per_unknown = STEP_PER_UNKNOWN * cost_of_stations(stations)
    assert of_line["overlap"] == pytest.approx(per_unknown * numbering.n_unknowns)
