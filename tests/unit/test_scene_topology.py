"""`line.topology`: which tables it takes, which it refuses, and the lines that come of it."""

from __future__ import annotations

import re

import numpy as np
import pytest
from measuring import check
from scenes import line_of, load_scene, mesh_of, problem_of

from catenary.cases.run.at_rest import static_table
from catenary.cases.scene.input.faults import SceneError
from catenary.cases.terminal.terminal_text import static_text
from catenary.meshgen.wires import Role
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest

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
