"""What further planes, tensioners, twin wires, layers and stiff links add to a model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from axial_lines import AXIAL, elastic_line
from counted_effects import contents, counts, full_line, full_problem
from small_lines import (
    BARE,
    HANGING,
    WHOLE,
    ac_simple_line,
    en50318_line,
    mesh_of,
    numerics,
    problem_of,
)

from catenary import InputError
from catenary.meshgen.line import DropperKind, Line
from catenary.meshgen.mesh import CONTACT_WIRE, LineMesh
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import Overlaps, Twin
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.all_effects import active, simulated
from catenary.solver.effects.build_model import build, numbering_of, with_wires_apart
from catenary.solver.effects.shipped.line_effects import NAME, STIFF
from catenary.solver.effects.shipped.motion_effects import layer_damping
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.model.unknowns import Unknowns, number_unknowns
from catenary.solver.problem.ends import AbsorbingLayer, AlongTrack, EndCondition, Fixed, Tensioner
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.problem.watched_links import UPLIFT_STOPS
from catenary.solver.statics.form_finding import find_form

# --- what motion along the track and its tensioners add to a model, and that nothing else has -----


ENDS = AlongTrack(Tensioner(travel=0.5), end=True)


@pytest.fixture(scope="module")
def elastic_mesh() -> LineMesh:
    return mesh_of(elastic_line(2), 1)


def model_along(names: frozenset[str], elastic_mesh: LineMesh, along: AlongTrack = ENDS) -> Model:
    lengths = np.full(elastic_mesh.droppers.shape[0], 1.0)
    return build(problem_of(elastic_line(2), HANGING | names, along=along), elastic_mesh, lengths)


def sizes_of_blocks(model: Model) -> Counter[tuple[str, int, int]]:
    return Counter((b.component, *b.dofs.shape) for b in model.blocks)


def test_without_the_effect_there_is_no_trace_of_it(elastic_mesh: LineMesh) -> None:
    """Nor of tensioners, which a scene may name all the same."""
    bare = model_along(frozenset(), elastic_mesh, AlongTrack())
    for names in (frozenset(), frozenset({"tensioners"})):
        model = model_along(names, elastic_mesh)
        assert model.unknowns == ("w", "theta_y") and model.n_dofs == bare.n_dofs
        assert model.terms_of == bare.terms_of
        for ours, theirs in zip(model.blocks, bare.blocks, strict=True):
            assert np.array_equal(ours.dofs, theirs.dofs)
            for matrices in ("mass", "stiffness"):
                assert np.array_equal(getattr(ours, matrices), getattr(theirs, matrices))


def test_motion_along_the_track_adds_bars_and_pendulums(elastic_mesh: LineMesh) -> None:
    bare = model_along(frozenset(), elastic_mesh)
    model = model_along(frozenset({"axial_motion"}), elastic_mesh)
    n, n_droppers = elastic_mesh.n_nodes // 2, len(elastic_mesh.droppers)
    assert model.unknowns == ("w", "theta_y", "u") and model.n_dofs == 3 * elastic_mesh.n_nodes
    assert sizes_of_blocks(model) - sizes_of_blocks(bare) == {
        ("contact_wire", n - 1, 6): 1,
        ("messenger_wire", n - 1, 6): 1,
        ("droppers", n_droppers, 4): 1,
    }
    assert model.terms_of["axial_motion"] == 2 * (n - 1) + n_droppers
    assert model.constrained.size == 2 * bare.constrained.size
    assert not model.weight[model.dofs(np.arange(elastic_mesh.n_nodes), "u")].any()


def test_tensioners_add_weights_and_stops_where_they_turn(elastic_mesh: LineMesh) -> None:
    alone = model_along(frozenset({"axial_motion"}), elastic_mesh)
    both = model_along(AXIAL, elastic_mesh)
    assert sizes_of_blocks(both) - sizes_of_blocks(alone) == {
        ("tensioners", 2, 1): 1,
        ("tensioner_stops_down", 2, 1): 1,
        ("tensioner_stops_up", 2, 1): 1,
    }
    assert both.terms_of["tensioners"] == 6 + 1
    assert both.constrained.size == alone.constrained.size - 2
    free = model_along(AXIAL, elastic_mesh, AlongTrack(end=True))
    assert sizes_of_blocks(free) - sizes_of_blocks(alone) == {("tensioners", 2, 1): 1}
    rubbing = model_along(AXIAL, elastic_mesh, AlongTrack(Tensioner(efficiency=0.97), end=True))
    assert sizes_of_blocks(rubbing) - sizes_of_blocks(alone) == {
        ("tensioners", 2, 1): 2,
        ("tensioner_slips_in", 2, 1): 1,
        ("tensioner_slips_out", 2, 1): 1,
    }


def test_mid_points_hold_wires_between_their_ends(elastic_mesh: LineMesh) -> None:
    ends = AlongTrack(start=True, end=True, mid_points=(60.0,))
    model = model_along(AXIAL, elastic_mesh, ends)
    along = model.dofs(np.arange(elastic_mesh.n_nodes), "u")
    held = np.isin(along, model.constrained)
    assert sorted(elastic_mesh.x(np.flatnonzero(held)).tolist()) == [60.0, 60.0]


# --- what the lateral plane adds to a model, counted ----------------------------------------------


@pytest.fixture(scope="module")
def lateral_mesh() -> LineMesh:
    return mesh_of(full_line(), 2)


def test_lateral_motion_adds_a_plane_that_no_other_scene_has(lateral_mesh: LineMesh) -> None:
    """Unknowns of all nodes, wires, pendulums, bars, masses; of a scene without it no trace."""
    hanging = frozenset({"gravity", "dropper_mass", "clamp_mass", "arm_inertia", "arm_stiffness"})
    names, n = BARE | hanging, counts(lateral_mesh)
    without, _ = find_form(full_problem(names), lateral_mesh)
    model, form = find_form(full_problem(names | {"lateral_motion"}), lateral_mesh)
    assert without.unknowns == ("w", "theta_y") and without.simulated.lateral is False
    assert model.unknowns == ("w", "theta_y", "v", "theta_z") and model.form is form
    assert model.n_dofs == 2 * without.n_dofs
    half = n["elements"] // 2
    assert contents(model) - contents(without) == {
        ("messenger_wire", half, True, True): 1,
        ("contact_wire", half, True, True): 1,
        # Geometric stiffness of droppers and of bars, and the bars themselves.
        ("droppers", n["droppers"], False, True): 1,
        ("steady_arms", n["arms"], False, True): 1,
        # Masses that move sideways.
        ("droppers", n["droppers"], True, False): 2,
        ("messenger_wire", n["droppers"], True, False): 1,
        ("contact_wire", n["droppers"], True, False): 1,
        ("steady_arms", n["arms"], True, False): 1,
    }
    # An arm that is a bar has no further stiffness.
    assert "arm_stiffness" in without.terms_of and "arm_stiffness" not in model.terms_of
    held = 2 * n["supports"] - n["supports"] + lateral_mesh.anchors.size
    assert model.constrained.size == without.constrained.size + held


def test_wires_have_a_damping_of_their_own_across_the_track(lateral_mesh: LineMesh) -> None:
    """alpha K + beta M of wires in the lateral plane with its pair, all else with the line's."""
    names = BARE | {"gravity", "lateral_motion", "structural_damping"}
    usual = Damping(alpha=1e-3, beta=0.1)
    across = replace(usual, lateral=(2e-3, 0.7))
    found = [
        find_form(replace(full_problem(frozenset(names)), damping=damping), lateral_mesh)[0]
        for damping in (usual, across)
    ]
    assert found[0].damping_is_proportional and not found[1].damping_is_proportional
    more = whole_matrix(found[1], damping=1.0) - whole_matrix(found[0], damping=1.0)
    # The wires alone: the same model without what else has a stiffness or a mass in that plane.
    model = found[1]
    alone = replace(model, blocks=[block for block in model.blocks if block.lateral])
    assert len(alone.blocks) == len(model.mesh.wires)
    expected = whole_matrix(alone, mass=0.6, stiffness=1e-3)
    # Round-off of the difference of two sums, in which bars are the largest.
    largest = np.abs(whole_matrix(model, damping=1.0)).max()
    assert np.abs(more - expected).max() < 8 * np.finfo(float).eps * largest
    sideways = np.zeros(model.n_dofs, dtype=bool)
    every = np.arange(lateral_mesh.n_nodes)
    for unknown in ("v", "theta_z"):
        sideways[model.dofs(every, unknown)] = True
    assert np.abs(more[~sideways]).max() == 0.0


# --- twin wires that move as one share unknowns; with their relative motion each has its own ------


VERTICAL = "w", "theta_y"
RELATIVE = "relative_motion"
TOPOLOGIES = "twin", "twin_messenger"
OVERLAPS = Overlaps((2,), 3, 0.3, 0.2)


def twin_line(topology: str = "twin", overlaps: Overlaps | None = None) -> Line:
    data = replace(ac_simple_line(6 if overlaps else 3), twin=Twin(0.1, False), overlaps=overlaps)
    return make_line(replace(data, topology=topology))


def numbered(twin_mesh: LineMesh, together: Mapping[str, str]) -> Unknowns:
    return number_unknowns(twin_mesh, [dict.fromkeys(twin_mesh.wires, VERTICAL)], together=together)


def model_of(twin_problem: Problem, twin_mesh: LineMesh) -> Model:
    return build(twin_problem, twin_mesh, np.ones(twin_mesh.droppers.shape[0]))


def as_one(twin_problem: Problem) -> Problem:
    return replace(twin_problem, effects=twin_problem.effects - {RELATIVE})


@pytest.fixture(scope="module", params=TOPOLOGIES)
def twin_problem(request: pytest.FixtureRequest) -> Problem:
    """A twin line of three spans with all that hangs, and the relative motion of its wires."""
    return problem_of(twin_line(request.param), WHOLE | {RELATIVE})


@pytest.fixture(scope="module")
def twin_mesh(twin_problem: Problem) -> LineMesh:
    return mesh_of(twin_problem.line, 3)


def test_stations_have_four_unknowns_in_place_of_six_and_eight(
    twin_problem: Problem, twin_mesh: LineMesh
) -> None:
    whole, shared = (numbering_of(one, twin_mesh) for one in (twin_problem, as_one(twin_problem)))
    n_stations = twin_mesh.wires[CONTACT_WIRE].size
    assert whole.width == 2 * len(twin_mesh.wires) and shared.width == 4
    assert whole.n_unknowns == whole.size == whole.width * n_stations
    assert shared.n_unknowns == shared.size == 4 * n_stations
    assert not shared.missing.size and shared.in_stations
    for name, other in twin_problem.line.twins:
        own, beside = (shared.numbers[twin_mesh.wires[wire]] for wire in (name, other))
        assert np.array_equal(own, beside)
    taken, counts = np.unique(shared.numbers, return_counts=True)
    assert taken.size == shared.size and counts.max() == 2


def test_vectors_by_node_and_back_share_what_is_shared(
    twin_problem: Problem, twin_mesh: LineMesh
) -> None:
    shared = numbering_of(as_one(twin_problem), twin_mesh)
    vector = np.random.default_rng(1).normal(size=shared.size)
    assert (shared.numbers >= 0).all()
    by_node = vector[shared.numbers]
    assert np.array_equal(shared.as_vector(by_node), vector)
    for name, other in twin_problem.line.twins:
        assert np.array_equal(by_node[twin_mesh.wires[name]], by_node[twin_mesh.wires[other]])
    x = shared.as_vector(twin_mesh.points[:, :1])
    assert np.abs(x[shared.numbers] - twin_mesh.points[:, :1]).max() < 1e-9


def test_matrices_and_weights_are_those_of_both_wires_summed(
    twin_problem: Problem, twin_mesh: LineMesh
) -> None:
    """With S, the shared unknown of each one apart, they are S^T M S, S^T C S, S^T K S and S^T g,
    to the round-off of a sum of two."""
    whole, shared = model_of(twin_problem, twin_mesh), model_of(as_one(twin_problem), twin_mesh)
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


def test_a_scene_without_the_effect_has_no_trace_of_it(
    twin_problem: Problem, twin_mesh: LineMesh
) -> None:
    whole, shared = model_of(twin_problem, twin_mesh), model_of(as_one(twin_problem), twin_mesh)
    assert whole.terms_of[RELATIVE] == 1 and RELATIVE not in shared.terms_of
    assert {k: v for k, v in whole.terms_of.items() if k != RELATIVE} == shared.terms_of
    laws = [vars(one.simulated) for one in (whole, shared)]
    assert {key for key in laws[0] if laws[0][key] != laws[1][key]} == {RELATIVE}
    sizes = [[(b.component, len(b.dofs)) for b in one.blocks] for one in (whole, shared)]
    assert sizes[0] == sizes[1]
    # Each dropper, arm and node goes on to have a record of its own.
    assert [len(links.law) for links in whole.links] == [len(links.law) for links in shared.links]


def test_wires_are_taken_apart_for_what_asks_of_each(
    twin_problem: Problem, twin_mesh: LineMesh
) -> None:
    whole, shared = model_of(twin_problem, twin_mesh), model_of(as_one(twin_problem), twin_mesh)
    assert with_wires_apart(whole) is whole
    again = with_wires_apart(shared)
    assert np.array_equal(again.numbering.numbers, whole.numbering.numbers)
    assert np.array_equal(again.weight, whole.weight)


def test_it_acts_on_twin_wires_alone() -> None:
    effect = effects.registry()[RELATIVE]
    simple = make_line(ac_simple_line(3))
    assert not effect.applies(problem_of(simple)) and effect.applies(problem_of(twin_line()))
    twin_mesh = mesh_of(simple, 3)
    one, other = (problem_of(simple, WHOLE | more) for more in (set(), {RELATIVE}))
    assert np.array_equal(
        numbering_of(one, twin_mesh).numbers, numbering_of(other, twin_mesh).numbers
    )
    assert RELATIVE not in model_of(other, twin_mesh).terms_of


@pytest.mark.parametrize("topology", TOPOLOGIES)
def test_each_of_two_sections_has_twins_of_its_own(topology: str) -> None:
    """In an overlap stations have the four unknowns of both sections, elsewhere those of one."""
    line = twin_line(topology, OVERLAPS)
    pairs = {one: other for one, other in line.twins}
    assert pairs["contact_wire_2_next"] == "contact_wire_next"
    assert len(pairs) == (2 if topology == "twin" else 4)
    twin_mesh = mesh_of(line, 2)
    found = numbered(twin_mesh, pairs)
    assert found.width == 8 and set(map(len, found.station_types)) == {4, 8}
    for name, other in pairs.items():
        own, beside = (found.numbers[twin_mesh.wires[wire]] for wire in (name, other))
        assert np.array_equal(own, beside)


@pytest.mark.parametrize("in_stations", [True, False])
def test_wires_with_nodes_elsewhere_than_the_messenger_wire_share_theirs(in_stations: bool) -> None:
    """Stations are then gaps; or single nodes, where the messenger wire has two pieces."""
    twin_mesh, pairs = mesh_of(twin_line(), 3), dict(twin_line().twins)
    own = twin_mesh.wires["messenger_wire"]
    moved = twin_mesh.points.copy()
    inner = np.setdiff1d(own, [*twin_mesh.droppers[:, 0], *twin_mesh.anchors, *twin_mesh.supports])
    moved[inner, 0] += 0.1
    breaks = {} if in_stations else {"messenger_wire": np.array([own.size // 2])}
    found = numbered(replace(twin_mesh, points=moved, breaks=breaks), pairs)
    n = twin_mesh.wires[CONTACT_WIRE].size
    assert found.n_unknowns == found.size == 4 * n and not found.missing.size
    assert found.in_stations == in_stations and found.width == (4 if in_stations else 2)
    one, other = (twin_mesh.wires[name] for name in (CONTACT_WIRE, "contact_wire_2"))
    assert np.array_equal(found.numbers[one], found.numbers[other])
    assert np.unique(found.numbers).size == found.size


def test_wires_without_nodes_side_by_side_are_refused() -> None:
    twin_mesh, pairs = mesh_of(twin_line(), 3), dict(twin_line().twins)
    points = twin_mesh.points.copy()
    points[twin_mesh.wires["contact_wire_2"][1], 0] += 0.01
    with pytest.raises(InputError, match="contact_wire_2 and contact_wire need nodes side by side"):
        numbered(replace(twin_mesh, points=points), pairs)
    fewer = {**twin_mesh.wires, "contact_wire_2": twin_mesh.wires["contact_wire_2"][:-1]}
    with pytest.raises(InputError, match="need nodes side by side: the mesh has"):
        numbered(replace(twin_mesh, wires=fewer), pairs)


def test_wires_without_droppers_and_arms_side_by_side_are_refused() -> None:
    twin_mesh, pairs = mesh_of(twin_line(), 3), dict(twin_line().twins)
    without = twin_mesh.droppers[1:], twin_mesh.dropper_group[1:]
    with pytest.raises(InputError, match="need lower ends of droppers side by side"):
        numbered(replace(twin_mesh, droppers=without[0], dropper_group=without[1]), pairs)
    with pytest.raises(InputError, match="need steady arms side by side"):
        numbered(
            replace(
                twin_mesh, steady_arms=twin_mesh.steady_arms[1:], arm_group=twin_mesh.arm_group[1:]
            ),
            pairs,
        )


# --- absorbing layers as matrices -----------------------------------------------------------------


N_SPANS = 5


def model_with_ends(start: EndCondition, end: EndCondition) -> Model:
    line = ac_simple_line(N_SPANS)
    problem = problem_of(line, HANGING | {"absorbing_layers"}, ends=(start, end))
    mesh = mesh_of(line, 2)
    return build(problem, mesh, np.full(mesh.droppers.shape[0], 1.0))


def test_damping_grows_as_the_square_of_the_way_into_the_layer() -> None:
    x = np.array([-10.0, 0.0, 5.0, 10.0, 20.0])
    np.testing.assert_allclose(layer_damping(x, 0.0, 10.0, 4.0), [0, 0, 1, 4, 4])
    np.testing.assert_allclose(layer_damping(x, 10.0, 0.0, 4.0), [4, 4, 1, 0, 0])


def test_layers_damp_all_masses_of_their_spans_and_nothing_else() -> None:
    model = model_with_ends(AbsorbingLayer(1, 3.0), AbsorbingLayer(2, 5.0))
    mass, damping = whole_matrix(model, mass=1.0), whole_matrix(model, damping=1.0)
    masts = model.problem.line.support_positions
    x = model.numbering.as_vector(model.mesh.points[:, :1], np.nan)
    rate = layer_damping(x, masts[1], masts[0], 3.0) + layer_damping(x, masts[3], masts[5], 5.0)
    free = np.setdiff1d(np.arange(model.n_dofs), model.constrained)
    ratio = damping.diagonal()[free] / mass.diagonal()[free]
    # An element damps by the value at its middle: off by the change over half an element.
    elements = np.diff(np.unique(model.mesh.points[:, 0])).max()
    slope = 2 * 5.0 / (masts[5] - masts[3])
    assert np.abs(ratio - rate[free]).max() < 0.75 * elements * slope
    inside = free[(x[free] > masts[1]) & (x[free] < masts[3])]
    assert not damping[inside].nnz or abs(damping[inside]).max() == 0.0
    assert np.abs(damping - damping.T).max() < 1e-12
    assert not model.damping_is_proportional


def test_lines_without_layers_have_no_trace_of_them() -> None:
    model = model_with_ends(Fixed(), Fixed())
    assert "absorbing_layers" not in model.terms_of
    assert all(block.damping is None for block in model.blocks)
    assert model.damping_is_proportional


# --- numerical damping of links that are stiff for the step ---------------------------------------


EFFECTS = WHOLE | {NAME}
ALPHA = 1e-4


def stiff(k: float, dt: float, effects: frozenset[str] = EFFECTS, alpha: float = ALPHA) -> Problem:
    line = replace(en50318_line(2), dropper=DropperKind(k, None, 0.0, 0.0, 0.0))
    damping = Damping(alpha, 0.01)
    return problem_of(line, effects, numerics=numerics(dt), damping=damping)


def model_of_links(problem: Problem) -> Model:
    return find_form(problem, mesh_of(en50318_line(2), 1))[0]


def test_stiff_droppers_get_what_they_lack_of_a_step() -> None:
    problem, dt = stiff(1e6, 1e-3), 1e-3
    laws = simulated(problem)
    assert laws.damping.per_component == {"droppers": (dt, 0.01)}
    assert laws.added_alpha == {"droppers": dt - ALPHA}
    model = model_of_links(problem)
    assert model.dropper_damping == pytest.approx(np.full(18, dt * 1e6), rel=1e-12)
    assert np.array_equal(model.released_damping, model.dropper_damping)


def test_it_is_released_with_the_spring_where_dampers_are_kept() -> None:
    kept = replace(stiff(1e6, 1e-3), slack_dampers_act=True)
    model = model_of_links(kept)
    assert model.released_damping == pytest.approx(np.full(18, 9e-4 * 1e6), rel=1e-12)


@pytest.mark.parametrize(
    ("problem", "why"),
    [
        (stiff(0.99 * STIFF * 1e6, 1e-3), "not stiff for the step"),
        (stiff(1e6, 1e-3, alpha=1e-3), "damped by a step already"),
        (stiff(1e6, 1e-3, EFFECTS - {"dropper_slackening"}), "droppers that do not switch"),
        (stiff(1e6, 1e-3, WHOLE), "left out"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_other_lines_have_none_of_it(problem: Problem, why: str) -> None:
    assert NAME not in {effect.name for effect in active(problem)}
    assert simulated(problem).added_alpha == {}
    assert model_of_links(problem).damping_is_proportional


def test_stiff_stops_have_it_as_well() -> None:
    line = en50318_line(2)
    arm = replace(line.steady_arm, uplift_stop=0.02, stop_stiffness=1e7)
    effects = EFFECTS | {"uplift_stops"}
    problem = problem_of(
        replace(line, steady_arm=arm), effects, damping=Damping(0.0, 0.0), numerics=numerics(1e-3)
    )
    assert simulated(problem).added_alpha == {UPLIFT_STOPS: 1e-3}
