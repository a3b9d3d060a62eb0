"""Wires beyond the simple catenary: put together by newcomers, under load and in motion."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dense_line import DenseLine
from measuring import check, march, matrix_of, solve_free
from more_wires import (
    AUXILIARY,
    FEEDER,
    STITCH,
    STITCH_HALF,
    TOPOLOGIES,
    data_of,
    further_topologies,
)
from numpy.polynomial.legendre import leggauss
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg
from small_lines import HANGING, WHOLE, mesh_of, numerics, problem_of, train
from static_line import absolute_rest, first_rest

from catenary import InputError
from catenary.meshgen.build import make_mesh, use_mesh
from catenary.meshgen.line import DropperKind, DropperPlace, Droppers, Line
from catenary.meshgen.mesh import CONTACT_WIRE, DROPPERS, MESSENGER_WIRE, LineMesh, elements_of
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.wires import Role
from catenary.postproc.files.header import line_datasets
from catenary.postproc.record.snapshots.contents import RecordedLine, blocks_of
from catenary.solver.model.beam import uniform_load
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.defects import DropperBreak, TensionLoss
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.after_incidents import changed_line
from catenary.solver.statics.elasticity import elasticity
from catenary.solver.statics.form_finding import find_form

# --- wires beyond the simple catenary -------------------------------------------------------------


GRAVITY = 9.81


@pytest.fixture(scope="module", autouse=True)
def topologies() -> Iterator[None]:
    with further_topologies():
        yield


def with_strings(line: Line) -> Line:
    """The same of wires without bending stiffness: closed forms hold exactly."""
    return replace(line, wires=tuple(replace(w, bending_stiffness=0.0) for w in line.wires))


def at_rest(line: Line, elements_per_gap: int = 2) -> tuple[LineMesh, Equilibrium]:
    mesh = mesh_of(line, elements_per_gap)
    return mesh, find_form(problem_of(line, HANGING), mesh)[1]


def height_at(mesh: LineMesh, form: Equilibrium, wire: str, x: float) -> float:
    nodes = mesh.wires[wire]
    return float(form.height[nodes[np.argmin(np.abs(mesh.x(nodes) - x))]])


# ---- mesh --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("topology", "n_nodes_a_station", "n_pieces"), [("compound", 3, 1), ("stitched", 3, 5)]
)
def test_wires_are_meshed_in_stations_that_join_their_neighbours(
    topology: str, n_nodes_a_station: int, n_pieces: int, tmp_path: Path
) -> None:
    line = make_line(data_of(topology))
    path = tmp_path / "line.msh"
    mesh = make_mesh(line, 3, path)
    assert [wire.name for wire in line.wires] == list(mesh.wires)
    middle = line.wires[1].name
    assert len(mesh.pieces(middle)) == n_pieces
    contact = mesh.x(mesh.wires[CONTACT_WIRE])
    for piece in mesh.pieces(middle):
        inside = (contact >= mesh.x(piece)[0] - 1e-9) & (contact <= mesh.x(piece)[-1] + 1e-9)
        np.testing.assert_allclose(mesh.x(piece), contact[inside], atol=1e-9)
    for number, group in enumerate(line.droppers):
        pairs = mesh.droppers[mesh.dropper_group == number]
        assert np.isin(pairs[:, 0], mesh.wires[group.upper]).all()
        np.testing.assert_allclose(mesh.x(pairs[:, 1]), group.lower_x, atol=1e-9)
    model, _ = find_form(problem_of(line), mesh)
    assert model.numbering.in_stations
    assert model.numbering.planes == (2 * n_nodes_a_station,)
    divided = make_mesh(line, 3)
    np.testing.assert_allclose(divided.points, mesh.points, atol=1e-7)
    np.testing.assert_array_equal(divided.droppers, mesh.droppers)
    np.testing.assert_array_equal(divided.clamps, mesh.clamps)
    again = use_mesh(line, path)
    np.testing.assert_array_equal(again.points, mesh.points)
    np.testing.assert_array_equal(again.clamps, mesh.clamps)


def test_a_mesh_whose_wire_has_too_few_pieces_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "line.msh"
    make_mesh(make_line(data_of("stitched", 5)), 1, path)
    with pytest.raises(InputError, match="stitch_wire is not 5 simple chains but 4 separate ones"):
        use_mesh(make_line(data_of("stitched", 6)), path)


def test_a_topology_that_is_unknown_or_wrong_is_refused() -> None:
    known = "compound, .*simple, .*stitched, .*with_feeder"
    with pytest.raises(InputError, match=f"hanging is unknown; it must be one of: {known}"):
        make_line(replace(data_of("compound"), topology="hanging"))
    with pytest.raises(InputError, match="the topology stitched needs stitch_wire"):
        make_line(replace(data_of("stitched"), stitch_wire=None))
    line = make_line(data_of("compound"))
    with pytest.raises(ValueError, match="droppers hang auxiliary_wire, which has no profile"):
        bare = replace(line.wires[1], profile=None)
        hung = replace(line.droppers[0], upper=MESSENGER_WIRE, lower=AUXILIARY)
        replace(line, wires=(line.wires[0], bare, line.wires[2]), droppers=(hung,))
    with pytest.raises(ValueError, match="there is no wire third_rail"):
        replace(line, droppers=(replace(line.droppers[0], upper="third_rail"),))
    with pytest.raises(ValueError, match="two parts have the name contact_wire"):
        replace(line, wires=(*line.wires, line.wires[0]))


def test_a_wire_of_a_newcomer_hangs_between_its_ends() -> None:
    """Half of its sag m g L^2 / (8 T) is where a parabola has it, at 0.146 L."""
    line = make_line(replace(data_of("stitched", 2), topology="with_feeder"))
    mesh, form = at_rest(with_strings(line))
    wire = line.wire(FEEDER)
    sag = GRAVITY * wire.mass_per_length * 130.0**2 / (8 * wire.tension)
    middle = wire.top - height_at(mesh, form, FEEDER, 65.0)
    check("sag [m]", middle, sag, within=1e-9)
    assert len(mesh.elements(FEEDER)) == len(mesh.elements(CONTACT_WIRE))


# ---- rest --------------------------------------------------------------------------------------


@pytest.mark.parametrize("topology", list(TOPOLOGIES))
def test_all_wires_are_in_equilibrium_with_taut_droppers_at_the_wanted_heights(
    topology: str,
) -> None:
    """Forces at each node, assembled here from slopes and curvatures by quadrature."""
    data = data_of(topology)
    sag = tuple(0.03 * np.sin(np.pi * np.array(data.dropper_positions[0]) / data.span_lengths[0]))
    line = make_line(replace(data, pre_sag=(sag,) * 6))
    mesh, form = at_rest(line)
    force, moment = np.zeros((2, mesh.n_nodes))
    points, weights = leggauss(4)
    scale = 0.0
    for wire in line.wires:
        for pair in mesh.elements(wire.name):
            h = float(np.diff(mesh.x(pair))[0])
            s = 0.5 * (1.0 + points)
            slopes = np.array([6 * s * s - 6 * s, h * (1 - 4 * s + 3 * s * s),
                               6 * s - 6 * s * s, h * (3 * s * s - 2 * s)]) / h  # fmt: skip
            bends = np.array([12 * s - 6, h * (6 * s - 4), 6 - 12 * s, h * (6 * s - 2)]) / h**2
            u = np.array([form.height[pair], form.slope[pair]]).T.ravel()
            tension = float(wire.tension_at(mesh.x(pair).mean()))
            inner = (slopes * (0.5 * h * weights)) @ (tension * slopes.T @ u)
            inner += (bends * (0.5 * h * weights)) @ (wire.bending_stiffness * bends.T @ u)
            scale = max(scale, np.abs(inner[0::2]).max())
            inner += GRAVITY * wire.mass_per_length * uniform_load(np.array([h]))[0]
            force[pair] -= inner[0::2]
            moment[pair] -= inner[1::2]
    for (upper, lower), pull in zip(mesh.droppers, form.dropper_force, strict=True):
        force[upper] -= pull
        force[lower] += pull
    for nodes, supports in zip([mesh.supports], line.supports, strict=True):
        top = line.wire(supports.wire).top
        force[nodes] -= supports.stiffness * (form.height[nodes] - top)
    for (upper, lower), number in zip(mesh.clamps, line.clamp_group, strict=True):
        pull = line.clamps[number].stiffness * (form.height[upper] - form.height[lower])
        weight = 0.5 * GRAVITY * line.clamps[number].mass
        force[upper] -= pull + weight
        force[lower] += pull - weight
    free = np.setdiff1d(np.arange(mesh.n_nodes), mesh.anchors)
    assert np.abs(force[free]).max() < 1e-8 * scale
    assert np.abs(moment).max() < 1e-8 * scale
    assert form.dropper_force.min() > 20.0
    for number, group in enumerate(line.droppers):
        nodes = mesh.droppers[mesh.dropper_group == number, 1]
        profile = line.wire(group.lower).profile
        assert profile is not None
        wanted = profile.level(mesh.x(nodes)) - profile.pre_sag(mesh.x(nodes))
        assert form.height[nodes] == pytest.approx(wanted, abs=1e-12)
    assert profile_sags(line) > 0.02


def profile_sags(line: Line) -> float:
    """Largest pre-sag wanted of a contact wire [m]."""
    (contact,) = line.wires_of(Role.CONTACT)
    assert contact.profile is not None
    return max(contact.profile.sag)


def extrapolated(line: Line, read: Callable[[LineMesh, Equilibrium], np.ndarray]) -> np.ndarray:
    """What is read off a line of strings, extrapolated to no length of elements.

    Slopes are continuous: elements round off the kinks of strings, an error of first order in h.
    """
    coarse, fine = (read(*at_rest(line, n)) for n in (8, 16))
    return 2.0 * fine - coarse


def test_compound_line_of_strings_hangs_as_statics_says() -> None:
    """Each dropper carries what lies between the middles of its gaps; sags follow from moments."""
    line = with_strings(make_line(data_of("compound")))
    contact, auxiliary, messenger = line.wires
    masts = line.support_positions
    middle = 0.5 * (masts[2] + masts[3])

    def forces(mesh: LineMesh, form: Equilibrium) -> np.ndarray:
        x = mesh.x(mesh.droppers[:, 1])
        inside = (x > masts[1]) & (x < masts[-2])
        groups = [inside & (mesh.dropper_group == number) for number in (0, 1)]
        return np.concatenate([form.dropper_force[chosen] for chosen in groups])

    def heights(mesh: LineMesh, form: Equilibrium) -> np.ndarray:
        places = (MESSENGER_WIRE, middle), (AUXILIARY, middle + 5.0)
        return np.array([height_at(mesh, form, *place) for place in places])

    hanger = GRAVITY * contact.mass_per_length * 5.0
    dropper = GRAVITY * (contact.mass_per_length + auxiliary.mass_per_length) * 10.0
    expected = np.repeat([hanger, dropper], [40, 20])
    check("forces [N]", extrapolated(line, forces), expected, within=2e-5 * expected)
    # Simple beams under the loads: a span with five, a gap with two at a quarter and three.
    weight = sum(wire.mass_per_length for wire in line.wires) * GRAVITY * 50.0
    gives = weight / line.supports[0].stiffness
    moment = messenger.mass_per_length * GRAVITY * 50.0**2 / 8 + dropper * (2.5 * 25 - 20 - 10)
    gap = auxiliary.mass_per_length * GRAVITY * 10.0**2 / 8 + hanger * 2.5
    assert auxiliary.profile is not None
    high = line.wire(MESSENGER_WIRE).top - gives - moment / messenger.tension
    low = auxiliary.profile.height - gap / auxiliary.tension
    check("heights [m]", extrapolated(line, heights), np.array([high, low]), within=1e-6)


def test_stitched_line_of_strings_hangs_as_statics_says() -> None:
    """The messenger wire has T - T_s between clamps, the stitch wire hangs from them."""
    line = with_strings(make_line(data_of("stitched")))
    contact, stitch, messenger = line.wires
    mast, half, span = float(line.support_positions[3]), STITCH_HALF, line.span_lengths[2]

    def forces(mesh: LineMesh, form: Equilibrium) -> np.ndarray:
        return form.dropper_force[np.abs(mesh.x(mesh.droppers[:, 1]) - mast) < half]

    def heights(mesh: LineMesh, form: Equilibrium) -> np.ndarray:
        clamp = height_at(mesh, form, MESSENGER_WIRE, mast + half)
        hung = [height_at(mesh, form, STITCH, mast + at) for at in (7.5, 2.5)]
        return np.array([clamp, *(clamp - height for height in hung)])

    weights = np.array([7.5, 5.0, 5.0, 7.5]) * contact.mass_per_length * GRAVITY
    check("hangers [N]", extrapolated(line, forces), weights, within=1e-4 * weights)
    hanging = weights[:2].sum() + GRAVITY * stitch.mass_per_length * half  # half a stitch wire
    total = (contact.mass_per_length + messenger.mass_per_length) * span
    total += 2 * half * stitch.mass_per_length + 2 * line.clamps[0].mass
    total *= GRAVITY
    support = line.wire(MESSENGER_WIRE).top - total / line.supports[0].stiffness
    left = messenger.tension - stitch.tension
    falls = half * (total / 2 - GRAVITY * messenger.mass_per_length * half / 2) / left
    gives = (hanging + GRAVITY * 0.5 * line.clamps[0].mass) / line.clamps[0].stiffness
    y = half - np.array([7.5, 2.5])  # from the clamp inwards, the outer dropper first
    below = hanging * y - GRAVITY * stitch.mass_per_length * y**2 / 2 - weights[0] * (y - y[0])
    expected = [support - falls, *(below / stitch.tension + gives)]
    check("heights [m]", extrapolated(line, heights), np.array(expected), within=1e-5)


def test_components_of_pieces_are_told_apart() -> None:
    """Elements of a wire of several pieces, as fields and result files have them."""
    line = make_line(data_of("stitched"))
    mesh = mesh_of(line, 1)
    blocks = blocks_of(RecordedLine(line, mesh, np.zeros(mesh.n_nodes)), mesh.points)
    assert [block.name for block in blocks][:3] == list(mesh.wires)
    (block,) = (block for block in blocks if block.name == STITCH)
    cells = block.cells(0, len(block.nodes))
    np.testing.assert_array_equal(block.nodes[cells], mesh.elements(STITCH))
    assert np.diff(block.points[cells, 0], axis=1).max() < 10.1
    datasets = line_datasets(line, mesh, (65.0, 130.0))
    nodes, breaks = datasets[f"line/wires/{STITCH}"], datasets[f"line/breaks/{STITCH}"]
    np.testing.assert_array_equal(elements_of(nodes, breaks), mesh.elements(STITCH))


def test_dropper_kinds_of_groups_may_differ() -> None:
    line = make_line(data_of("compound"))
    low, high = line.droppers
    kinds = DropperKind(1e5, None, 0.1, 0.2, 0.1), DropperKind(None, 3e5, 0.2, 0.1, 0.3)
    changed = replace(line, droppers=tuple(map(_with_kind, (low, high), kinds)))
    mesh = mesh_of(changed, 2)
    problem = problem_of(changed, damping=Damping(1e-4, 0.0, {DROPPERS: (2e-3, 0.0)}))
    model, _ = find_form(problem, mesh)
    of = mesh.dropper_group
    assert (model.dropper_stiffness[of == 0] == 1e5).all()
    own = 3e5 / model.dropper_lengths[of == 1]
    assert model.dropper_stiffness[of == 1] == pytest.approx(own, rel=1e-15)
    assert model.dropper_damping == pytest.approx(
        np.where(of == 0, 2e-3, 1e-4) * model.dropper_stiffness, rel=1e-15
    )


def _with_kind(group: Droppers, kind: DropperKind) -> Droppers:
    return replace(group, kind=kind)


# --- lines of three wires under load, in motion and after incidents, against dense matrices -------


def small(topology: str) -> Line:
    """Two short spans: few enough droppers for all sets of slack ones."""
    data = data_of(topology, 2)
    places = (3.0, 9.0, 15.0, 21.0) if topology == "compound" else (4.0, 12.0, 20.0)
    spans = {"span_lengths": (24.0,) * 2, "dropper_positions": (places,) * 2}
    assert data.auxiliary_wire is not None
    auxiliary = replace(data.auxiliary_wire, dropper_positions=((6.0, 18.0),) * 2)
    short = replace(data, **spans, auxiliary_wire=auxiliary)  # type: ignore[arg-type]
    line = make_line(replace(short, pre_sag=((0.0,) * len(places),) * 2))
    return replace(line, clamps=tuple(replace(group, mass=0.0) for group in line.clamps))


def problem_on(line: Line) -> Problem:
    """A head that rises into the wire, strong enough to leave droppers slack."""
    run = train(100.0, 6.0, 19.0, static_force=1000.0, raise_time=0.0, nominal_height=5.5)
    return problem_of(
        line, WHOLE, damping=Damping(5e-3, 0.0), train=replace(run, start_below=0.02),
        numerics=numerics(1e-3), slack_dampers_act=True,
    )  # fmt: skip


@pytest.mark.parametrize("topology", list(TOPOLOGIES))
def test_elasticity_is_that_of_dense_matrices(topology: str) -> None:
    line = small(topology)
    mesh = mesh_of(line, 2)
    problem = problem_on(line)
    model, form = find_form(problem, mesh)
    dense = DenseLine(problem, mesh, form, True)
    stiffness = sparse.csc_matrix(dense.matrices[2][: 2 * mesh.n_nodes, : 2 * mesh.n_nodes])
    free = dense.free[dense.free < 2 * mesh.n_nodes]
    factor = sparse_linalg.splu(stiffness[free][:, free].tocsc())
    found = elasticity(model, 6.0, 42.0)
    nodes = mesh.wires[CONTACT_WIRE]
    inside = nodes[(mesh.x(nodes) > 6.0 - 1e-9) & (mesh.x(nodes) < 42.0 + 1e-9)]
    lift = []
    for node in inside:
        unit = (free == 2 * node).astype(float)
        lift.append(float(factor.solve(unit) @ unit))
    check("lift [m/N]", found.lift, lift, within=1e-9 * max(lift))


@pytest.mark.parametrize("topology", list(TOPOLOGIES))
def test_a_march_is_that_of_dense_matrices(topology: str) -> None:
    line = small(topology)
    mesh = mesh_of(line, 1)
    problem = problem_on(line)
    _, form = find_form(problem, mesh)
    seen = march(problem, mesh, lambda view: view.checkpoint() if view.step == 0 else None)
    dense = DenseLine(problem, mesh, form, True)
    dense.state = np.zeros((3, dense.size))
    dense.state[:, -2:] = seen.watched[0]["pantograph_0"].reshape(3, 2)
    slack, forces, droppers = set(), [], []
    for x in seen["contact_position"][1:, 0]:
        force, carried = dense.step(x)
        slack |= dense.acting - {-1}
        forces.append(force)
        droppers.append(carried)
    lost = sum(force == 0.0 for force in forces)
    print(f"slack were {sorted(slack)}, contact lost in {lost} steps")
    assert len(slack) > 1 and lost > 10
    for name, own, expected in (
        ("contact force [N]", seen["contact_force"][1:, 0], forces),
        ("dropper forces [N]", seen["dropper_force"][1:], droppers),
    ):
        check(name, own, expected, within=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("topology", "wire"),
    [("compound", AUXILIARY), ("compound", CONTACT_WIRE), ("stitched", STITCH)],
)
def test_a_wire_that_loses_tension_and_a_dropper_that_breaks_lead_to_a_new_rest(
    topology: str, wire: str
) -> None:
    """K' d = g with the balance lost g, against heights of the line found anew."""
    line = small(topology)
    mesh = mesh_of(line, 2)
    model, form = find_form(problem_on(line), mesh)
    places = mesh.x(mesh.droppers[:, 1])
    number = int(np.flatnonzero(mesh.dropper_group == 1)[0])
    happened = (TensionLoss(0.1, wire, 0.9), DropperBreak(0.2, DropperPlace(float(places[number]))))
    after = changed_line(model, form, happened)
    moved = solve_free(matrix_of(after.model, stiffness=1.0), after.model, after.load)
    tensions = {own.name: own.tension for own in line.wires}
    tensions[wire] *= 0.9
    rest = absolute_rest(model, form, tensions=tensions, broken={number})
    expected = rest - first_rest(model, form)
    assert np.abs(expected).max() > 1e-4
    check("moved [m]", moved, expected, within=1e-9)
