"""Meshes that are not ours: accepted whatever their numbering, refused with a sentence."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import gmsh
import numpy as np
import pytest

from catenary import InputError
from catenary.meshgen.build import make_mesh, use_mesh
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.meshgen.reader import read_mesh
from catenary.meshgen.topologies.all_topologies import make_line as line_from
from catenary.meshgen.topologies.line_data import LineData


def test_a_file_in_any_order_and_numbering_is_read(
    by_hand: Any, line: Line, tmp_path: Path
) -> None:
    mesh = read_mesh(by_hand.write(tmp_path / "own.msh"), line)
    assert mesh.n_nodes == 10  # neither the stray node nor the one half-way down a dropper
    np.testing.assert_array_equal(mesh.x(mesh.wires[CONTACT_WIRE]), [0, 5, 10, 15, 20])
    np.testing.assert_array_equal(mesh.x(mesh.wires[MESSENGER_WIRE]), [0, 5, 10, 15, 20])
    np.testing.assert_array_equal(mesh.points[mesh.wires[CONTACT_WIRE], 2], 5.0)
    np.testing.assert_array_equal(mesh.points[mesh.droppers[:, 0]], [[5, 0, 6], [15, 0, 6]])
    np.testing.assert_array_equal(mesh.points[mesh.droppers[:, 1]], [[5, 0.1, 5], [15, 0.1, 5]])
    np.testing.assert_array_equal(mesh.points[mesh.steady_arms], [[10, 0.1, 5]])
    np.testing.assert_array_equal(mesh.points[mesh.supports], [[10, 0, 6]])
    np.testing.assert_array_equal(np.sort(mesh.x(mesh.anchors)), [0, 0, 20, 20])


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("binary", [0, 1])
def test_what_gmsh_saves_again_in_another_version_is_the_same_line(
    line: Line, tmp_path: Path, version: float, binary: int
) -> None:
    first, second = tmp_path / "line.msh", tmp_path / "again.msh"
    mesh = make_mesh(line, 3, first)
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(first))
        curves = gmsh.model.getEntities(1)
        # an entity may belong to a group of the user's own as well
        gmsh.model.addPhysicalGroup(1, [tag for _, tag in curves], name="everything")
        gmsh.model.mesh.reverse(curves[::2])
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(second))
    finally:
        gmsh.finalize()
    again = read_mesh(second, line)
    np.testing.assert_allclose(again.points, mesh.points, atol=1e-12)
    for wire in (CONTACT_WIRE, MESSENGER_WIRE):
        np.testing.assert_array_equal(again.wires[wire], mesh.wires[wire])
    for name in ("droppers", "steady_arms", "supports", "anchors"):
        np.testing.assert_array_equal(getattr(again, name), getattr(mesh, name))


def _without(name: str) -> Callable[[Any], None]:
    def change(content: Any) -> None:
        content.lines.pop(name, None)
        content.nodes.pop(name, None)

    return change


def _move(number: int, x: float, y: float, z: float) -> Callable[[Any], None]:
    return lambda content: content.points.update({number: (x, y, z)})


def _append(group: str, *elements: tuple[int, ...]) -> Callable[[Any], None]:
    return lambda content: content.lines[group].extend(elements)


def _nodes(group: str, *numbers: int) -> Callable[[Any], None]:
    return lambda content: content.nodes.update({group: list(numbers)})


def _lines(group: str, *elements: tuple[int, ...]) -> Callable[[Any], None]:
    return lambda content: content.lines.update({group: list(elements)})


def _split_node(content: Any) -> None:
    """Two nodes at x = 10 of the contact wire that were not merged."""
    content.points[906] = content.points[905]
    content.lines["contact_wire"] = [(903, 901), (901, 905), (906, 902), (902, 904)]


def _wrong_dimension(content: Any) -> None:
    del content.nodes["supports"]
    content.lines["supports"] = [(11, 14)]


REFUSED: dict[str, tuple[Callable[[Any], None], str]] = {
    **{
        f"without {name}": (_without(name), f"the physical group {name} of {kind} is missing")
        for name, kind in (
            ("contact_wire", "lines"),
            ("messenger_wire", "lines"),
            ("droppers", "lines"),
            ("steady_arms", "points"),
            ("supports", "points"),
            ("anchors", "points"),
        )
    },
    "group of lines for points": (_wrong_dimension, "supports holds lines, but must hold points"),
    "elements of three nodes": (_lines("droppers", (12, 901, 500)), "elements of higher order"),
    "wire without elements": (
        lambda content: (content.lines.pop("contact_wire"), content.empty.update(contact_wire=1)),
        "the physical group contact_wire has no members",
    ),
    "node that is not there": (_append("droppers", (12, 600)), "uses a node that the file lacks"),
    "infinite coordinate": (_move(901, 5.0, float("inf"), 5.0), "three finite coordinates"),
    "wire in two pieces": (
        _split_node,
        "contact_wire is not one simple chain but 2 separate ones, which end at x = 0, 10, 10, 20",
    ),
    "wire with a branch": (
        _append("messenger_wire", (11, 500)),
        "messenger_wire is not one simple chain: more than two of its elements meet at x = 10",
    ),
    "wire that turns back": (_move(901, 12.0, 0.1, 5.0), "contact_wire is not one simple chain in"),
    "wire that closes": (
        _append("contact_wire", (903, 904)),
        "contact_wire is not one simple chain in the order of x: it turns back or closes",
    ),
    "wire that stands upright": (
        _move(901, 0.0, 0.1, 4.0),
        "contact_wire does not advance along the track at x = 0",
    ),
    "element of zero length": (
        _move(901, 0.0, 0.1, 5.0),
        "contact_wire has an element of zero length at x = 0",
    ),
    "wires that touch": (
        _lines("messenger_wire", (15, 12), (12, 905), (905, 14), (14, 13)),
        "contact_wire and messenger_wire share the node at x = 10, y = 0.1, z = 5 m",
    ),
    "dropper that ends in the air": (
        _lines("droppers", (12, 901), (14, 500)),
        "droppers: a dropper ends in the air at x = 15, y = 0.05, z = 5.5 m",
    ),
    "dropper that branches": (
        _append("droppers", (500, 905)),
        "droppers: a dropper branches at x = 15",
    ),
    "dropper that joins no wire": (
        lambda content: (
            content.points.update({1: (1, 0, 5.2), 2: (1, 0, 5.4), 3: (1, 1, 5.4)}),
            content.lines["droppers"].extend([(1, 2), (2, 3), (3, 1)]),
        ),
        "droppers: the elements at x = 1, y = 0, z = 5.[24] m join no wire",
    ),
    "dropper along one wire": (
        _append("droppers", (15, 11)),
        "joins messenger_wire with itself",
    ),
    "dropper of zero length": (_append("droppers", (12, 12)), "an element of zero length at x = 5"),
    "dropper upside down": (
        _move(12, 5.0, 0.0, 4.0),
        "the dropper at x = 5, .* does not hang down",
    ),
    "leaning dropper": (
        _move(12, 5.6, 0.0, 6.0),
        "leans 0.6 m along the track, but at most 0.5 m is allowed",
    ),
    "dropper twice": (_append("droppers", (901, 12)), "two droppers join the same nodes at x = 5"),
    "arm on the messenger wire": (
        _nodes("steady_arms", 11),
        "the steady arm at x = 10, y = 0, z = 6 m is not a node of contact_wire",
    ),
    "support on the contact wire": (
        _nodes("supports", 905),
        "the support at x = 10, y = 0.1, z = 5 m is not a node of messenger_wire",
    ),
    "support on nothing": (_nodes("supports", 77), "the support at x = 3, y = 3, z = 3 m is not"),
    "anchor in mid-wire": (
        _nodes("anchors", 903, 904, 15, 13, 11),
        "the anchor at x = 10, y = 0, z = 6 m is not the end of a wire",
    ),
    "free end": (
        _nodes("anchors", 903, 904, 15),
        "the end of a wire at x = 20, y = 0, z = 6 m is in no group",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_mesh_that_is_no_line_is_refused(
    by_hand: Any, line: Line, tmp_path: Path, case: str
) -> None:
    change, sentence = REFUSED[case]
    change(by_hand)
    path = by_hand.write(tmp_path / "own.msh")
    with pytest.raises(InputError, match=sentence) as caught:
        read_mesh(path, line)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_arms_and_supports_may_be_left_empty_if_named(
    by_hand: Any, line: Line, tmp_path: Path
) -> None:
    for name, dimension in (("steady_arms", 0), ("supports", 0), ("droppers", 1)):
        _without(name)(by_hand)
        by_hand.empty[name] = dimension
    mesh = read_mesh(by_hand.write(tmp_path / "own.msh"), line)
    assert mesh.steady_arms.size == mesh.supports.size == mesh.droppers.size == 0


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"not a mesh\n",
        b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n",
        b"$MeshFormat\n9.9 0 8\n$EndMeshFormat\n",
        b"$MeshFormat\n4.1 1 8\n\x01\x00\x00\x00\n$EndMeshFormat\n$Nodes\n\x00\x01",
        b"\xff\xfe\x00\x01",
    ],
)
def test_what_is_no_mesh_file_is_refused_in_silence(
    line: Line, tmp_path: Path, content: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "own.msh"
    path.write_bytes(content)
    with pytest.raises(InputError, match="own.msh") as caught:
        read_mesh(path, line)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_a_truncated_file_is_refused(line: Line, tmp_path: Path) -> None:
    path = tmp_path / "line.msh"
    make_mesh(line, 2, path)
    content = path.read_bytes()
    for share in (0.2, 0.5, 0.9):
        path.write_bytes(content[: int(share * len(content))])
        with pytest.raises(InputError, match=r"line\.msh"):
            read_mesh(path, line)


def test_a_missing_file_is_named(line: Line, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"absent\.msh does not exist"):
        read_mesh(tmp_path / "absent.msh", line)


def test_elements_without_a_group_are_explained(by_hand: Any, line: Line, tmp_path: Path) -> None:
    first, second = by_hand.write(tmp_path / "own.msh"), tmp_path / "all.msh"
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(first))
        left, right = gmsh.model.geo.addPoint(0, 0, 0), gmsh.model.geo.addPoint(1, 0, 0)
        gmsh.model.geo.addLine(left, right)
        gmsh.model.geo.synchronize()
        gmsh.model.mesh.generate(1)
        gmsh.option.setNumber("Mesh.SaveAll", 1)
        gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
        gmsh.write(str(second))
    finally:
        gmsh.finalize()
    with pytest.raises(InputError, match=r"Mesh\.SaveAll = 0"):
        read_mesh(second, line)


def _two_spans(make_line: Callable[..., LineData], **changes: object) -> LineData:
    settings: dict[str, object] = {
        "span_lengths": (10.0, 10.0),
        "dropper_positions": ((5.0,), (5.0,)),
        "pre_sag": ((0.0,), (0.0,)),
        "stagger": (0.1, 0.1, 0.1),
    }
    return make_line(**{**settings, **changes})


def test_a_mesh_of_ones_own_serves_the_line_that_it_fits(
    by_hand: Any, make_line: Callable[..., LineData], tmp_path: Path
) -> None:
    mesh = use_mesh(line_from(_two_spans(make_line)), by_hand.write(tmp_path / "own.msh"))
    assert mesh.n_nodes == 10


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"span_lengths": (10.0, 11.0)}, "the ends of contact_wire of the mesh do not fit"),
        ({"span_lengths": (10.5, 9.5)}, "the supports of the mesh do not fit .*: x = 10 m in the"),
        ({"dropper_positions": ((5.0,), (5.02,))}, "the droppers of the mesh .* 15.02 m in the sc"),
        (
            {"dropper_positions": ((5.0,), (3.0, 6.0)), "pre_sag": ((0.0,), (0.0, 0.0))},
            "the mesh has 2 droppers, but the scene's line has 3",
        ),
    ],
)
def test_a_mesh_of_another_line_is_refused(
    by_hand: Any,
    make_line: Callable[..., LineData],
    tmp_path: Path,
    changes: dict[str, object],
    sentence: str,
) -> None:
    path = by_hand.write(tmp_path / "own.msh")
    with pytest.raises(InputError, match=sentence):
        use_mesh(line_from(_two_spans(make_line, **changes)), path)
