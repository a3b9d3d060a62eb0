"""`line.topology`: tables it takes or refuses, lines that come of it, lines as free tables."""

from __future__ import annotations

import copy
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from free_tables import as_free
from measuring import check, march
from scenes import Scene, line_of, load_scene, mesh_of, problem_of, resolved, scene_from

from catenary.cases.run.at_rest import static_table
from catenary.cases.scene.input.case_files import read_toml
from catenary.cases.scene.input.faults import Origin, SceneError
from catenary.cases.terminal.terminal_text import static_text
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.wires import End, Role
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest

# --- `line.topology` ------------------------------------------------------------------------------


RE330, COMPOUND = "re330_stitched", "shinkansen_compound"
TWIN, TRAM, OVERLAP = "dc_twin", "tramway", "overlap"
BRIDLE = "{tension_N=2000,mass_kg_per_m=0.31,bending_stiffness_N_m2=1.6,length_m=8}"
WITHOUT_STITCH = ["line.topology=simple", "line.stitch_wire="]
OLD_TENSIONS = ["line.contact_wire.tension_N=14700", "line.auxiliary_wire.tension_N=14700"]

REFUSED = {
    "unknown": (RE330, ["line.topology=stiched"], "line.topology is .stiched.*did you mean stitch"),
    "unlike any": (RE330, ["line.topology=x"], "it must be one of .*simple"),
    "no stitch wire": (RE330, ["line.stitch_wire="],
                       r"line.stitch_wire \(stitch wires at the supports\) is missing"),
    "no messenger": (RE330, ["line.messenger_wire="], r"line.messenger_wire \(.*\) is missing"),
    "no encumbrance": (RE330, ["line.encumbrance_m="], r"line.encumbrance_m \(.*\) is missing"),
    "no droppers": (RE330, ["line.dropper="], r"line.dropper \(.*\) is missing"),
    "stitch wire of a simple line": (
        RE330, ["line.topology=simple"],
        "line.stitch_wire in .* is no part of the topology simple; leave it out, or take "
        "line.topology = stitched"),
    "auxiliary wire of a simple line": (
        COMPOUND, ["line.topology=simple"], "line.auxiliary_wire in .* is no part of .* compound"),
    "no auxiliary wire": (COMPOUND, ["line.auxiliary_wire="], "line.auxiliary_wire .* is missing"),
    "long stitch wires": (RE330, ["line.stitch_wire.length_m=65"],
                          "length_m is 65 m .* it must be less than the shortest span .65 m."),
    "stitch wires of no length": (RE330, ["line.stitch_wire.length_m=1e-299"],
                                  "it must be at least 0.1 .m."),
    "short stitch wires": (RE330, ["line.stitch_wire.length_m=9"],
                           "no dropper would hang from it: the nearest one is 5 m"),
    "clamp on a dropper": (RE330, ["line.stitch_wire.length_m=10"],
                           "its clamp at 60 m of the line would stand on a dropper"),
    "one span": (RE330, ["line.n_spans=1"], "a line with stitch wires needs a support, that is"),
    "one span with bridles": (
        TRAM, [f"line.bridle={BRIDLE}", "line.n_spans=1", "train.start_m=1", "evaluation.from_m=2",
               "evaluation.to_m=20", "train.raise_time_s=0"],
        "n_spans is 1 .* a line with bridles needs a support, that is two spans"),
    "strong stitch wires": (RE330, ["line.stitch_wire.tension_N=21000"],
                            "it must be less than line.messenger_wire.tension_N .21000 N"),
    "stitch wires in kN": (RE330, ["line.stitch_wire.tension_N=3.5"], "is it 3.5 kN. write 3500"),
    "high auxiliary wire": (COMPOUND, ["line.auxiliary_wire.height_m=1.5"],
                            "it must be less than line.encumbrance_m .1.5 m"),
    "auxiliary wire above its droppers": (
        COMPOUND, ["line.auxiliary_wire.height_m=1.4"],
        "the messenger wire would hang 0.* m below the auxiliary wire in span"),
    "dropper outside": (COMPOUND, ["line.auxiliary_wire.dropper.positions_m=[5,55]"],
                        "line.auxiliary_wire.dropper.positions_m .* puts a dropper at 55 m"),
    "pre-sag of the auxiliary wire": (
        COMPOUND, ["line.auxiliary_wire.dropper.positions_m=",
                   "line.auxiliary_wire.dropper.patterns="
                   "[{span_m=50,positions_m=[25],pre_sag_mm=[3]}]"],
        "takes no pre_sag_mm in patterns"),
    "pattern for another span": (
        COMPOUND, ["line.auxiliary_wire.dropper.positions_m=",
                   "line.auxiliary_wire.dropper.patterns=[{span_m=40,positions_m=[25]}]"],
        "line.auxiliary_wire.dropper.patterns .* has no entry for spans of 50 m; it has 40 m"),
    "twin wires of a simple line": (
        TWIN, ["line.topology=simple"],
        "line.twin in .* is no part of the topology simple.* twin or twin_messenger"),
    "no distance of twins": (TWIN, ["line.twin="], r"line.twin \(two contact .*\) is missing"),
    "twins in mm": (TWIN, ["line.twin.spacing_m=60"], "it must be at most 1 .m.; usual are .*; is"
                    "|at most 1 .m."),
    "droppers in threes": (TWIN, ["line.twin.droppers=threes"], "must be pairs or alternating"),
    "droppers of a single wire": (
        TRAM, ["line.dropper={count=3,spacing_m=5,stiffness_N_per_m=1e5}"],
        "line.dropper on the command line .* is no part of the topology single"),
    "encumbrance of a single wire": (TRAM, ["line.encumbrance_m=1"], "is no part of the topology"),
    "bridle of a simple line": (
        RE330, [f"line.bridle={BRIDLE}"], "line.bridle .* is no part of .* line.topology = single"),
    "overlap at the end": (
        OVERLAP, ["line.overlap.first_span=27"],
        "first_span is 27 .*an overlap of 4 spans needs a running span before it and behind it: "
        "possible are from 2 to 26"),
    "overlap upon overlap": (
        OVERLAP, ["line.overlap.first_span=[8,12]"],
        "first_span.1 is 12 .*an overlap of 4 spans needs a running span before it and behind it: "
        "possible are from 13 to 26"),
    "overlaps without order": (
        OVERLAP, ["line.overlap.first_span=[14,8]"], "in ascending order, but 8 follows 14"),
    "dense overlaps": (
        OVERLAP, ["line.overlap.n_spans=5", "line.overlap.repeat_every_spans=5"],
        "repeat_every_spans is 5 .* it must be at least 6"),
    "overlap of a short line": (OVERLAP, ["line.n_spans=5", "train.start_m=201",
                                "evaluation.from_m=201", "evaluation.to_m=202",
                                "train.raise_time_s=0"],
                                "possible are none, as the line is too short"),
    "overlap of two spans": (OVERLAP, ["line.overlap.n_spans=2"], "must be at least 3"),
    "steep overlap": (OVERLAP, ["line.overlap.rise_m=1.2"],
                      "it must be less than the 1.2 m that the messenger wire is above"),
    "overlap that rises too far": (OVERLAP, ["line.overlap.rise_m=1.1"], "below the contact wire"),
    "overlap under a messenger wire that is near": (
        COMPOUND, ["line.overlap.first_span=12", "line.overlap.rise_m=1.0"],
        "encumbrance_m is .* m below the auxiliary wire in span .* or lower the rise of the trans"),
    "strips too short for the wires of an overlap": (
        OVERLAP, ["pantographs.three_masses.strips.length_m=0.7",
                  "train.pantographs=[{name='three_masses',behind_m=0.0}]"],
        "at 770 m the wire is 0.4 m beside the strips' middle .* at least 0.8 m long"),
    "long bridle": (TRAM, [f"line.bridle={BRIDLE}", "line.bridle.length_m=30"],
                    "it must be less than the shortest span .30 m."),
    "strong bridle": (TRAM, [f"line.bridle={BRIDLE}", "line.bridle.tension_N=10000"],
                      "it must be less than line.contact_wire.tension_N .10000 N"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_a_table_that_does_not_fit_is_refused_in_one_sentence(name: str) -> None:
    case, changes, expected = REFUSED[name]
    with pytest.raises(SceneError) as refused:
        load_scene(case, changes)
    (fault,) = refused.value.faults
    assert re.search(expected, fault.sentence), fault.sentence


def test_droppers_may_be_as_near_to_each_other_as_the_refusal_says() -> None:
    """10.001 - 10 is less than 0.001 in binary numbers."""
    at_will = [f"line.dropper.{key}=" for key in ("count", "spacing_m", "pre_sag_mm")]
    load_scene("ac_simple", [*at_will, "line.dropper.positions_m=[10, 10.001]"])
    with pytest.raises(SceneError, match="10 and 10.0009 m; they must be at least 0.001 m apart"):
        load_scene("ac_simple", [*at_will, "line.dropper.positions_m=[10, 10.0009]"])


def rest_of(case: str, changes: list[str]) -> LineAtRest:
    """A shortened case at rest."""
    scene = load_scene(case, changes, shortened=True)
    return line_at_rest(problem_of(scene), mesh_of(scene))


@pytest.mark.parametrize(
    ("case", "changes", "most", "least"),
    [
        (RE330, [], 0.443, 0.322),
        (RE330, WITHOUT_STITCH, 0.396, 0.147),
        (RE330, ["line.stitch_wire.tension_N=2000"], 0.438, 0.316),
        (RE330, ["line.stitch_wire.tension_N=5000"], 0.450, 0.330),
        (COMPOUND, [], 0.322, 0.183),
        (COMPOUND, OLD_TENSIONS, 0.336, 0.172),
        (TWIN, [], 0.269, 0.089),
    ],
)
def test_elasticity_is_that_of_an_independent_model(
    case: str, changes: list[str], most: float, least: float
) -> None:
    """Figures of another finite-element model, of three digits.

    Its strands' bending stiffness is not known; without it the extremes move by some 0.001 mm/N
    (the test below), which bounds what it may explain.
    """
    lift = 1e3 * rest_of(case, changes).lift.lift
    check("elasticity max, min [mm/N]", [lift.max(), lift.min()], [most, least], within=1.5e-3)


def test_a_stitched_line_is_softer_at_the_support_and_more_even() -> None:
    stitched, simple = rest_of(RE330, []), rest_of(RE330, WITHOUT_STITCH)
    at_mast = [float(rest.lift.lift[0]) for rest in (stitched, simple)]
    print(f"at the support {1e3 * at_mast[0]:.3f} and {1e3 * at_mast[1]:.3f} mm/N")
    assert at_mast[0] > 1.8 * at_mast[1]
    uneven = [float(np.ptp(r.lift.lift) / (r.lift.lift.max() + r.lift.lift.min()))
              for r in (stitched, simple, rest_of(COMPOUND, []))]  # fmt: skip
    assert uneven[0] < 0.17 and uneven[1] > 0.45 and uneven[0] < uneven[2] < uneven[1]


def test_bending_of_strands_moves_the_elasticity_by_little() -> None:
    strings = ["line.messenger_wire.bending_stiffness_N_m2=0",
               "line.stitch_wire.bending_stiffness_N_m2=0"]  # fmt: skip
    with_strands, without = rest_of(RE330, []), rest_of(RE330, strings)
    moved = 1e3 * np.abs(with_strands.lift.lift - without.lift.lift).max()
    assert 1e-5 < moved < 1.5e-3, moved


@pytest.mark.parametrize("case", [RE330, COMPOUND])
def test_a_line_of_a_scene_has_its_topology_and_hangs_taut(case: str) -> None:
    rest = rest_of(case, [])
    line = rest.problem.line
    role = Role.STITCH if case == RE330 else Role.AUXILIARY
    assert len(line.wires_of(role)) == 1 and line.topology in load_scene(case).line.topology
    assert rest.form.dropper_force.min() > 20.0
    low = rest.mesh.droppers[:, 1]
    contact = np.isin(low, rest.mesh.wires["contact_wire"])
    height = rest.form.height[low[contact]]
    check("height at the droppers [m]", height, line_of(load_scene(case)).wires[0].top, within=1e-9)


def test_a_bridle_softens_the_support_of_a_single_wire() -> None:
    bridled, stiff = rest_of(TRAM, [f"line.bridle={BRIDLE}"]), rest_of(TRAM, [])
    at_mast = [1e3 * float(rest.lift.lift[0]) for rest in (bridled, stiff)]
    print(f"at the support {at_mast[0]:.3f} and {at_mast[1]:.3f} mm/N")
    assert at_mast[0] > 0.5 and at_mast[1] == pytest.approx(0.01, rel=0.05)  # a spring of 1e5 N/m
    assert [wire.name for wire in bridled.problem.line.wires] == ["contact_wire", "bridle_wire"]


def test_installers_read_which_wire_hangs_on_which_and_how_long_it_is() -> None:
    """A stitch wire of 18 m from clamp to clamp is longer along itself by its sag: it hangs on two
    halves that fall by some f, 2 f^2 / 9 m, and not by more than bending hides."""
    scene = load_scene(RE330, shortened=True)
    table, line = static_table(scene), line_of(scene)
    near = abs(table["dropper_x"][:, None] - line.support_positions[1:-1]).min(axis=1) < 9.0
    assert (table["dropper_upper"] == np.where(near, "stitch_wire", "messenger_wire")).all()
    assert set(table["dropper_lower"]) == {"contact_wire"}
    lengths = table["lengths/stitch_wire"]
    assert lengths.size == line.n_spans - 1
    rest = rest_of(RE330, [])
    nodes = rest.mesh.wires["stitch_wire"][: rest.mesh.breaks["stitch_wire"][0]]
    falls = float(np.ptp(rest.form.height[nodes]))
    print(f"{lengths[0]:.4f} m, falls by {falls:.3f} m")
    assert 18.0 + falls**2 / 9.0 < lengths[0] < 18.0 + 4.0 * falls**2 / 9.0
    text = static_text(table, line)
    assert "messenger_wire: tension 21000 N, 17500 N beside wires" in text
    assert re.search(r"stitch_wire: tension 3500 N; 13 pieces, 18\.\d+ m long", text)
    assert "stitch_wire to contact_wire" in text


@pytest.mark.parametrize("case", [TRAM, TWIN])
def test_tables_of_lines_without_droppers_or_with_two_wires(case: str) -> None:
    scene = load_scene(case, shortened=True)
    table = static_table(scene)
    lower = {wire.name for wire in line_of(scene).wires_of(Role.CONTACT)}
    assert set(table["dropper_lower"]) == (lower if case == TWIN else set())
    assert static_text(table, line_of(scene)).count("tension ") == len(line_of(scene).wires)


def test_sags_are_told_between_supports_where_trains_run() -> None:
    """Neither the height of a fixed end nor the rise in an overlap counts as sag.

    In the spans of a wire alone the closed form is m g L^2 / 8 T; bending takes EI's boundary layer
    off, P r / 2 T with the force P on an arm and r = (EI / T)^(1/2), 1.5 of 105 mm.
    """
    scene = load_scene(TRAM, shortened=True)
    text = static_text(static_table(scene), line_of(scene))
    told = re.search(r"in spans 2 to 23: .*, 5.5000 m at the supports.* supports ([\d.]+) mm", text)
    assert told is not None
    check("sag [mm]", float(told[1]), 104.8 - 1.5, within=0.5)
    scene = load_scene(OVERLAP, shortened=True)
    text = static_text(static_table(scene), line_of(scene))
    first, second = re.findall(r"in spans (\d+) to (\d+): .* supports ([\d.]+) mm", text)
    assert first[0] == "2" and int(second[0]) == int(first[1]) + 1
    assert 49.0 < float(first[2]) == float(second[2]) < 55.0


# --- `line.topology = "free"` ---------------------------------------------------------------------


EXAMPLE = Path(__file__).parents[2] / "docs/examples/two_messengers.toml"
Raw = dict[str, Any]
# What an absorbing layer has, and an end that is held does not.
LAYER = ("spans", "damping_per_s")


def scene_of(raw: Raw) -> Scene:
    return scene_from(raw, Origin("case.toml", recorded=True))


def example() -> Raw:
    return read_toml(EXAMPLE)


@pytest.mark.parametrize(
    ("case", "changes"),
    [
        ("ambrosio2012", ["line.n_spans=8", "train.pantographs.0.name=lumped"]),
        ("re330_stitched", ["line.n_spans=6"]),
        ("dc_twin", ["line.n_spans=6"]),
        pytest.param(
            "tensioned_section",
            ["line.n_spans=6", "line.mid_points_m=[110]"]
            + [f"line.ends.{side}.kind=fixed" for side in ("start", "end")]
            + [f"line.ends.{side}.{key}=" for side in ("start", "end") for key in LAYER],
            marks=pytest.mark.study,
        ),
    ],
)
def test_a_shipped_line_as_free_tables_is_the_same_line(case: str, changes: list[str]) -> None:
    """Heights, dropper forces, elasticity and 0.15 s of every contact force, to round-off."""
    ran = ["train.end_m=130", "train.start_m=111", "evaluation.from_m=115", "evaluation.to_m=118"]
    if case == "re330_stitched":
        ran[0:2] = ["train.end_m=146", "train.start_m=131"]
        ran[2:] = ["evaluation.from_m=135", "evaluation.to_m=137"]
    scene = load_scene(case, [*changes, *ran, "train.raise_time_s=0"])
    free = scene_of(as_free(scene))
    assert scene_of(resolved(free)) == free
    found = []
    for one in (scene, free):
        problem, mesh = problem_of(one), mesh_of(one)
        rest = line_at_rest(problem, mesh)
        ran_through = march(problem, mesh, lambda view: view.contact_force.copy())
        found.append((rest, np.array(ran_through.watched)))
    (rest, force), (free_rest, free_force) = found
    for what, one, other in (
        ("height [m]", rest.form.height, free_rest.form.height),
        ("dropper force [N]", rest.form.dropper_force, free_rest.form.dropper_force),
        ("elasticity [m/N]", rest.lift.lift, free_rest.lift.lift),
        ("contact force [N]", force, free_force),
    ):
        apart = np.abs(one - other).max() / np.abs(one).max()
        print(f"{case}: {what} differs by {apart:.1e}")
        assert apart < 1e-9, what


def test_the_example_is_what_its_tables_say() -> None:
    line = line_of(scene_of(example()))
    names = [wire.name for wire in line.wires]
    assert names[0] == "contact_wire" and set(names[1:]) == {
        "auxiliary_wire", "stitch_wire", "low_messenger", "high_messenger"
    }  # fmt: skip
    stitch, low = line.wire("stitch_wire"), line.wire("low_messenger")
    assert [piece.x[0] for piece in stitch.pieces] == [60.0 * i for i in range(1, 10)]
    assert stitch.pieces[0].ends == (End.HELD, End.CLAMPED)
    assert stitch.pieces[0].tensioned == (False, False)
    # Between support and clamp the stitch wire has its tension from the messenger wire.
    np.testing.assert_array_equal(
        low.tension_at(np.array([59.0, 66.0, 71.9, 72.1, 330.0])),
        [16000.0, 13500.0, 13500.0, 16000.0, 14000.0],
    )
    assert line.wire("auxiliary_wire").pieces[0].ends == (End.CLAMPED, End.CLAMPED)
    groups = {group.name: group for group in line.clamps}
    assert groups["stitch_wire_clamps"].upper == "low_messenger"
    assert len(groups["stitch_wire_clamps"].x) == 9 and len(groups["auxiliary_wire_clamps"].x) == 2


def test_the_example_hangs_in_balance_at_the_heights_wanted() -> None:
    """All that hangs is carried by supports and ends; droppers hold their wires as wanted."""
    scene = scene_of(example())
    problem, mesh = problem_of(scene), mesh_of(scene)
    rest = line_at_rest(problem, mesh)
    model, form = rest.model, rest.form
    line = problem.line
    for number, group in enumerate(line.droppers):
        nodes = mesh.droppers[mesh.dropper_group == number, 1]
        wanted = line.wire(group.lower).points(mesh.x(nodes))[:, 2]
        np.testing.assert_allclose(form.height[nodes], wanted, atol=1e-9)
    assert (form.dropper_force > 0.0).all()
    every = np.arange(mesh.n_nodes)
    weight = -float(model.weight[model.dofs(every)].sum())
    carried = 0.0
    for number, group in enumerate(line.supports):
        nodes = mesh.supports[mesh.support_group == number]
        relaxed = line.wire(group.wire).points(np.array(group.x))[:, 2]
        carried += float((group.stiffness * (relaxed - form.height[nodes])).sum())
    ends = 0.0
    for wire in line.wires:
        for piece, nodes in zip(wire.pieces, mesh.pieces(wire.name), strict=True):
            for end, kind in zip((0, -1), piece.ends, strict=True):
                if kind is End.HELD:
                    inward = nodes[1] if end == 0 else nodes[-2]
                    slope = (form.height[inward] - form.height[nodes[end]]) / abs(
                        mesh.x(inward) - mesh.x(nodes[end])
                    )
                    x = mesh.x(nodes[end]) + (1e-6 if end == 0 else -1e-6)
                    ends -= float(wire.tension_at(x)) * float(slope)
    print(f"weight {weight:.1f} N, supports {carried:.1f} N, ends {ends:.1f} N")
    # The slope of the first element stands for that at the end: within its own weight and bending.
    assert abs(weight - carried - ends) < 0.02 * weight


def test_heights_by_support_make_a_gradient() -> None:
    scene = load_scene("en50318_2002", ["line.n_spans=8", "evaluation.from_m=200",
                                        "evaluation.to_m=260", "train.start_m=60"])  # fmt: skip
    raw = as_free(scene)
    heights = np.linspace(5.08, 5.32, 9)
    raw["line"]["wires"][0]["height_m"] = heights.tolist()
    raw["line"]["wires"][1]["height_m"] = (heights + 1.2).tolist()
    sloped = scene_of(raw)
    level, up = (line_at_rest(problem_of(one), mesh_of(one)) for one in (scene, sloped))
    mesh = mesh_of(sloped)
    above = np.interp(mesh.points[:, 0], np.linspace(0.0, 480.0, 9), heights) - 5.08
    # A straight gradient adds itself to the shape of the level line.
    np.testing.assert_allclose(up.form.height - above, level.form.height, atol=1e-9)


def test_a_course_by_points_and_links_by_place() -> None:
    """A single wire whose points are given, on supports at places of its own, with a wire beside it
    that a clamp joins."""
    raw = example()
    raw["line"] |= {
        "wires": [
            {"name": "wire", "role": "contact", "tension_N": 1e4, "mass_kg_per_m": 1.0,
             "bending_stiffness_N_m2": 100.0, "course_m": [[0, 0.2, 5.5], [300, -0.1, 5.6],
                                                          [600, 0.2, 5.5]]},
            {"name": "feeder", "role": "auxiliary", "tension_N": 5e3, "mass_kg_per_m": 0.5,
             "bending_stiffness_N_m2": 10.0, "height_m": 5.6, "stagger_m": 0.0,
             "sideways_m": 0.4, "end": "tensioner"},
        ],
        "links": [
            {"type": "supports", "name": "poles", "wire": "wire", "holds": "wire",
             "at_m": [60.0 * i + 1.0 for i in range(1, 10)]},
            {"type": "supports", "name": "brackets", "wire": "feeder"},
            {"type": "clamps", "name": "jumpers", "upper": "feeder", "lower": "wire",
             "at_m": [90.0, 510.0], "stiffness_N_per_m": 1e3},
        ],
    }  # fmt: skip
    scene = scene_of(raw)
    line = line_of(scene)
    wire, feeder = line.wires
    np.testing.assert_allclose(wire.points(np.array([150.0]))[0], [150.0, 0.05, 5.55])
    assert feeder.pieces[0].tensioned == (None, True)
    assert feeder.pieces[0].y == pytest.approx((0.4,) * len(feeder.pieces[0].y))
    rest, mesh = line_at_rest(problem_of(scene), mesh_of(scene)), mesh_of(scene)
    for x in line.supports[0].x:
        node = mesh.wires["wire"][np.argmin(np.abs(mesh.x(mesh.wires["wire"]) - x))]
        assert rest.form.height[node] == pytest.approx(5.5 + 0.1 * (1 - abs(x - 300) / 300))
    assert line.wires_of(Role.CONTACT) == (wire,)


def put(raw: Raw, where: str, value: Any) -> None:
    """Set a dotted key of a scene; None takes it away."""
    *parts, last = where.split(".")
    here: Any = raw
    for part in parts:
        here = here[int(part)] if part.isdigit() else here.setdefault(part, {})
    if value is None:
        del here[last]
    else:
        here[int(last) if last.isdigit() else last] = value


L, W = "line.links", "line.wires"
FREE_REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "no wires": ({W: None}, r"line.wires \(wires of a free line\) is missing"),
    "no links": ({L: None}, r"line.links \(what joins .*\) is missing"),
    "tables of another topology": (
        {"line.encumbrance_m": 1.2}, "line.encumbrance_m .* is no part of the topology free"),
    "supports as a table": (
        {"line.support": {"stiffness_N_per_m": 1e5}},
        "line.support .* is no part of the topology free; .* a link of type supports"),
    "an overlap": ({"line.overlap": {"first_span": 3, "rise_m": 0.5}},
                   "line.overlap .* no part of the topology free.* stretches_m"),
    "free tables of a simple line": ({"line.topology": "simple"}, "is no part of|is missing"),
    "no contact wire": ({f"{W}.0.role": "messenger", f"{W}.0.height_m": 5.3},
                        "line.wires .* has no wire of the role contact"),
    "role": ({f"{W}.0.role": "feeder"}, "must be contact, messenger, auxiliary or stitch"),
    "a name with a space": ({f"{W}.1.name": "aux wire"}, "must be a name of letters, digits and _"),
    "a name that is taken": ({f"{W}.1.name": "anchors"}, "this name means something else"),
    "a name twice": ({f"{W}.1.name": "contact_wire"}, "line.wires.0 has this name too"),
    "a link named like a wire": ({f"{L}.0.name": "contact_wire"}, "has this name too"),
    "unknown wire": ({f"{L}.0.upper": "low_mesenger"}, "did you mean low_messenger"),
    "unknown end": ({f"{W}.2.end": "low_mesenger"}, "did you mean low_messenger"),
    "a link to itself": ({f"{L}.0.upper": "contact_wire"}, "joins two wires, and lower is this"),
    "clamped to itself": ({f"{W}.2.end": "stitch_wire"}, "cannot be clamped to itself"),
    "clamped in a circle": (
        {f"{W}.3.start": "auxiliary_wire"}, "wires clamped to each other: .* joined in a circle"),
    "hanging in a circle": (
        {f"{L}.3.upper": "auxiliary_wire", f"{L}.3.lower": "low_messenger",
         f"{L}.4.upper": "low_messenger", f"{L}.4.lower": "auxiliary_wire", f"{L}.4.at_m": [330.0]},
        "wires hanging from each other"),
    "clamped to two wires": ({f"{W}.1.end": "high_messenger"}, "both ends must be clamped to one"),
    "clamped where no wire is": ({f"{W}.2.end": "auxiliary_wire"}, "auxiliary_wire does not pass"),
    "a dropper where no wire is": ({f"{L}.2.spans": [5]}, "auxiliary_wire does not pass 264 m"),
    "a span that is not": ({f"{L}.2.spans": [11]}, "spans is 11 .* the line has the spans 1 to 10"),
    "a support that is not": ({f"{W}.2.supports": [4, 11]}, "the line has the supports 0 to 10"),
    "supports without a measure": ({f"{W}.1.supports": [3]}, "takes supports with from_supports_m"),
    "a piece beyond the line": (
        {f"{W}.1.stretches_m": [[590.0, 610.0]]}, "from 590 to 610 m, and the line from 0 to 600"),
    "pieces that overlap": ({f"{W}.2.from_supports_m": [-40.0, 25.0]}, "pieces would overlap"),
    "pieces in disorder": ({f"{W}.1.stretches_m": [[355.0, 314.0]]}, "in ascending order"),
    "two ways to say where": ({f"{W}.1.from_supports_m": [1.0, 2.0]}, "both are given"),
    "course and height": (
        {f"{W}.3.course_m": [[0.0, 0.0, 6.6], [600.0, 0.0, 6.6]]}, "course_m or height_m"),
    "a point of two numbers": ({f"{W}.3.course_m": [[0.0, 6.6], [600.0, 6.6]]}, "at least 3"),
    "heights of some supports": ({f"{W}.3.height_m": [6.6, 6.6]}, "one for each support .11., but"),
    "no height": ({f"{W}.4.height_m": None}, "high_messenger. is missing .* how high its ends"),
    "no height of what hangs": (
        {f"{W}.1.height_m": None}, "auxiliary_wire. is missing .* droppers hang this wire"),
    "hangs on nothing": (
        {f"{L}.8": {"type": "supports", "name": "s", "wire": "high_messenger", "supports": [1, 2]}},
        "hangs on nothing from 120 to 600 m, and the longest span is 60 m"),
    "wires that cross": ({f"{W}.4.height_m": 6.5}, "expected 0.* m below low_messenger"),
    "all tension taken": ({f"{W}.1.tension_N": 16000.0},
                          "must be more than the 16000 N that auxiliary_wire take of it at 314"),
    "two droppers at one place": ({f"{L}.4.at_m": [6.0, 324.0]}, "has a dropper of contact_wire"),
    "places nearly one": ({f"{L}.4.at_m": [6.0, 316.0, 324.0005]}, "places must be one, or 0.001"),
    "both ways to place arms": ({f"{L}.6.supports": [1], f"{L}.6.at_m": [60.0]}, "both are given"),
    "places and spans": ({f"{L}.4.spans": [1]}, "takes spans with places in a span"),
    "pre-sag of another number": ({f"{L}.4.pre_sag_mm": [1.0]}, "1 values for 2 droppers"),
    "droppers outside": ({f"{L}.0.positions_m": [16.0, 61.0]}, "puts a dropper at 61 m"),
    "droppers at will when slack": (
        {f"{L}.1.slack_damping": "kept"}, "must be the released of line.links.0"),
    "a link of no kind": ({f"{L}.0.type": "springs"}, "must be of type droppers, clamps, supports"),
    "kilonewtons": ({f"{W}.0.tension_N": 20.0}, "is it 20 kN. write 20000"),
    "no such damping": (
        {"line.damping.per_component": {"droppr": {"alpha_s": 1.0, "beta_per_s": 0.0}}},
        "did you mean droppers"),
    "no axial stiffness": ({"effects.axial_motion": True}, "line.wires.0 .contact_wire. .* axial"),
    "too fast": ({"train.speed_km_h": 500.0}, "below the wave speed of the contact wire .489.9"),
}  # fmt: skip


@pytest.mark.parametrize("name", FREE_REFUSED)
def test_what_is_wrong_is_said_in_one_sentence(name: str) -> None:
    changes, expected = FREE_REFUSED[name]
    raw = copy.deepcopy(example())
    for where, value in changes.items():
        put(raw, where, value)
    with pytest.raises(SceneError) as refused:
        scene_of(raw)
    first = refused.value.faults[0].sentence
    print(first)
    assert re.search(expected, first), first
    assert "\n" not in first


def test_a_topology_without_its_contact_wire_is_refused() -> None:
    with pytest.raises(SceneError, match=r"line.contact_wire \(contact wire\) is missing"):
        load_scene("en50318_2002", ["line.contact_wire="])


def test_tension_that_is_lost_is_lost_by_what_is_clamped() -> None:
    line = make_line_of_example()
    after = line.with_shares({"stitch_wire": 0.5})
    at = np.array([66.0, 330.0])
    np.testing.assert_allclose(after.wire("low_messenger").tension_at(at), [14750.0, 14000.0])


def make_line_of_example() -> Any:
    from scenes import line_data_of

    return make_line(line_data_of(scene_of(example())))
