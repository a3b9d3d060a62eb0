"""Strips, roll, vehicle, laws and moving bodies in a scene: converted to SI, or refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scenes import Scene, load_scene, problem_of, recorded, resolved, scene_from, with_words

import catenary
from catenary import InputError, RunBroken
from catenary.cases.run.description import kind_lines
from catenary.cases.scene.checks.mesh_size import estimate_march
from catenary.cases.scene.checks.scene import MIN_SEPARATION
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.scene import end_of
from catenary.mbs.build import has_joints
from catenary.mbs.head.laws import Law, Regulation
from catenary.mbs.head.stepping import Stepping
from catenary.mbs.head.strips import Flexure, Strips, Suspension, Turning
from catenary.mbs.lumped import LumpedData
from catenary.mbs.mechanism.full_pantograph import FullPantograph
from catenary.mbs.mechanism.multibody_pantograph import AllBodies, MultibodyData, reduced
from catenary.mbs.mechanism.reduction import RaisingPantograph
from catenary.mbs.rigid.joints import Constant, PrescribedPoint
from catenary.mbs.vehicle import Harmonic, Irregularity, Spline, VehicleMotion
from catenary.solver.effects import all_effects as effects

# --- strips, roll and vehicle in a scene ----------------------------------------------------------


CASE = "ac_simple"
KIND = "pantographs.three_masses"
TWO = [f"{KIND}.strips.number=2", f"{KIND}.strips.spacing_m=0.56"]
LONG = f"{KIND}.strips.length_m=1.6"
ROLL = [f"{KIND}.roll={{inertia_kg_m2=2.0, spring_distance_m=0.6}}", "effects.head_roll=true"]
MOVES = "effects.vehicle_motion=true"
FRA = "vehicle.irregularity.spectrum=fra_6"
CAR = (
    "vehicle.suspension={body_mass_kg=32e3,pitch_inertia_kg_m2=1.97e6,stiffness_N_per_m=860e3,"
    "damping_N_s_per_m=40e3,bogie_distance_m=19.0,wheelbase_m=2.56,lateral={"
    "roll_inertia_kg_m2=56.8e3,stiffness_N_per_m=320e3,damping_N_s_per_m=64e3,"
    "spring_distance_m=2.0,centre_above_m=0.8,roof_above_m=1.8}}"
)


def load(*overrides: str) -> Scene:
    return load_scene(CASE, overrides)


def test_one_strip_fixed_to_the_head_is_the_default() -> None:
    (place,) = problem_of(load()).train.placements
    assert place.data.strips == Strips()
    assert place.data.strips.offsets == (0.0,)


def test_a_head_s_springs_become_those_of_its_roll_and_pitch() -> None:
    """Two halves of 7000 N/m and 45 N s/m at half their distance: k d^2 / 4."""
    pitch = [f"{KIND}.strips.pitch_inertia_kg_m2=0.4", f"{KIND}.strips.pitch_spring_distance_m=0.3"]
    own = [f"{KIND}.strips.mass_kg=1.2", f"{KIND}.strips.stiffness_N_per_m=9000"]
    more = [f"{KIND}.strips.damping_N_s_per_m=20", LONG]
    (place,) = problem_of(load(*TWO, *pitch, *own, *more, *ROLL)).train.placements
    strips = place.data.strips
    assert place.data.roll == Turning(2.0, 7000 * 0.3**2, 45 * 0.3**2)
    assert strips == Strips(
        2, 0.56, 1.6, Suspension(1.2, 9000, 20), Turning(0.4, 7000 * 0.15**2, 45 * 0.15**2)
    )
    assert place.data.strips.offsets == (0.28, -0.28)


def test_a_multibody_head_takes_strips_and_rolls_as_its_bodies_do() -> None:
    kind = "pantographs.seven_body"
    scene = load_scene(
        "ambrosio2012",
        [f"{kind}.strips.number=2", f"{kind}.strips.spacing_m=0.5", f"{kind}.strips.length_m=1.6",
         "effects.head_roll=true", "train.start_m=120"],
    )  # fmt: skip
    (place,) = problem_of(scene).train.placements
    assert isinstance(place.data, MultibodyData)
    assert place.data.strips == Strips(2, 0.5, 1.6)


def test_a_vehicle_is_the_sum_of_what_its_tables_give() -> None:
    vertical = [
        "vehicle.vertical.amplitude_m=0.01",
        "vehicle.vertical.frequency_hz=1.5",
        "vehicle.vertical.phase_deg=90",
        "vehicle.vertical.by_time=[[0, 0], [10, 0.01], [20, 0.02], [30, 0]]",
    ]
    lateral = ["vehicle.lateral.by_place=[[0, 0], [500, 0.05], [1000, 0], [2000, 0.01]]"]
    scene = load(*vertical, *lateral, FRA, "vehicle.irregularity.seed=5", MOVES, *ROLL, LONG)
    track = Irregularity("fra_6", 3.0, 100.0, 5)
    assert problem_of(scene).train.vehicle == VehicleMotion(
        (
            Spline((0, 10, 20, 30), (0, 0.01, 0.02, 0)),
            Harmonic(0.01, 1.5, math.pi / 2),
            track,
        ),
        (Spline((0, 500, 1000, 2000), (0, 0.05, 0, 0.01), along_track=True), track),
    )


def test_a_vehicle_sways_below_strips_that_bend() -> None:
    bends = f"{KIND}.strips.flexure={{bending_stiffness_N_m2=500, spring_distance_m=0.8}}"
    own = [f"{KIND}.strips.mass_kg=1.2", f"{KIND}.strips.stiffness_N_per_m=9000"]
    sine = ["vehicle.lateral.amplitude_m=0.05", "vehicle.lateral.frequency_hz=1.7"]
    problem = problem_of(load(bends, *own, LONG, *sine, CAR, FRA, MOVES))
    vehicle = problem.train.vehicle
    assert vehicle is not None and vehicle.suspension is not None
    assert Harmonic(0.05, 1.7, 0.0) in vehicle.lateral
    assert vehicle.suspension.sideways is not None


def test_files_are_taken_in_and_the_resolved_scene_needs_them_no_more(tmp_path: Path) -> None:
    pairs = [[0.0, 0.0], [700.0, 0.01], [1400.0, 0.02], [2000.0, 0.0]]
    file = tmp_path / "track.csv"
    text = "place [m], height [m]\n# surveyed\n" + "\n".join(f"{x}, {z}" for x, z in pairs)
    file.write_text(text + "\n\n")
    scene = load(f"vehicle.vertical.by_place_file={file}", MOVES)
    assert scene.vehicle is not None and scene.vehicle.vertical is not None
    assert scene.vehicle.vertical.by_place == pairs
    file.unlink()
    again = recorded(scene)
    assert problem_of(again) == problem_of(scene)


def test_a_case_s_files_are_beside_it(tmp_path: Path) -> None:
    from scenes import find_case

    (tmp_path / "sway.csv").write_text("0,0\n10,0.01\n20,0\n30,0.01\n")
    case = find_case(CASE).read_text()
    (tmp_path / "case.toml").write_text(case + '\n[vehicle.vertical]\nby_time_file = "sway.csv"\n')
    scene = load_scene(tmp_path / "case.toml", [MOVES])
    assert scene.vehicle is not None and scene.vehicle.vertical is not None
    assert scene.vehicle.vertical.by_time == [[0, 0], [10, 0.01], [20, 0], [30, 0.01]]


def test_a_run_ends_before_the_foremost_strip_leaves_the_line() -> None:
    to_the_end = ["evaluation.to_m=1600"]
    assert end_of(load(*to_the_end)) == pytest.approx(1650.0)
    assert end_of(load(*to_the_end, *TWO)) == pytest.approx(1650.0 - 0.28)


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        ([f"{KIND}.strips.number=2"], "needs spacing_m for number = 2"),
        ([f"{KIND}.strips.spacing_m=0.5"], "must not have spacing_m with number = 1"),
        ([f"{KIND}.strips.mass_kg=1"], "mass_kg and stiffness_N_per_m together"),
        ([f"{KIND}.strips.damping_N_s_per_m=1"], "must not have damping_N_s_per_m without"),
        (
            [*TWO, f"{KIND}.strips.mass_kg=4", f"{KIND}.strips.stiffness_N_per_m=9000"],
            "masses_kg gives it 7.5 kg and strips.mass_kg gives them 8 kg",
        ),
        (
            [*TWO, f"{KIND}.strips.pitch_inertia_kg_m2=1"],
            "pitch_inertia_kg_m2 and pitch_spring_distance_m together",
        ),
        (
            [f"{KIND}.strips.length_m=0.39"],
            "strips.length_m is 0.39 m on the command line (--set); at 110 m the wire is 0.2 m "
            "beside the strips' middle (line.stagger_m), so that they must be at least 0.4 m long",
        ),
        ([ROLL[1]], "it acts only with a head that can roll (pantographs.*.roll)"),
        (ROLL, f"it needs {KIND}.strips.length_m"),
        ([MOVES], "it acts only with a table [vehicle]; give that, or leave the effect out"),
        ([FRA, "vehicle.irregularity.shortest_m=200", MOVES], "must have waves"),
        ([FRA, "numerics.dt_s=6e-3", MOVES], "a wave must take 8 of these"),
        (["vehicle.vertical.amplitude_m=0.1", MOVES], "amplitude_m and frequency_hz together"),
        (["vehicle.vertical.phase_deg=10", MOVES], "must not have phase_deg without amplitude_m"),
        (["vehicle.vertical={}", MOVES], "needs by_time, by_place"),
        (["vehicle={}", MOVES], "needs vertical, lateral or irregularity"),
        (
            ["vehicle.vertical.by_time=[[0, 0], [1, 0], [2, 0], [3, 0]]", MOVES],
            "holds from 0 to 3 s, but the run needs it from 0 to 13.68 s",
        ),
        (
            ["vehicle.vertical.by_place=[[200, 0], [300, 0], [400, 0], [2000, 0]]", MOVES],
            "holds from 200 to 2000 m, but the run needs it from 110 to",
        ),
        (
            ["vehicle.vertical.by_place=[[0, 0], [300, 20], [400, 0], [2000, 0]]", MOVES],
            "must stay within 1 m, but is 20 m at 300",
        ),
        (
            ["vehicle.lateral.amplitude_m=0.1", "vehicle.lateral.frequency_hz=1", MOVES],
            "acts only with effects.head_roll = true",
        ),
        ([CAR, FRA, MOVES], "acts only with effects.head_roll = true"),
        ([CAR.replace("19.0", "2.0"), FRA, MOVES, *ROLL, LONG], "must have bogies apart"),
        (
            [*ROLL, f"{KIND}.strips.length_m=0.45", "vehicle.irregularity.spectrum=fra_4", MOVES],
            "beside the strips' middle (line.stagger_m and vehicle)",
        ),
        (
            [*TWO, "train.pantographs.0.behind_m=0.0", "train.start_m=0.1"],
            "must lie inside the line: the running range is 0.28 to 1649.72 m, strips included",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(overrides: list[str], sentence: str) -> None:
    with pytest.raises(InputError) as refused:
        load(*overrides)
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)


def test_strips_of_neighbours_must_not_overlap() -> None:
    """A metre between heads, and half a spacing of either."""
    two = resolved(load_scene(CASE))
    two["pantographs"]["three_masses"]["strips"] = {"number": 2, "spacing_m": 0.56}
    two["train"]["pantographs"].append({"name": "three_masses", "behind_m": 1.5})
    with pytest.raises(InputError, match="at least 1.56 m more than the 0 m .* strips") as refused:
        scene_from(two, Origin("here", recorded=True))
    assert "train.pantographs.1.behind_m is 1.5 m" in str(refused.value)
    two["train"]["pantographs"][1]["behind_m"] = MIN_SEPARATION + 0.56
    assert len(problem_of(scene_from(two, Origin("here", recorded=True))).train.placements) == 2


def test_a_multibody_head_s_pitch_is_its_bodies_business() -> None:
    kind = "pantographs.seven_body.strips"
    with pytest.raises(InputError, match="pitch of its head follows from bodies"):
        load_scene(
            "ambrosio2012",
            [f"{kind}.number=2", f"{kind}.spacing_m=0.5", f"{kind}.pitch_inertia_kg_m2=1",
             f"{kind}.pitch_spring_distance_m=0.2"],
        )  # fmt: skip
    with pytest.raises(InputError, match=r"part of the head, which weighs 7\.8 kg"):
        load_scene(
            "ambrosio2012",
            [f"{kind}.mass_kg=9", f"{kind}.stiffness_N_per_m=9000"],
        )


def test_a_sway_that_the_strip_covers_is_fine() -> None:
    """0.2 m of stagger and 0.05 m of sway, whose sum of 0.25 m is nearly reached."""
    sway = ["vehicle.lateral.amplitude_m=0.05", "vehicle.lateral.frequency_hz=1.7", MOVES, *ROLL]
    assert problem_of(load(*sway, f"{KIND}.strips.length_m=0.5"))
    with pytest.raises(InputError) as refused:
        load(*sway, f"{KIND}.strips.length_m=0.45")
    needed = float(str(refused.value).split("at least ")[1].split(" m")[0])
    assert 0.45 < needed <= 0.5
    assert np.isclose(needed, 0.5, atol=0.03)


BENDS = [
    *TWO,
    LONG,
    f"{KIND}.strips.mass_kg=1.0",
    f"{KIND}.strips.stiffness_N_per_m=8000",
    f"{KIND}.strips.flexure.bending_stiffness_N_m2=600",
    f"{KIND}.strips.flexure.spring_distance_m=0.9",
]


def test_strips_that_bend_are_beams() -> None:
    (place,) = problem_of(load(*BENDS)).train.placements
    assert place.data.strips.flexure == Flexure(600.0, 0.9, 3, 0.01)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([f"{KIND}.strips.length_m="], "needs length_m, mass_kg and stiffness_N_per_m"),
        ([f"{KIND}.strips.flexure.spring_distance_m=1.7"], "springs below its strips"),
        ([f"{KIND}.strips.flexure.modes=7"], "modes is 7"),
        ([f"{KIND}.strips.flexure.bending_stiffness_N_m2=0"], "greater than 0"),
    ],
)
def test_strips_that_cannot_bend_so_are_refused(words: list[str], said: str) -> None:
    with pytest.raises(InputError) as refused:
        load(*BENDS, *words)
    assert said in str(refused.value)


# --- laws and regulated lifts in a scene ----------------------------------------------------------


REFERENCE_CASE, REF = "en50318_2002", "pantographs.reference"
PI = "measures='contact_force',target=125,gains=[{at=0,error=0.1,integral_per_s=1.0}]"
LAWS = {
    "{type='limiter',rise_m=0.1,stiffness_N_per_m=2e4}": Law(
        1, 2, False, (-1.0, 0.1, 1.1), (0.0, 0.0, 2e4), of_roof=True
    ),
    "{type='limiter',at_mass=1,force_by_rise=[[0.0,0.0],[0.1,50.0]]}": Law(
        0, 2, False, (-1.0, 0.0, 0.1), (0.0, 0.0, 50.0), of_roof=True
    ),
    "{type='damper',up_N_s_per_m=200,down_N_s_per_m=30}": Law(
        1, 2, True, (-1.0, 0.0, 1.0), (-30.0, 0.0, 200.0)
    ),
    "{type='damper',at_mass=1,force_by_velocity=[[-1.0,-5.0],[0.0,0.0],[2.0,9.0]]}": Law(
        0, 1, True, (-1.0, 0.0, 2.0), (-5.0, 0.0, 9.0)
    ),
    "{type='spring',at_mass=1,force_by_extension=[[-0.05,-400.0],[0.0,0.0]]}": Law(
        0, 1, False, (-0.05, 0.0), (-400.0, 0.0)
    ),
    "{type='friction',force_N=3}": Law(
        1, 2, True, (-2e-3, -1e-3, 1e-3, 2e-3), (-3.0, -3.0, 3.0, 3.0)
    ),
}


def with_laws(*overrides: str) -> Scene:
    return load_scene(REFERENCE_CASE, overrides)


@pytest.mark.parametrize("text", LAWS)
def test_a_law_is_a_table_of_force(text: str) -> None:
    (place,) = problem_of(with_laws(f"{REF}.laws=[{text}]")).train.placements
    assert place.data.laws == (LAWS[text],)


def test_a_mechanism_has_head_and_arm() -> None:
    words = "pantographs.seven_body.laws=[{type='damper',up_N_s_per_m=9,down_N_s_per_m=1}]"
    (place,) = problem_of(load_scene("ambrosio2012", [words])).train.placements
    assert place.data.laws == (Law(1, 2, True, (-1.0, 0.0, 1.0), (-1.0, 0.0, 9.0)),)


def test_a_regulation_is_data() -> None:
    scene = with_laws(f"{REF}.regulation={{{PI},filter_s=0.2,delay_s=0.02,from_s=0.5,most_N=30}}")
    (place,) = problem_of(scene).train.placements
    assert place.regulator == Regulation(
        False, 125.0, ((0.0, 0.1, 1.0, 0.0),), -50.0, 30.0, 0.01, 0.2, 0.02, 0.5
    )


def test_the_resolved_scene_is_the_same_again_and_names_what_acts() -> None:
    scene = with_laws(f"{REF}.laws=[{','.join(LAWS)}]", f"{REF}.regulation={{{PI}}}")
    again = recorded(scene)
    assert problem_of(again) == problem_of(scene)
    active = {effect.name for effect in effects.active(problem_of(scene))}
    assert {"pantograph_laws", "regulated_lift"} <= active
    (told,) = kind_lines(scene, problem_of(scene))["reference"]
    assert told.endswith("; 6 laws not linear; regulated lift")


def test_what_is_switched_off_is_left_out() -> None:
    off = ["effects.pantograph_laws=false", "effects.regulated_lift=false"]
    laws = f"{REF}.laws=[{','.join(LAWS)}]"
    simulated = effects.simulated(problem_of(with_laws(laws, f"{REF}.regulation={{{PI}}}", *off)))
    assert not simulated.pantograph_laws and not simulated.regulated_lift


REFUSED = {
    f"{REF}.laws=[{{type='brake'}}]": "must be of type limiter, damper, spring or friction",
    f"{REF}.laws=[{{type='limiter',rise_m=0.1}}]": "needs exactly one of stiffness_N_per_m",
    f"{REF}.laws=[{{type='limiter',stiffness_N_per_m=1e4}}]": "needs rise_m and stiffness_N_per_m",
    f"{REF}.laws=[{{type='friction',force_N=3,at_mass=3}}]": "the pantograph has 2 masses",
    f"{REF}.laws=[{{type='damper',up_N_s_per_m=3}}]": "needs up_N_s_per_m and down_N_s_per_m",
    f"{REF}.laws=[{{type='damper',force_by_velocity=[[-1,5],[1,9]]}}]": "must brake, but has 5 N",
    f"{REF}.laws=[{{type='spring',force_by_extension=[[0,9],[1,5]]}}]": "must not fall",
    f"{REF}.laws=[{{type='spring',force_by_extension=[[0,0],[1e-9,5]]}}]": "must not rise by more",
    f"{REF}.laws=[{{type='limiter',force_by_rise=[[0.1,3],[1,9]]}}]": "must begin with a force",
    f"{REF}.regulation={{measures='force',target=1,gains=[]}}": "be contact_force or",
    f"{REF}.regulation={{measures='contact_force',target=1,gains=[{{at=0}}]}}": "a gain above 0",
    f"{REF}.regulation={{{PI},delay_s=0.015}}": "a delay of whole samples",
    f"{REF}.regulation={{{PI},sample_s=1e-4}}": "a sample takes at least a step",
    f"{REF}.regulation={{{PI},least_N=0,most_N=0}}": "room between least_N and most_N",
    f"{REF}.regulation={{{PI},controller='os.system'}}": "regulation.controller",
}


@pytest.mark.parametrize("word", REFUSED)
def test_what_cannot_be_is_one_sentence(word: str) -> None:
    with pytest.raises(InputError) as refused:
        with_laws(word)
    assert REFUSED[word] in str(refused.value)


def test_a_mechanism_with_all_its_bodies_has_none() -> None:
    laws = "pantographs.seven_body.laws=[{type='friction',force_N=3}]"
    with pytest.raises(InputError) as refused:
        load_scene("ambrosio2012", [laws, "pantographs.seven_body.motion=all_bodies"])
    assert "reduced to tables only" in str(refused.value)


# --- which bodies of a mechanism are moved in the time loop ---------------------------------------


BODIES_CASE, BODIES_KIND = "ambrosio2012", "pantographs.seven_body"
ALL = f"{BODIES_KIND}.motion=all_bodies"
OWN_KEYS = {"constraint_handling", "substeps"}


def with_bodies(*overrides: str) -> Scene:
    return load_scene(BODIES_CASE, overrides)


def data(scene: Scene) -> MultibodyData:
    found = problem_of(scene).train.placements[0].data
    assert isinstance(found, MultibodyData)
    return found


def test_a_mechanism_is_reduced_unless_the_scene_says_otherwise() -> None:
    assert data(with_bodies()).all_bodies is None
    assert not has_joints(data(with_bodies()))
    assert not has_joints(LumpedData((1.0,), (0.0,), (0.0,)))


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        ([], AllBodies("coordinate_partitioning", 1)),
        ([f"{BODIES_KIND}.constraint_handling=baumgarte"], AllBodies("baumgarte", 1)),
        (
            [
                f"{BODIES_KIND}.constraint_handling=augmented_lagrangian",
                f"{BODIES_KIND}.substeps=4",
            ],
            AllBodies("augmented_lagrangian", 4),
        ),
    ],
)
def test_all_bodies_reach_the_time_loop(overrides: list[str], expected: AllBodies) -> None:
    found = data(with_bodies(ALL, *overrides))
    assert found.all_bodies == expected
    assert has_joints(found)


def test_the_model_is_the_one_that_was_asked_for() -> None:
    from catenary.mbs.build import Operation, make_pantograph

    operation = Operation(150.0, 5.08, Stepping(0.5, 1e-3))
    assert isinstance(make_pantograph(data(with_bodies(ALL)), operation), FullPantograph)
    assert isinstance(make_pantograph(data(with_bodies()), operation), RaisingPantograph)


@pytest.mark.parametrize("overrides", [[], [ALL], [ALL, f"{BODIES_KIND}.substeps=3"]])
def test_resolved_scene_is_the_same_again_and_holds_only_what_acts(overrides: list[str]) -> None:
    scene = with_bodies(*overrides)
    table = resolved(scene)["pantographs"]["seven_body"]
    assert OWN_KEYS & set(table) == (OWN_KEYS if overrides else set())
    again = recorded(scene)
    assert problem_of(again) == problem_of(scene)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (
            [f"{BODIES_KIND}.substeps=2"],
            "substeps with motion = reduced, because it acts only with",
        ),
        (
            [f"{BODIES_KIND}.motion=reduced", f"{BODIES_KIND}.constraint_handling=baumgarte"],
            "must not have",
        ),
        ([ALL, f"{BODIES_KIND}.substeps=0"], f"{BODIES_KIND}.substeps is 0"),
        ([ALL, f"{BODIES_KIND}.substeps=1.5"], "must be a whole number"),
        ([ALL, f"{BODIES_KIND}.constraint_handling=lagrange"], "coordinate_partitioning"),
        ([f"{BODIES_KIND}.motion=full"], "must be reduced or all_bodies"),
        (
            [
                ALL,
                f"{BODIES_KIND}.strips.mass_kg=1",
                f"{BODIES_KIND}.strips.stiffness_N_per_m=5000",
            ],
            "strips on springs of their own are no bodies",
        ),
        (["pantographs.lumped.motion=all_bodies"], "pantographs.lumped.motion on the command line"),
        ([f"{BODIES_KIND}.nominal_height_m=9"], "-3.973 m away from there, beyond the reach"),
        ([ALL, f"{BODIES_KIND}.nominal_height_m=9"], "-3.973 m away from there, beyond the reach"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_sentence(overrides: list[str], words: str) -> None:
    with pytest.raises(InputError) as refused:
        with_bodies(*overrides)
    assert words in str(refused.value) and "\n" not in str(refused.value)


def test_bodies_go_where_their_loops_still_close_and_tables_where_they_end() -> None:
    """0.65 m below its working height the arm is beyond its tables, but not beyond its joints."""
    below = f"{BODIES_KIND}.nominal_height_m=4.4"
    assert with_bodies(ALL, below).pantographs["seven_body"].nominal_height_m == 4.4
    with pytest.raises(InputError, match="beyond the reach of its mechanism"):
        with_bodies(below)
    lowest = reduced(data(with_bodies())).heights[0]
    bodies = data(with_bodies()).system
    arm = PrescribedPoint("arm low", "stabilisation_arm", Constant(lowest - 0.05))
    held = bodies.with_joints(arm)
    closed = held.assemble(bodies.start())
    assert np.abs(held.constraints(closed, 0.0).value).max() < 1e-9


def test_a_wire_beyond_the_bodies_reach_breaks_the_start_in_one_sentence() -> None:
    pantograph = FullPantograph(data(with_bodies(ALL)), 150.0, 5.08, Stepping(0.5, 1e-3))
    with pytest.raises(RunBroken, match="'seven_body' does not reach a wire at a height of 9 m"):
        pantograph.place(9.0)


def test_plan_names_the_model_and_counts_its_cost_and_channel() -> None:
    flushes = "output.flush_every_steps=100"
    reduced_plan = catenary.plan(with_words(BODIES_CASE, [flushes]))
    plan = catenary.plan(with_words(BODIES_CASE, [ALL, f"{BODIES_KIND}.substeps=2", flushes]))
    assert "reduced to tables over its height" in str(reduced_plan)
    told = "all bodies in the time loop in 2 substeps, joints kept by coordinate_partitioning"
    assert told in str(plan)
    n = plan.figures["n_steps"]
    more = plan.figures["wall_s"] - reduced_plan.figures["wall_s"]
    expected = estimate_march(0, n, "one_solve", 2) - estimate_march(0, n, "one_solve")
    assert more == pytest.approx(expected, rel=1e-9)
    # 0.2 to 0.4 ms a substep.
    assert 2 * 2e-4 * n < more < 2 * 4e-4 * n
    # A number a row, in chunks that are kept whole, each with its entry in an index.
    more = plan.figures["result_B"] - reduced_plan.figures["result_B"]
    assert 8 * (n + 1) < more < 1.2 * 8 * (n + 1)
