"""The registry of unknowns, and how a line is cut for the ranks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_lines import BARE, ac_simple_line, mesh_of, problem_of

from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.solver.effects.build_model import build
from catenary.solver.model.model import Model
from catenary.solver.model.partition import PANTOGRAPH_NODES, distribute
from catenary.solver.model.unknowns import MOST_STATION_TYPES, Group, Unknowns, number_unknowns

# --- the registry of unknowns ---------------------------------------------------------------------


VERTICAL, LATERAL = (
    {CONTACT_WIRE: names, MESSENGER_WIRE: names} for names in (("w", "theta_y"), ("v", "theta_z"))
)
OF_CONTACT_WIRE = {CONTACT_WIRE: ("v", "theta_z")}
STITCH, NEXT_WIRE = "stitch_wire", "next_contact_wire"


def paired() -> LineMesh:
    return mesh_of(ac_simple_line(3), 3)


def apart(contact: int, messenger: int) -> LineMesh:
    """A line with other numbers of elements a gap on both wires."""
    one, other = mesh_of(ac_simple_line(3), contact), mesh_of(ac_simple_line(3), messenger)
    place = {
        (wire, round(mesh.points[node, 0], 6)): node
        for wire, mesh in ((CONTACT_WIRE, one), (MESSENGER_WIRE, other))
        for node in mesh.wires[wire]
    }
    keys = list(place)
    number = {key: i for i, key in enumerate(keys)}
    meshes = {CONTACT_WIRE: one, MESSENGER_WIRE: other}
    points = np.array([meshes[wire].points[place[wire, x]] for wire, x in keys])

    def of(wire: str, nodes: np.ndarray) -> np.ndarray:
        return np.array([number[wire, round(x, 6)] for x in meshes[wire].points[nodes, 0]])

    return replace(
        one,
        points=points,
        wires={wire: of(wire, mesh.wires[wire]) for wire, mesh in meshes.items()},
        droppers=np.column_stack(
            [
                of(MESSENGER_WIRE, other.droppers[:, 0]),
                of(CONTACT_WIRE, one.droppers[:, 1]),
            ]
        ),
        steady_arms=of(CONTACT_WIRE, one.steady_arms),
        supports=of(MESSENGER_WIRE, other.supports),
        anchors=np.concatenate([of(w, m.wires[w][[0, -1]]) for w, m in meshes.items()]),
    )


def with_wire(mesh: LineMesh, name: str, first: int, last: int) -> LineMesh:
    """A mesh with one more wire, with nodes beside those of the messenger wire in a range."""
    nodes = mesh.n_nodes + np.arange(last - first)
    points = mesh.points[mesh.wires[MESSENGER_WIRE][first:last]] + [0.0, 0.2, 0.0]
    return replace(
        mesh, points=np.concatenate([mesh.points, points]), wires={**mesh.wires, name: nodes}
    )


def vertical(mesh: LineMesh) -> Group:
    """Those of the vertical plane for all wires."""
    return dict.fromkeys(mesh.wires, ("w", "theta_y"))


def joined(mesh: LineMesh) -> np.ndarray:
    """Pairs of nodes that elements and droppers join."""
    wires = [mesh.elements(wire) for wire in mesh.wires]
    return np.concatenate([*wires, mesh.droppers])


def check(mesh: LineMesh, found: Unknowns) -> None:
    taken = np.sort(found.numbers[found.numbers >= 0])
    assert (np.diff(taken) > 0).all() and taken[-1] < found.size
    assert found.missing.size == found.size - taken.size
    stations = found.station[joined(mesh)]
    assert np.abs(np.diff(stations, axis=1)).max() <= 1
    x, station = mesh.points[:, 0], found.station
    for place in (0.0, 60.0, 61.7):
        low, high = found.within(place, place + 20.0)
        inside = (x >= place) & (x <= place + 20.0)
        numbers = found.numbers[inside]
        assert low <= numbers[numbers >= 0].min() and numbers.max() < high
    assert (found.low[station] <= x).all() and (x <= found.high[station]).all()


def test_nodes_of_one_place_are_a_station() -> None:
    mesh = paired()
    found = number_unknowns(mesh, [VERTICAL])
    assert found.width == 4 and found.in_stations and not found.missing.size
    check(mesh, found)
    contact, messenger = mesh.wires[CONTACT_WIRE], mesh.wires[MESSENGER_WIRE]
    assert (found.station[contact] == np.arange(contact.size)).all()
    assert (found.station[messenger] == np.arange(contact.size)).all()


def test_groups_of_unknowns_stand_together_in_a_station() -> None:
    mesh = paired()
    found = number_unknowns(mesh, [VERTICAL, LATERAL])
    assert found.names == ("w", "theta_y", "v", "theta_z") and found.width == 8
    check(mesh, found)
    nodes = np.arange(mesh.n_nodes)
    for names, places in ((found.names[:2], range(4)), (found.names[2:], range(4, 8))):
        numbers = np.concatenate([found.of(nodes, name) for name in names])
        assert set(numbers % found.width) == set(places)


@pytest.mark.parametrize(("contact", "messenger"), [(5, 4), (4, 5), (6, 4), (3, 1), (2, 3)])
def test_stations_of_wires_with_other_nodes_join_their_neighbours_only(
    contact: int, messenger: int
) -> None:
    mesh = apart(contact, messenger)
    found = number_unknowns(mesh, [VERTICAL])
    assert found.in_stations
    # The one with fewer has one in each station, the other all of its own.
    assert found.width == 2 * (1 + -(-max(contact, messenger) // min(contact, messenger)))
    check(mesh, found)


def test_where_stations_would_be_too_wide_each_node_is_one() -> None:
    mesh = apart(30, 1)
    found = number_unknowns(mesh, [VERTICAL])
    assert not found.in_stations and found.width == 2 and not found.missing.size


def test_a_wire_has_the_unknowns_that_were_asked_for_it() -> None:
    mesh = paired()
    found = number_unknowns(mesh, [VERTICAL, OF_CONTACT_WIRE])
    contact, messenger = mesh.wires[CONTACT_WIRE], mesh.wires[MESSENGER_WIRE]
    assert found.names == ("w", "theta_y", "v", "theta_z")
    assert found.planes == (4, 2) and found.width == 6 and not found.missing.size
    assert found.n_unknowns == found.size == 6 * contact.size
    check(mesh, found)
    assert found.has(contact, "v").all() and not found.has(messenger, "v").any()
    assert not found.has(contact, "u").any()
    assert (found.of(contact, "v") % 6 == 4).all()
    with pytest.raises(ValueError, match=f"node {messenger[0]} has no unknown theta_z"):
        found.of(messenger, "theta_z")


def test_values_go_from_nodes_to_vectors_and_back() -> None:
    mesh = with_wire(paired(), STITCH, 40, 60)
    found = number_unknowns(mesh, [vertical(mesh), OF_CONTACT_WIRE])
    values = np.where(found.numbers >= 0, 1.0 + np.arange(found.numbers.size).reshape(-1, 4), 0.0)
    vector = found.as_vector(values, missing=-1.0)
    there = found.numbers >= 0
    assert (vector[found.numbers[there]] == values[there]).all()
    assert (np.flatnonzero(vector == -1.0) == found.missing).all()
    x = found.as_vector(mesh.points[:, :1])
    assert (x[found.of(mesh.wires[STITCH], "w")] == mesh.points[mesh.wires[STITCH], 0]).all()


def test_a_station_has_the_wires_that_pass_it_or_those_beside_it() -> None:
    mesh = with_wire(paired(), STITCH, 40, 60)
    found = number_unknowns(mesh, [vertical(mesh)])
    check(mesh, found)
    widths = np.diff(found.starts)
    inside = np.zeros(widths.size, dtype=bool)
    inside[39:61] = True
    assert (widths == np.where(inside, 6, 4)).all()
    assert found.station_types == ((0, 1, 2, 3), (0, 1, 2, 3, 4, 5)) and found.block == 2
    # One station without a node of the wire at either end of it.
    low, high = found.starts[[39, 60]] + 4
    assert (found.missing == [low, low + 1, high, high + 1]).all()
    for first, last in ((0, 5), (150, 160), (165, 200)):
        low, high = found.whole(first, last)
        assert low <= first and last <= high and {low, high} <= set(found.starts)
        begin, end = found.stations_over(first, last)
        assert (found.starts[begin], found.starts[end]) == (low, high)


@pytest.mark.parametrize(("first", "last"), [(20, 30), (5, 75)])
def test_station_types_come_in_one_order_whichever_is_the_commonest(first: int, last: int) -> None:
    mesh = with_wire(paired(), STITCH, first, last)
    found = number_unknowns(mesh, [vertical(mesh)])
    assert found.station_types == ((0, 1, 2, 3), (0, 1, 2, 3, 4, 5))
    check(mesh, found)


def test_a_wire_takes_the_slot_of_one_that_has_ended() -> None:
    last = paired().wires[MESSENGER_WIRE].size
    mesh = paired()
    for number, first in enumerate((10, 30, 50)):
        mesh = with_wire(mesh, f"{STITCH}_{number}", first, first + 10)
    mesh = with_wire(mesh, NEXT_WIRE, 60, last)
    found = number_unknowns(mesh, [vertical(mesh)])
    check(mesh, found)
    # The fourth begins where the third has just ended, and both are there in between.
    assert found.width == 8
    assert set(found.station_types) == {
        tuple(range(4)),
        tuple(range(6)),
        tuple(range(8)),
        (*range(4), 6, 7),
    }


def test_rare_station_types_are_filled_up() -> None:
    mesh = paired()
    for number, (first, last) in enumerate(((5, 80), (15, 70), (25, 60), (35, 50))):
        mesh = with_wire(mesh, f"{STITCH}_{number}", first, last)
    found = number_unknowns(mesh, [vertical(mesh)])
    check(mesh, found)
    assert len(found.station_types) == MOST_STATION_TYPES and found.width == 12
    assert max(map(len, found.station_types)) == 12


def test_pieces_of_one_wire_take_a_slot_one_after_the_other() -> None:
    mesh = with_wire(with_wire(paired(), STITCH, 10, 20), "second", 60, 75)
    both = {name: nodes for name, nodes in mesh.wires.items() if name != "second"}
    both[STITCH] = np.concatenate([mesh.wires[STITCH], mesh.wires["second"]])
    mesh = replace(mesh, wires=both, breaks={STITCH: np.array([10])})
    found = number_unknowns(mesh, [vertical(mesh)])
    check(mesh, found)
    assert found.in_stations and found.width == 6
    assert np.count_nonzero(np.diff(found.starts) == 6) == 12 + 17
    # Without word of the break its element would join stations far apart.
    torn = number_unknowns(replace(mesh, breaks={}), [vertical(mesh)])
    assert not torn.in_stations


# --- how a line is cut for the ranks --------------------------------------------------------------


@pytest.fixture(scope="module")
def model() -> Model:
    line = ac_simple_line(5)
    mesh = mesh_of(line, 3)
    return build(problem_of(line, BARE), mesh, np.ones(mesh.droppers.shape[0]))


@pytest.mark.parametrize("n_ranks", [1, 2, 3, 7, 50])
def test_every_unknown_has_one_owner_and_shares_are_even(model: Model, n_ranks: int) -> None:
    parts = [distribute(model, n_ranks, rank) for rank in range(n_ranks)]
    bounds = parts[0].bounds
    assert bounds[0] == 0 and bounds[-1] == model.n_dofs
    assert (np.diff(bounds) >= 0).all()
    owners = sum(part.owned(np.arange(model.n_dofs)).astype(int) for part in parts)
    assert (owners == 1).all()
    # A cut falls on the nearest of the stations: two nodes, four unknowns, off at most.
    ideal = model.n_dofs / n_ranks
    assert np.abs(np.diff(bounds) - ideal).max() <= 8
    assert sum(part.n_local for part in parts) == model.n_dofs


def test_rank_0_of_a_long_line_has_less_by_what_pantographs_take() -> None:
    line = ac_simple_line(90)
    mesh = mesh_of(line, 9)
    long = build(problem_of(line, BARE), mesh, np.ones(mesh.droppers.shape[0]))
    bounds = distribute(long, 3, 0).bounds
    spared = PANTOGRAPH_NODES * len(long.unknowns)
    assert np.abs(np.diff(bounds) + [spared, 0, 0] - (long.n_dofs + spared) / 3).max() <= 8


def test_stations_and_droppers_stay_together(model: Model) -> None:
    mesh = model.mesh
    for n_ranks in (2, 3, 7, 50):
        parts = [distribute(model, n_ranks, rank) for rank in range(n_ranks)]
        owner = np.empty(model.n_dofs, dtype=int)
        for part in parts:
            owner[part.first : part.last] = part.rank
        of_node = owner[model.dofs(np.arange(mesh.n_nodes))]
        assert (of_node == owner[model.dofs(np.arange(mesh.n_nodes), "theta_y")]).all()
        assert (of_node[mesh.droppers[:, 0]] == of_node[mesh.droppers[:, 1]]).all()
        # The wires have their nodes at the same places here.
        wires = list(mesh.wires.values())
        assert (of_node[wires[0]] == of_node[wires[1]]).all()
        assert (np.diff(of_node[wires[0]]) >= 0).all()


def test_more_ranks_than_stations_leave_some_with_nothing(model: Model) -> None:
    n_stations = model.mesh.n_nodes // 2
    n_ranks = n_stations + 10
    parts = [distribute(model, n_ranks, rank) for rank in range(n_ranks)]
    assert any(part.n_local == 0 for part in parts)
    assert sum(part.n_local for part in parts) == model.n_dofs
    assert max(part.n_local for part in parts) <= 8
