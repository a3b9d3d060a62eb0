"""The mesh of a line: counts, places, heights, and a file that Gmsh itself understands."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path

import gmsh
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catenary import InputError, RunBroken
from catenary.meshgen.build import make_mesh
from catenary.meshgen.gmsh_lines import write_mesh
from catenary.meshgen.line import Line
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.meshgen.reader import read_mesh
from catenary.meshgen.topologies.all_topologies import make_line as line_from
from catenary.meshgen.topologies.line_data import LineData

# Gmsh finds the parameter of each node to 1e-12 of the line's length, and writes 16 digits.
PLACE = 1e-8


def cuts_of(line: LineData) -> np.ndarray:
    """Masts and droppers in order [m]."""
    masts = line.support_positions
    places = [
        start + np.array(at) for start, at in zip(masts, line.dropper_positions, strict=False)
    ]
    return np.sort(np.concatenate([masts, *places]))


@pytest.mark.parametrize("elements_per_gap", [1, 2, 5])
def test_every_gap_holds_the_elements_asked_for(
    make_line: Callable[..., LineData], elements_per_gap: int
) -> None:
    line = make_line()
    mesh = make_mesh(line_from(line), elements_per_gap)
    cuts = cuts_of(line)
    for wire in (CONTACT_WIRE, MESSENGER_WIRE):
        x = mesh.x(mesh.wires[wire])
        assert x.size == elements_per_gap * (cuts.size - 1) + 1
        np.testing.assert_allclose(x[::elements_per_gap], cuts, atol=PLACE)
        length = np.diff(x).reshape(-1, elements_per_gap)
        np.testing.assert_allclose(
            length,
            np.repeat(np.diff(cuts)[:, None] / elements_per_gap, elements_per_gap, axis=1),
            atol=PLACE,
        )
    assert mesh.n_nodes == 2 * (elements_per_gap * (cuts.size - 1) + 1)
    assert mesh.droppers.shape == (12, 2)
    assert mesh.steady_arms.shape == mesh.supports.shape == (3,)
    assert mesh.anchors.shape == (4,)


def test_graded_elements_are_shortest_at_the_cuts(make_line: Callable[..., LineData]) -> None:
    line = make_line()
    mesh = make_mesh(line_from(line), 200, grading=5.0)
    cuts = cuts_of(line)
    for wire in (CONTACT_WIRE, MESSENGER_WIRE):
        x = mesh.x(mesh.wires[wire])
        np.testing.assert_allclose(x[::200], cuts, atol=PLACE)
        length = np.diff(x).reshape(-1, 200)
        # Mean lengths of the first and of the middle elements: the law's ends lie half an element
        # further out, by which sizes change by 1.3 %.
        ratio = length[:, 99] / length[:, 0]
        np.testing.assert_allclose(ratio, 5.0, rtol=0.02)
        np.testing.assert_allclose(length, length[:, ::-1], atol=PLACE)


def test_eight_graded_elements_differ_less_than_their_law(
    make_line: Callable[..., LineData],
) -> None:
    """The key's description says 4 for 6, as each element has the mean of the law along it."""
    mesh = make_mesh(line_from(make_line()), 8, grading=6.0)
    length = np.diff(mesh.x(mesh.wires[CONTACT_WIRE])).reshape(-1, 8)
    # Nodes lie at tanh(a s), s from -1 to 1, of which the slopes at 0 and 1 have the ratio 6.
    law = np.tanh(np.arccosh(np.sqrt(6.0)) * np.array([0.0, 0.25, 0.75, 1.0]))
    assert (law[1] - law[0]) / (law[3] - law[2]) == pytest.approx(4.0, abs=0.05)
    np.testing.assert_allclose(length[:, 3] / length[:, 0], 3.98, atol=0.02)


def test_refinement_multiplies_the_gaps_next_to_masts_only(
    make_line: Callable[..., LineData],
) -> None:
    line = make_line()
    mesh = make_mesh(line_from(line), 2, support_refinement=3)
    masts, cuts = line.support_positions, cuts_of(line)
    for wire in (CONTACT_WIRE, MESSENGER_WIRE):
        x = mesh.x(mesh.wires[wire])
        for left, right in zip(cuts[:-1], cuts[1:], strict=True):
            inside = np.count_nonzero((x > left + PLACE) & (x < right - PLACE))
            next_to_mast = np.isclose(masts, left).any() or np.isclose(masts, right).any()
            assert inside + 1 == (6 if next_to_mast else 2)


def test_droppers_hang_where_the_line_says_in_order(make_line: Callable[..., LineData]) -> None:
    line = make_line()
    mesh = make_mesh(line_from(line), 3)
    wanted = np.setdiff1d(cuts_of(line), line.support_positions)
    for side, wire in ((0, MESSENGER_WIRE), (1, CONTACT_WIRE)):
        np.testing.assert_allclose(mesh.x(mesh.droppers[:, side]), wanted, atol=PLACE)
        assert np.isin(mesh.droppers[:, side], mesh.wires[wire]).all()


def test_arms_supports_and_anchors_sit_on_their_wires(make_line: Callable[..., LineData]) -> None:
    line = make_line()
    mesh = make_mesh(line_from(line), 3)
    masts = line.support_positions
    np.testing.assert_allclose(mesh.x(mesh.steady_arms), masts[1:-1], atol=PLACE)
    np.testing.assert_allclose(mesh.x(mesh.supports), masts[1:-1], atol=PLACE)
    assert np.isin(mesh.steady_arms, mesh.wires[CONTACT_WIRE]).all()
    assert np.isin(mesh.supports, mesh.wires[MESSENGER_WIRE]).all()
    ends = np.concatenate([wire[[0, -1]] for wire in mesh.wires.values()])
    assert sorted(mesh.anchors) == sorted(ends)


def test_contact_wire_follows_pre_sag_stagger_and_the_rise_to_the_tensioners(
    make_line: Callable[..., LineData],
) -> None:
    line = make_line()
    mesh = make_mesh(line_from(line), 4)
    x, y, z = mesh.points[mesh.wires[CONTACT_WIRE]].T
    masts = line.support_positions
    np.testing.assert_allclose(y, np.interp(x, masts, line.stagger), atol=1e-9)
    # transition spans: a parabola, 0.4 m at the anchors; a quarter of it at midspan
    assert z[[0, -1]] == pytest.approx([5.7, 5.7], abs=1e-12)
    assert np.interp(25.0, x, z) == pytest.approx(5.3 + 0.25 * 0.4 - 0.02, abs=1e-9)
    assert np.interp(192.5, x, z) == pytest.approx(5.3 + 0.25 * 0.4 - 0.01, abs=1e-9)
    # second span: droppers at 55, 68, 92, 105 with 0, 30, 30, 0 mm, straight in between
    for place, sag in ((50.0, 0.0), (61.5, 0.015), (68.0, 0.03), (80.0, 0.03), (110.0, 0.0)):
        assert np.interp(place, x, z) == pytest.approx(5.3 - sag, abs=1e-9)


def test_messenger_wire_sags_by_the_weight_of_both_wires(
    make_line: Callable[..., LineData],
) -> None:
    line = make_line()
    mesh = make_mesh(line_from(line), 1)
    x, y, z = mesh.points[mesh.wires[MESSENGER_WIRE]].T
    assert not y.any()
    np.testing.assert_allclose(np.interp(line.support_positions, x, z), 5.3 + 1.4, atol=1e-12)
    # Moment over tension in the middle of the first span, as of a beam on two supports: q L^2 / 8
    # of the own weight, P a / 2 of what hangs at a from the nearer support. The droppers at 10, 25
    # and 40 m share the contact wire with their neighbours, the first one with the anchor.
    loads = 1.35 * np.array([12.5, 15.0, 15.0])
    moment = 9.81 * (1.07 * 50.0**2 / 8 + 0.5 * loads @ [10.0, 25.0, 10.0])
    assert np.interp(25.0, x, z) == pytest.approx(6.7 - moment / 16e3, abs=1e-9)


def test_nodes_are_numbered_along_the_track(make_line: Callable[..., LineData]) -> None:
    mesh = make_mesh(line_from(make_line()), 3)
    assert (np.diff(mesh.points[:, 0]) > -PLACE).all()
    # both wires' nodes of one station are neighbours, the messenger wire's first
    np.testing.assert_array_equal(mesh.wires[CONTACT_WIRE] - mesh.wires[MESSENGER_WIRE], 1)


@st.composite
def spans(draw: st.DrawFn) -> tuple[float, tuple[float, ...]]:
    """Length of a span and the droppers in it, some of them close together or to a mast [m]."""
    gaps = draw(st.lists(st.integers(1, 2000), min_size=1, max_size=6))
    cuts = np.cumsum(gaps) / 100.0
    return float(cuts[-1]), tuple(cuts[:-1].tolist())


@settings(max_examples=40, deadline=None)
@given(given_spans=st.lists(spans(), min_size=1, max_size=5), elements_per_gap=st.integers(1, 6))
def test_any_spans_and_droppers_are_meshed_as_described(
    make_line: Callable[..., LineData],
    given_spans: list[tuple[float, tuple[float, ...]]],
    elements_per_gap: int,
) -> None:
    n = len(given_spans)
    line = make_line(
        span_lengths=tuple(length for length, _ in given_spans),
        dropper_positions=tuple(places for _, places in given_spans),
        pre_sag=tuple((0.0,) * len(places) for _, places in given_spans),
        stagger=(0.2,) * (n + 1),
        n_transition=(0, 0),
        encumbrance=10.0,
    )
    mesh = make_mesh(line_from(line), elements_per_gap)
    cuts = cuts_of(line)
    for wire in (CONTACT_WIRE, MESSENGER_WIRE):
        np.testing.assert_allclose(mesh.x(mesh.wires[wire])[::elements_per_gap], cuts, atol=PLACE)
    assert mesh.droppers.shape == (cuts.size - n - 1, 2)
    assert mesh.steady_arms.size == mesh.supports.size == n - 1


# Gmsh places graded nodes by quadrature, to 1e-8 of a gap of some metres.
@pytest.mark.parametrize(
    ("refinement", "grading", "within"), [(1, 1.0, PLACE), (2, 1.0, PLACE), (1, 6.0, 3e-7)]
)
def test_a_mesh_without_a_file_is_that_of_the_file(
    make_line: Callable[..., LineData],
    tmp_path: Path,
    refinement: int,
    grading: float,
    within: float,
) -> None:
    line = line_from(make_line())
    written, made = (
        make_mesh(line, 7, path, support_refinement=refinement, grading=grading)
        for path in (tmp_path / "line.msh", None)
    )
    np.testing.assert_allclose(made.points, written.points, rtol=0, atol=within)
    for name, nodes in written.wires.items():
        np.testing.assert_array_equal(made.wires[name], nodes)
    for name in ("droppers", "steady_arms", "supports", "anchors", "dropper_group"):
        np.testing.assert_array_equal(getattr(made, name), getattr(written, name))


def test_gmsh_opens_the_file_with_its_physical_groups(
    make_line: Callable[..., LineData], tmp_path: Path
) -> None:
    path = tmp_path / "line.msh"
    mesh = make_mesh(line_from(make_line()), 2, path)
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(path))
        groups = {
            gmsh.model.getPhysicalName(*group): (
                group[0],
                len(gmsh.model.mesh.getNodesForPhysicalGroup(*group)[0]),
            )
            for group in gmsh.model.getPhysicalGroups()
        }
    finally:
        gmsh.finalize()
    wire = mesh.wires[CONTACT_WIRE].size
    assert groups == {
        "contact_wire": (1, wire),
        "messenger_wire": (1, wire),
        "droppers": (1, 24),
        "steady_arms": (0, 3),
        "supports": (0, 3),
        "anchors": (0, 4),
    }


def test_a_single_span_has_no_supports_and_is_read_back(make_line: Callable[..., LineData]) -> None:
    line = make_line(
        span_lengths=(50.0,),
        dropper_positions=((),),
        pre_sag=((),),
        stagger=(0.0, 0.0),
        n_transition=(0, 0),
    )
    mesh = make_mesh(line_from(line), 4)
    assert mesh.n_nodes == 10
    assert mesh.droppers.shape == (0, 2)
    assert mesh.supports.size == mesh.steady_arms.size == 0
    np.testing.assert_array_equal(mesh.anchors, [0, 1, 8, 9])


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("line.vtk", "must have a name that ends in .msh"),
        ("missing/line.msh", "cannot be written"),
    ],
)
def test_an_impossible_request_is_refused(
    make_line: Callable[..., LineData],
    tmp_path: Path,
    name: str,
    sentence: str,
) -> None:
    with pytest.raises(InputError, match=sentence):
        write_mesh(line_from(make_line()), 3, tmp_path / name)
    assert not gmsh.isInitialized()


def test_gmsh_prints_nothing_and_leaves_the_interrupt_alone(
    line: Line, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    before = signal.getsignal(signal.SIGINT)
    write_mesh(line, 3, tmp_path / "line.msh")
    read_mesh(tmp_path / "line.msh", line)
    assert signal.getsignal(signal.SIGINT) is before
    assert not gmsh.isInitialized()
    assert capfd.readouterr() == ("", "")


def test_an_open_session_of_the_caller_stays_open(
    make_line: Callable[..., LineData], tmp_path: Path
) -> None:
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("of the caller")
        write_mesh(line_from(make_line()), 3, tmp_path / "line.msh")
        assert gmsh.isInitialized()
        assert gmsh.model.list() == ["", "of the caller"]
    finally:
        gmsh.finalize()


def test_a_mesh_that_finds_no_room_leaves_the_earlier_file(
    make_line: Callable[..., LineData], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a full disk Gmsh ends amid the file and says nothing."""
    path = tmp_path / "line.msh"
    write_mesh(line_from(make_line()), 2, path)
    earlier, write = path.read_bytes(), gmsh.write

    def writes_half(name: str) -> None:
        write(name)
        os.truncate(name, len(earlier) // 2)

    monkeypatch.setattr(gmsh, "write", writes_half)
    with pytest.raises(RunBroken, match="line.msh cannot be written to its end: free some space"):
        write_mesh(line_from(make_line()), 3, path)
    assert path.read_bytes() == earlier and list(tmp_path.iterdir()) == [path]
