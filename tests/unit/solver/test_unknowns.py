"""The registry of unknowns: numbers by stations, groups of a station, wires of other nodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_lines import ac_simple_line, mesh_of

from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.solver.model.unknowns import Unknowns, number_unknowns

VERTICAL, LATERAL = ("w", "theta_y"), ("v", "theta_z")


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


def joined(mesh: LineMesh) -> np.ndarray:
    """Pairs of nodes that elements and droppers join."""
    wires = [np.column_stack([nodes[:-1], nodes[1:]]) for nodes in mesh.wires.values()]
    return np.concatenate([*wires, mesh.droppers])


def check(mesh: LineMesh, found: Unknowns) -> None:
    taken = np.sort(found.numbers.ravel())
    assert (np.diff(taken) > 0).all() and taken[-1] < found.size
    assert found.missing.size == found.size - taken.size
    stations = found.station_of(joined(mesh))
    assert np.abs(np.diff(stations, axis=1)).max() <= 1
    x, station = mesh.points[:, 0], found.station_of(np.arange(mesh.n_nodes))
    for place in (0.0, 60.0, 61.7):
        low, high = found.within(place, place + 20.0)
        inside = (x >= place) & (x <= place + 20.0)
        numbers = found.numbers[inside]
        assert low <= numbers.min() and numbers.max() < high
    assert (found.low[station] <= x).all() and (x <= found.high[station]).all()


def test_nodes_of_one_place_are_a_station() -> None:
    mesh = paired()
    found = number_unknowns(mesh, [VERTICAL])
    assert found.width == 4 and found.in_stations and not found.missing.size
    check(mesh, found)
    contact, messenger = mesh.wires[CONTACT_WIRE], mesh.wires[MESSENGER_WIRE]
    assert (found.station_of(contact) == np.arange(contact.size)).all()
    assert (found.station_of(messenger) == np.arange(contact.size)).all()


def test_groups_of_unknowns_stand_together_in_a_station() -> None:
    mesh = paired()
    found = number_unknowns(mesh, [VERTICAL, LATERAL])
    assert found.names == VERTICAL + LATERAL and found.width == 8
    check(mesh, found)
    nodes = np.arange(mesh.n_nodes)
    for names, places in ((VERTICAL, range(4)), (LATERAL, range(4, 8))):
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
