"""Twin wires that move as one share unknowns; with their relative motion each has its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from small_lines import WHOLE, ac_simple_line, mesh_of, problem_of

from catenary import InputError
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import CONTACT_WIRE, LineMesh
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import Overlaps, Twin
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import build, numbering_of, with_wires_apart
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.model.unknowns import Unknowns, number_unknowns
from catenary.solver.problem.problem import Problem

VERTICAL = "w", "theta_y"
RELATIVE = "relative_motion"
TOPOLOGIES = "twin", "twin_messenger"
OVERLAPS = Overlaps((2,), 3, 0.3, 0.2)


def twin_line(topology: str = "twin", overlaps: Overlaps | None = None) -> Line:
    data = replace(ac_simple_line(6 if overlaps else 3), twin=Twin(0.1, False), overlaps=overlaps)
    return make_line(replace(data, topology=topology))


def numbered(mesh: LineMesh, together: Mapping[str, str]) -> Unknowns:
    return number_unknowns(mesh, [dict.fromkeys(mesh.wires, VERTICAL)], together=together)


def model_of(problem: Problem, mesh: LineMesh) -> Model:
    return build(problem, mesh, np.ones(mesh.droppers.shape[0]))


def as_one(problem: Problem) -> Problem:
    return replace(problem, effects=problem.effects - {RELATIVE})


@pytest.fixture(scope="module", params=TOPOLOGIES)
def problem(request: pytest.FixtureRequest) -> Problem:
    """A twin line of three spans with all that hangs, and the relative motion of its wires."""
    return problem_of(twin_line(request.param), WHOLE | {RELATIVE})


@pytest.fixture(scope="module")
def mesh(problem: Problem) -> LineMesh:
    return mesh_of(problem.line, 3)


def test_stations_have_four_unknowns_in_place_of_six_and_eight(
    problem: Problem, mesh: LineMesh
) -> None:
    whole, shared = (numbering_of(one, mesh) for one in (problem, as_one(problem)))
    n_stations = mesh.wires[CONTACT_WIRE].size
    assert whole.width == 2 * len(mesh.wires) and shared.width == 4
    assert whole.n_unknowns == whole.size == whole.width * n_stations
    assert shared.n_unknowns == shared.size == 4 * n_stations
    assert not shared.missing.size and shared.in_stations
    for name, other in problem.line.twins:
        own, beside = (shared.numbers[mesh.wires[wire]] for wire in (name, other))
        assert np.array_equal(own, beside)
    taken, counts = np.unique(shared.numbers, return_counts=True)
    assert taken.size == shared.size and counts.max() == 2


def test_vectors_by_node_and_back_share_what_is_shared(problem: Problem, mesh: LineMesh) -> None:
    shared = numbering_of(as_one(problem), mesh)
    vector = np.random.default_rng(1).normal(size=shared.size)
    assert (shared.numbers >= 0).all()
    by_node = vector[shared.numbers]
    assert np.array_equal(shared.as_vector(by_node), vector)
    for name, other in problem.line.twins:
        assert np.array_equal(by_node[mesh.wires[name]], by_node[mesh.wires[other]])
    x = shared.as_vector(mesh.points[:, :1])
    assert np.abs(x[shared.numbers] - mesh.points[:, :1]).max() < 1e-9


def test_matrices_and_weights_are_those_of_both_wires_summed(
    problem: Problem, mesh: LineMesh
) -> None:
    """With S, the shared unknown of each one apart, they are S^T M S, S^T C S, S^T K S and S^T g,
    to the round-off of a sum of two."""
    whole, shared = model_of(problem, mesh), model_of(as_one(problem), mesh)
    number = np.empty(whole.n_dofs, dtype=np.int64)
    number[whole.numbering.numbers] = shared.numbering.numbers
    for share in ("mass", "damping", "stiffness"):
        apart, found = (whole_matrix(one, **{share: 1.0}).tocoo() for one in (whole, shared))
        expected = np.zeros(found.shape)
        np.add.at(expected, (number[apart.row], number[apart.col]), apart.data)
        assert np.abs(found.toarray() - expected).max() <= 1e-15 * np.abs(expected).max()
    weight = np.bincount(number, weights=whole.weight)
    assert np.abs(shared.weight - weight).max() <= 1e-15 * np.abs(weight).max()
    assert np.array_equal(shared.constrained, np.unique(number[whole.constrained]))


def test_a_scene_without_the_effect_has_no_trace_of_it(problem: Problem, mesh: LineMesh) -> None:
    whole, shared = model_of(problem, mesh), model_of(as_one(problem), mesh)
    assert whole.terms_of[RELATIVE] == 1 and RELATIVE not in shared.terms_of
    assert {k: v for k, v in whole.terms_of.items() if k != RELATIVE} == shared.terms_of
    laws = [vars(one.simulated) for one in (whole, shared)]
    assert {key for key in laws[0] if laws[0][key] != laws[1][key]} == {RELATIVE}
    sizes = [[(b.component, len(b.dofs)) for b in one.blocks] for one in (whole, shared)]
    assert sizes[0] == sizes[1]
    # Each dropper, arm and node goes on to have a record of its own.
    assert [len(links.law) for links in whole.links] == [len(links.law) for links in shared.links]


def test_wires_are_taken_apart_for_what_asks_of_each(problem: Problem, mesh: LineMesh) -> None:
    whole, shared = model_of(problem, mesh), model_of(as_one(problem), mesh)
    assert with_wires_apart(whole) is whole
    again = with_wires_apart(shared)
    assert np.array_equal(again.numbering.numbers, whole.numbering.numbers)
    assert np.array_equal(again.weight, whole.weight)


def test_it_acts_on_twin_wires_alone() -> None:
    effect = effects.registry()[RELATIVE]
    simple = make_line(ac_simple_line(3))
    assert not effect.applies(problem_of(simple)) and effect.applies(problem_of(twin_line()))
    mesh = mesh_of(simple, 3)
    one, other = (problem_of(simple, WHOLE | more) for more in (set(), {RELATIVE}))
    assert np.array_equal(numbering_of(one, mesh).numbers, numbering_of(other, mesh).numbers)
    assert RELATIVE not in model_of(other, mesh).terms_of


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_each_of_two_sections_has_twins_of_its_own(topology: str) -> None:
    """In an overlap stations have the four unknowns of both sections, elsewhere those of one."""
    line = twin_line(topology, OVERLAPS)
    pairs = {one: other for one, other in line.twins}
    assert pairs["contact_wire_2_next"] == "contact_wire_next"
    assert len(pairs) == (2 if topology == "twin" else 4)
    mesh = mesh_of(line, 2)
    found = numbered(mesh, pairs)
    assert found.width == 8 and set(map(len, found.station_types)) == {4, 8}
    for name, other in pairs.items():
        own, beside = (found.numbers[mesh.wires[wire]] for wire in (name, other))
        assert np.array_equal(own, beside)


@pytest.mark.parametrize("in_stations", [True, False])
def test_wires_with_nodes_elsewhere_than_the_messenger_wire_share_theirs(in_stations: bool) -> None:
    """Stations are then gaps; or single nodes, where the messenger wire has two pieces."""
    mesh, pairs = mesh_of(twin_line(), 3), dict(twin_line().twins)
    own = mesh.wires["messenger_wire"]
    moved = mesh.points.copy()
    inner = np.setdiff1d(own, [*mesh.droppers[:, 0], *mesh.anchors, *mesh.supports])
    moved[inner, 0] += 0.1
    breaks = {} if in_stations else {"messenger_wire": np.array([own.size // 2])}
    found = numbered(replace(mesh, points=moved, breaks=breaks), pairs)
    n = mesh.wires[CONTACT_WIRE].size
    assert found.n_unknowns == found.size == 4 * n and not found.missing.size
    assert found.in_stations == in_stations and found.width == (4 if in_stations else 2)
    one, other = (mesh.wires[name] for name in (CONTACT_WIRE, "contact_wire_2"))
    assert np.array_equal(found.numbers[one], found.numbers[other])
    assert np.unique(found.numbers).size == found.size


def test_wires_without_nodes_side_by_side_are_refused() -> None:
    mesh, pairs = mesh_of(twin_line(), 3), dict(twin_line().twins)
    points = mesh.points.copy()
    points[mesh.wires["contact_wire_2"][1], 0] += 0.01
    with pytest.raises(InputError, match="contact_wire_2 and contact_wire need nodes side by side"):
        numbered(replace(mesh, points=points), pairs)
    fewer = {**mesh.wires, "contact_wire_2": mesh.wires["contact_wire_2"][:-1]}
    with pytest.raises(InputError, match="need nodes side by side: the mesh has"):
        numbered(replace(mesh, wires=fewer), pairs)


def test_wires_without_droppers_and_arms_side_by_side_are_refused() -> None:
    mesh, pairs = mesh_of(twin_line(), 3), dict(twin_line().twins)
    without = mesh.droppers[1:], mesh.dropper_group[1:]
    with pytest.raises(InputError, match="need lower ends of droppers side by side"):
        numbered(replace(mesh, droppers=without[0], dropper_group=without[1]), pairs)
    with pytest.raises(InputError, match="need steady arms side by side"):
        numbered(
            replace(mesh, steady_arms=mesh.steady_arms[1:], arm_group=mesh.arm_group[1:]), pairs
        )
