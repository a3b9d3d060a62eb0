"""Whole runs beside those of a second program, ``plain_line.py``, and figures made by it.

``reference/expected.csv`` of the cases is what that program gives for the case's inputs, on the
case's mesh and with its time step: `python -m pytest -m study -s` of this file prints the figures.
"""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest
from measuring import check, march
from plain_line import History, PlainLine
from plain_mesh import graded, mesh_on
from scenes import load_scene, shipped
from scenes import mesh_of as mesh_of_scene
from scenes import problem_of as problem_of_scene
from small_lines import WHOLE, ac_simple_line, en50318_line, mesh_of, problem_of, train
from studies import few

from catenary.meshgen.line import Line
from catenary.meshgen.mesh import CONTACT_WIRE, LineMesh
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import ClampedWire, LineData
from catenary.meshgen.wires import Conductor
from catenary.postproc.evaluate.statistics import contact_statistics
from catenary.solver.statics.elasticity import middle_span

CASES = {
    "re330_stitched": {"simple": ["line.topology=simple", "line.stitch_wire="], "stitched": []},
    "shinkansen_compound": {
        "new": [],
        "old": ["line.contact_wire.tension_N=14700", "line.auxiliary_wire.tension_N=14700"],
    },
    "record_574": {"": []},
    "dc_twin": {"": []},
}


def _pair_under_stitch_wires() -> tuple[Line, LineMesh, tuple[float, ...]]:
    stitch = ClampedWire(Conductor(3500.0, 0.31, 1.6), 18.0, 0.38, 1e7)
    line = make_line(replace(ac_simple_line(4), topology="stitched", stitch_wire=stitch))
    return line, mesh_on(line, graded(line, 0.2, 1.6, 1.5)), (0.0, 40.0)


def _one(data: LineData) -> tuple[Line, LineMesh, tuple[float, ...]]:
    line = make_line(data)
    return line, mesh_of(line, 4), (0.0,)


RUNS = {
    "en50318": lambda: _one(en50318_line(4)),
    "ac_simple": lambda: _one(ac_simple_line(4)),
    "pair": _pair_under_stitch_wires,
}


@pytest.mark.parametrize("run", few(RUNS, "en50318"))
def test_a_run_is_that_of_a_second_program(run: str) -> None:
    """Static tensions and contact forces at each step, through slack droppers and losses."""
    line, mesh, behind = RUNS[run]()
    length = line.span_lengths[0]
    course = train(
        83.0, length + behind[-1], 3 * length, static_force=150.0, behind=behind, nominal_height=5.1
    )
    problem = problem_of(line, WHOLE, train=course, evaluation=(length, 3 * length))
    history, plain = march(problem, mesh), PlainLine(problem, mesh)
    tension = history["dropper_force"][0]
    # Both find lengths to 1e-10 m, which is worth 24 EI / h^3 + 2 T / h at a node of either wire.
    wire, h = line.wire(CONTACT_WIRE), np.diff(mesh.x(mesh.wires[CONTACT_WIRE])).min()
    node = 24 * wire.bending_stiffness / h**3 + 2 * wire.tension / h
    check("tensions at rest [N]", tension, plain.tension, within=2e-10 * node)
    slack = (history["dropper_force"] == 0.0).any()
    found = plain.run(5.1)
    force = history["contact_force"][1:][: len(found.force)]
    print(f"droppers slacken: {slack}; {np.count_nonzero(force == 0.0)} steps without contact")
    # The same 1e-10 m in the stretch of a dropper of 1e5 N/m, which is stiffer than the contact.
    check("contact forces [N]", found.force[: len(force)], force, within=1e-5)


def figures_of(case: str, words: list[str]) -> dict[str, float]:
    """Figures of a case by the second program, named as in ``expected.csv``."""
    scene = load_scene(case, words)
    problem, mesh = problem_of_scene(scene), mesh_of_scene(scene)
    plain, span = PlainLine(problem, mesh), middle_span(problem.line)
    _, lift = plain.elasticity(*span)
    found = {"elasticity_max": 1e3 * lift.max(), "elasticity_min": 1e3 * lift.min()}
    return found | _of_run(plain, plain.run(plain.nominal_height(*span)))


def _of_run(plain: PlainLine, history: History) -> dict[str, float]:
    problem = plain.problem
    place, felt, height = (own[:, 0] for own in (history.place, history.force, history.height))
    force = contact_statistics("", place, felt, height, problem.numerics.dt, problem.evaluation)
    inside = (place >= problem.evaluation[0]) & (place <= problem.evaluation[1])
    lost = 100.0 * np.count_nonzero(felt[inside] <= 0.0) / np.count_nonzero(inside)
    return {
        "mean": force.mean,
        "std": force.std,
        "max": force.maximum,
        "min": force.minimum,
        "loss": lost,
        "uplift": 1e3 * history.uplift,
    }


@pytest.mark.study
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("case", CASES)
def test_expected_figures_are_those_of_the_second_program(case: str) -> None:
    path = shipped()[case].parent / "reference" / "expected.csv"
    with open(path, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert rows
    made: dict[tuple[str, str], dict[str, float]] = {}
    for row in rows:
        speed = row["speed_km_h"]
        kind = row.get("topology") or row.get("tensions") or ""
        key = kind, speed
        if key not in made:
            words = [*CASES[case][kind]]
            words += [f"train.speed_km_h={speed}"] if speed else []
            made[key] = figures_of(case, words) if speed else _at_rest(case, words)
            print(case, *key, {name: round(value, 4) for name, value in made[key].items()})
        value, printed = made[key][row["quantity"]], row["value"]
        half = 0.5 * 10.0 ** -len(printed.partition(".")[2])
        # Half a unit of the last digit, and a tenth of that for round-off of other machines.
        assert abs(value - float(printed)) <= 1.1 * half, row


def _at_rest(case: str, words: list[str]) -> dict[str, float]:
    scene = load_scene(case, words)
    problem, mesh = problem_of_scene(scene), mesh_of_scene(scene)
    _, lift = PlainLine(problem, mesh).elasticity(*middle_span(problem.line))
    return {"elasticity_max": 1e3 * lift.max(), "elasticity_min": 1e3 * lift.min()}
