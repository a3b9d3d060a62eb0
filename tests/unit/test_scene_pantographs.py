"""Pantographs in scenes, ready ones, and the verb ``pantograph``."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
import verb_runner
from body_mechanics import generalised
from measuring import check
from paper_pantograph import corrections, data, number_at, table
from scenes import Scene, load_scene, problem_of, scene_from, shipped
from verb_runner import invoke

from catenary import InputError
from catenary.cases.run.description import header_words, kind_lines
from catenary.cases.scene.checks.pantographs import check_pantographs
from catenary.cases.scene.input.case_files import read_toml
from catenary.cases.scene.keys.keys import is_known, known_keys
from catenary.cases.scene.scene import static_force
from catenary.cases.scene.train.multibody import multibody_of
from catenary.cases.scene.train.pantograph import MultibodyTable, Ready
from catenary.cases.terminal.lists import key_table
from catenary.mbs.build import PantographData, actuator_force
from catenary.mbs.lumped import READY, LumpedData
from catenary.mbs.mechanism.multibody_pantograph import MultibodyData, stand
from catenary.mbs.response import chain_model
from catenary.mbs.rigid.bodies import SPACE, Body
from catenary.mbs.rigid.forces import Actuator, BumpStop, Gravity, PointForce, SpringDamper, Table
from catenary.mbs.rigid.joints import (
    Constant,
    Fixed,
    PointOnCurve,
    PointOnLine,
    PrescribedAngle,
    PrescribedPoint,
    Prismatic,
    Revolute,
    RevolutePrismatic,
    Spherical,
)

# --- pantographs in scenes ------------------------------------------------------------------------


TELESCOPE = Path(__file__).parents[1] / "support" / "telescope.toml"
A, B, ORIGIN = (0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.0, 0.0, 0.0)
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
ENDS = {"i": "mast", "j": "head", "at_i_m": list(A), "at_j_m": list(B)}

JOINTS: dict[str, tuple[dict[str, Any], Any]] = {
    "fixed": (ENDS | {"turn": [0.6, 0, 0]}, Fixed("x", "head", "mast", A, B, (0.8, 0.6, 0, 0))),
    "revolute": (ENDS | {"axis_j": list(X)}, Revolute("x", "mast", "head", A, B, Y, X)),
    "spherical": (ENDS, Spherical("x", "mast", "head", A, B)),
    "prismatic": (
        ENDS | {"axis_i": list(Y), "normal_j": list(Y)},
        Prismatic("x", "mast", "head", A, B, Y, Z, X, Y),
    ),
    "revolute_prismatic": (
        {"j": "head", "slide_axis_j": list(Y)},
        RevolutePrismatic("x", SPACE, "head", ORIGIN, ORIGIN, X, X, Y),
    ),
    "point_on_line": (ENDS | {"axis_i": list(Z)}, PointOnLine("x", "mast", "head", A, B, Z)),
    "point_on_curve": (
        {"body": "mast", "at_m": list(A), "curve_m": [[0, 1, 2], [1, 2, 5], [2, 2, 6]]},
        PointOnCurve("x", "mast", (0, 1, 2), (1, 2, 2), (2, 5, 6), A),
    ),
    "prescribed_point": (
        {"body": "mast", "at_m": list(A), "along": list(X), "coordinate_m": 0.7},
        PrescribedPoint("x", "mast", Constant(0.7), A, X),
    ),
    "prescribed_angle": (
        {"j": "mast", "axis_i": list(X), "normal_i": list(Y), "normal_j": list(Z), "angle_deg": 90},
        PrescribedAngle("x", SPACE, "mast", np.pi / 2, X, Y, Z),
    ),
}
FORCES: dict[str, tuple[str, dict[str, Any], Any]] = {
    "linear spring": (
        "spring_damper",
        ENDS | {"stiffness_N_per_m": 5.0, "free_length_m": 0.2, "damping_N_s_per_m": 3.0},
        SpringDamper("x", "mast", "head", A, B, 5.0, 0.2, 3.0),
    ),
    "spring from a table": (
        "spring_damper",
        ENDS | {"pull_by_extension": [[-1, -9], [0, 0], [1, 4]]},
        SpringDamper("x", "mast", "head", A, B, Table((-1, 0, 1), (-9, 0, 4))),
    ),
    "constant actuator": (
        "actuator",
        ENDS | {"force_N": 7},
        Actuator("x", "mast", "head", A, B, 7),
    ),
    "actuator from a table": (
        "actuator",
        ENDS | {"force_by_length": [[0.5, 100], [1, 80]]},
        SpringDamper("x", "mast", "head", A, B, Table((0.5, 1), (-100, -80))),
    ),
    "stop": (
        "bump_stop",
        ENDS | {"longest_m": 0.9, "stiffness_N_per_m": 1e4},
        BumpStop("x", "mast", "head", A, B, 0.0, 0.9, 1e4),
    ),
    "point force": (
        "point_force",
        {"body": "mast", "at_m": list(B), "force_N": [1, 2, 3]},
        PointForce("x", "mast", (1, 2, 3), B),
    ),
}


def telescope(**changes: Any) -> dict[str, Any]:
    """The raw table of the telescope; a change of None takes a key away."""
    raw = dict(read_toml(TELESCOPE)["pantographs"]["telescope"]) | changes
    return {key: value for key, value in raw.items() if value is not None}


def converted(raw: dict[str, Any], speed: float = 250.0) -> MultibodyData:
    return multibody_of("telescope", MultibodyTable.model_validate(raw), speed)


def of_the_train(scene: Scene) -> PantographData:
    return problem_of(scene).train.placements[0].data


@pytest.mark.parametrize("kind", JOINTS)
def test_each_joint_reaches_the_mechanism(kind: str) -> None:
    keys, expected = JOINTS[kind]
    found = converted(telescope(joints={"x": keys | {"type": kind}}))
    assert found.system.joints == (expected,)


@pytest.mark.parametrize("what", FORCES)
def test_each_force_reaches_the_mechanism(what: str) -> None:
    kind, keys, expected = FORCES[what]
    raw = telescope(forces={"x": keys | {"type": kind}}, actuator="x", gravity=False)
    assert converted(raw).system.forces == (expected,)


def test_bodies_and_their_weight_reach_the_mechanism() -> None:
    found = converted(telescope())
    assert found.system.bodies == (
        Body("mast", 15.0, (1, 1, 1), (0, 0, 1.0), ORIGIN),
        Body("head", 7.2, (1, 1, 1), (0, 0, 1.1), ORIGIN),
    )
    assert found.system.forces[0] == Gravity((15.0, 7.2), 9.81)
    assert not any(
        isinstance(f, Gravity) for f in converted(telescope(gravity=False)).system.forces
    )


def test_actuator_from_a_table_pushes_as_much_as_it_says() -> None:
    """0.75 m is half way between 100 N at 0.5 m and 80 N at 1 m."""
    jack = {"type": "actuator", "j": "mast", "force_by_length": [[0.5, 100.0], [1.0, 80.0]]}
    forces = telescope()["forces"] | {"jack": jack}
    system = converted(telescope(forces=forces, calibrate=False, static_force_N=None)).system
    start = system.start()
    low = start.moved(np.array([0, 0, -0.25, *[0.0] * 9]))
    push = generalised(system.force("jack"), low)
    check("push on the mast [N]", push[2], 90.0, within=1e-12)


def test_wind_grows_with_the_square_of_the_speed_and_is_kept_apart() -> None:
    wind = {"type": "aerodynamic_force", "body": "head", "coefficient_N_s2_per_m2": [0, 0, 0.01]}
    forces = telescope()["forces"] | {"lift": wind}
    slow, fast = (converted(telescope(forces=forces), speed) for speed in (180.0, 360.0))
    check("lift [N]", slow.wind[0].force, (0, 0, 25.0), within=1e-12)
    check("lift [N]", fast.wind[0].force, (0, 0, 100.0), within=1e-12)
    assert slow.system == fast.system == converted(telescope()).system


def test_without_calibration_the_static_force_is_that_of_the_mechanism() -> None:
    raw = telescope(calibrate=False, static_force_N=None)
    force = static_force("telescope", MultibodyTable.model_validate(raw), 250.0)
    check("static force [N]", force, 300.0 - 22.2 * 9.81, within=1e-6)


def test_paper_s_published_numbers_stand_beside_the_corrected_ones() -> None:
    published, corrected = data(as_published=True).system, data().system
    assert set(corrections()) == {
        "joints.joint_1.at_i_m.0",
        "forces.raising_spring.at_i_m.0",
        "forces.actuator.force_N",
    }
    for key, correction in corrections().items():
        assert correction.reason
        assert correction.published != number_at(key)
    changed = [a.name for a, b in zip(published.joints, corrected.joints, strict=True) if a != b]
    changed += [a.name for a, b in zip(published.forces, corrected.forces, strict=True) if a != b]
    assert changed == ["joint_1", "raising_spring", "actuator"]
    # Table 3 and Table 4 of the paper.
    joints = {joint.name: joint for joint in published.joints}
    assert joints["joint_1"].at_i == (0.020, 0.0, 0.132)
    assert published.force("raising_spring").at_i == (0.259, 0.0, 0.0)
    assert published.force("actuator").force == 920.0


def test_scene_of_the_paper_has_seven_bodies_and_its_equivalent() -> None:
    scene = load_scene("ambrosio2012")
    seven = of_the_train(scene)
    assert isinstance(seven, MultibodyData)
    assert len(seven.system.bodies) == 7
    lumped = of_the_train(load_scene("ambrosio2012", ["train.pantographs.0.name=lumped"]))
    assert isinstance(lumped, LumpedData)
    # The case's lumped equivalent is rounded to three figures.
    head = stand(seven).head
    check("head [kg]", lumped.masses[0], head.mass, within=0.005 * head.mass)
    check("head [N/m]", lumped.stiffnesses[0], head.stiffness, within=0.005 * head.stiffness)
    check("head [N s/m]", lumped.dampings[0], head.damping, within=0.005 * head.damping)


def test_what_is_told_of_a_pantograph() -> None:
    scene = load_scene("ambrosio2012")
    (told,) = header_words(scene, problem_of(scene))
    assert (told["kind"], told["model"]) == ("seven_body", "multibody")
    # 9.89 kN by virtual work, within 1 %.
    push = actuator_force(of_the_train(scene))
    assert push is not None
    check("actuator [N]", push, 9890.0, within=98.9)
    what, assembly = kind_lines(scene, problem_of(scene))["seven_body"]
    assert "7 bodies, 9 joints, 1 of 5 degrees of freedom is the raising" in what
    assert "joint_6 13.8 mm" in assembly
    plain = load_scene("en50318_2002")
    (told,) = header_words(plain, problem_of(plain))
    assert told["model"] == "lumped" and actuator_force(of_the_train(plain)) is None
    assert "2 masses of 7.2, 15 kg" in told["description"]


def test_kinds_that_are_not_on_the_train_are_not_assembled() -> None:
    """So that a case may hold a mechanism that cannot be built beside one that can."""
    scene = load_scene(
        "ambrosio2012",
        ["train.pantographs.0.name=lumped", "pantographs.seven_body.as_published=true"],
    )
    check_pantographs(scene)
    assert table().as_published is False


def test_keys_of_all_kinds_are_listed_and_known() -> None:
    listed = {line.split()[0] for line in key_table().splitlines()}
    known = known_keys(Scene)
    for key in (
        "pantographs.*.masses_kg",
        "pantographs.*.working_height_m",
        "pantographs.*.bodies.*.inertia_kg_m2",
        "pantographs.*.joints.*.slide_axis_j",
        "pantographs.*.joints.*.curve_m",
        "pantographs.*.forces.*.pull_by_extension",
        "pantographs.*.corrections.*.published",
    ):
        assert key in listed
        assert is_known(key.replace("*", "any"), known)
    # Below one kind only its keys are near.
    location = ("pantographs", "any", "lumped", "hed")
    assert not any(".bodies" in key for key in known_keys(Scene, location))
    kinds = next(row for row in key_table().splitlines() if row.startswith("pantographs.*.type"))
    assert kinds.endswith("one of lumped, multibody")


# --- ready pantographs ----------------------------------------------------------------------------


# Which case states the same pantograph.
IN_CASES = {
    "en50318_2002": ("en50318_2002", "reference"),
    "en50318_2018": ("ac_simple", "three_masses"),
    "ambrosio2012": ("ambrosio2012", "lumped"),
}


def with_model(*words: str) -> list[str]:
    return ["pantographs.ready.model=dsa380", "train.pantographs.0.name=ready", *words]


@pytest.mark.parametrize("name", IN_CASES)
def test_cases_state_the_same_numbers(name: str) -> None:
    case, kind = IN_CASES[name]
    scene = load_scene(case, [f"train.pantographs.0.name={kind}"])
    assert problem_of(scene).train.placements[0].data == READY[name].chain


def test_a_scene_takes_chain_and_force() -> None:
    """DSA380 at 300 km/h: 70 + 0.00095 300^2 + 0.0017 300 - 0.2 = 155.81 N."""
    place = problem_of(load_scene("ac_simple", with_model("train.speed_km_h=300"))).train.placements
    assert place[0].data == LumpedData((7.12, 6.0, 5.8), (9430.0, 14100.0, 0.1), (0.0, 0.0, 70.0))
    assert place[0].static_force == pytest.approx(155.81)


def test_the_air_only_lifts() -> None:
    """The law is negative below 13.6 km/h."""
    dsa = READY["dsa380"]
    assert dsa.force_at(5.0) == 70.0
    assert np.isclose(float(dsa.force_at(20.0) or 0.0), 70.0 + 0.00095 * 400.0 + 0.034 - 0.2)


def test_every_ready_pantograph_has_its_name_in_the_schema() -> None:
    assert get_args(Ready) == tuple(READY)


def test_own_force_wins() -> None:
    scene = load_scene("ac_simple", with_model("pantographs.ready.static_force_N=80"))
    assert problem_of(scene).train.placements[0].static_force == 80.0


def test_the_scene_of_a_result_is_the_same_again() -> None:
    scene = load_scene("ac_simple", with_model())
    recorded = replace(scene.origin, recorded=True)  # with every key, as results have them
    again = scene_from(scene.model_dump(mode="json", exclude_none=True), recorded)
    assert problem_of(again) == problem_of(scene)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["pantographs.ready.model=dsa38"], "it must be en50318_2002, en50318_2018, dsa380 or"),
        (["pantographs.ready.model=[1]"], "pantographs.ready.model is"),
        (["pantographs.ready.masses_kg=[7.0, 6.0, 5.8]"], 'masses_kg beside model = "dsa380"'),
        (["pantographs.ready.model=en50318_2018"], "exactly one of static_force_N"),
        (["pantographs.ready.type=multibody"], "does not belong to type multibody"),
    ],
)
def test_what_cannot_be_is_one_sentence(words: list[str], said: str) -> None:
    with pytest.raises(InputError) as refused:
        load_scene("ac_simple", with_model(*words))
    assert said in str(refused.value)


def test_the_list_names_all_with_their_sources() -> None:
    told = invoke("list", "--pantographs")
    assert told.exit_code == 0
    for name, ready in READY.items():
        assert name in told.output.splitlines()
        assert ready.source in told.output
    both = invoke("list", "--pantographs", "--keys")
    assert both.exit_code == 2


# --- the verb ``pantograph`` ----------------------------------------------------------------------


def pantograph_verb(*words: str) -> Any:
    return verb_runner.invoke("pantograph", *words)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Files and words for EN 50318's two masses, from 0.2 to 40 Hz."""
    folder = tmp_path_factory.mktemp("pantograph") / "of" / "en"
    words = ("en50318_2002", "-o", str(folder), "--from", "0.2", "--to", "40", "--points", "31")
    result = pantograph_verb(*words)
    assert result.exit_code == 0, result.output
    return folder, result.output


def test_receptance_is_that_of_the_masses(written: tuple[Path, str]) -> None:
    with (written[0] / "receptance.csv").open(encoding="utf-8", newline="") as stream:
        header, *rows = csv.reader(stream)
    assert header == [
        "frequency_hz",
        "receptance_real_m_per_N",
        "receptance_imag_m_per_N",
    ]
    frequency, real, imaginary = np.array(rows, dtype=float).T
    check("frequencies [Hz]", frequency, np.geomspace(0.2, 40.0, 31), within=1e-8)
    chain = chain_model(LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0)))
    expected = chain.receptance(frequency)
    found = real + 1j * imaginary
    # All digits are written: round-off at a resonance of quality 7.
    check("receptance [m/N]", np.abs(found / expected - 1.0), 0.0, within=1e-12)


def test_tables_name_what_was_asked_for(written: tuple[Path, str]) -> None:
    folder, text = written
    for words in ("reference of en50318_2002", "mass 1", "7.2", "4200", "4.658", "0.0679"):
        assert words in text
    picture = folder / "receptance.png"
    assert str(picture) in text and picture.read_bytes()[:4] == b"\x89PNG"


def test_fitted_model_runs_in_the_pantograph_s_place(
    written: tuple[Path, str], tmp_path: Path
) -> None:
    """Pasted behind its own case and named on the train it is the same pantograph."""
    fragment = (written[0] / "lumped.toml").read_text(encoding="utf-8")
    table = read_toml(written[0] / "lumped.toml")["pantographs"]["reference_lumped"]
    check("masses [kg]", table["masses_kg"], (7.2, 15.0), within=1e-4)
    scene = tmp_path / "case.toml"
    original = shipped()["en50318_2002"].read_text(encoding="utf-8")
    scene.write_text(f"{original}\n{fragment}", encoding="utf-8")
    changed = problem_of(load_scene(scene, ["train.pantographs.0.name=reference_lumped"]))
    (placement,) = changed.train.placements
    (before,) = problem_of(load_scene("en50318_2002")).train.placements
    assert placement.static_force == before.static_force == 120.0
    check("stiffnesses [N/m]", placement.data.stiffnesses, before.data.stiffnesses, within=0.1)
    again = pantograph_verb(str(scene), "--kind", "reference_lumped", "--fit", "1")
    assert again.exit_code == 0 and "reference_lumped of en50318_2002" in again.output


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--kind", "other"), "the case has no such pantograph; it has reference"),
        (("--from", "0"), "frequencies must grow from above 0"),
        (("--from", "30"), "frequencies must grow from above 0"),
        (("--points", "1"), "--points 1 must be between 2"),
        (("--fit", "4"), "1 to 3 masses, not of 4"),
        (("--fit-from", "50"), "--fit-from 50 must be above 0 Hz and below --to 25"),
    ],
)
def test_mistakes_end_in_a_sentence(words: tuple[str, ...], sentence: str) -> None:
    result = pantograph_verb("en50318_2002", *words)
    assert result.exit_code == 2 and sentence in result.output.replace("\n", " "), result.output


def test_files_are_not_overwritten_unless_told_to(written: tuple[Path, str]) -> None:
    folder = written[0]
    result = pantograph_verb("en50318_2002", "-o", str(folder))
    assert (
        result.exit_code == 2 and "receptance.csv is there already; name another" in result.output
    )
    result = pantograph_verb("en50318_2002", "-o", str(folder / "receptance.csv"))
    assert result.exit_code == 2 and "is a file; name a folder" in result.output
    before = (folder / "receptance.csv").read_bytes()
    assert pantograph_verb("en50318_2002", "-o", str(folder), "--force").exit_code == 0
    assert (folder / "receptance.csv").read_bytes() != before


def test_laws_that_are_left_out_are_named() -> None:
    law = "{type = 'damper', at_mass = 2, up_N_s_per_m = 500.0, down_N_s_per_m = 900.0}"
    words = ("en50318_2002", f"pantographs.reference.laws=[{law}]")
    sentence = "left out: the pantograph's laws, which are not linear"
    assert sentence in pantograph_verb(*words).output
    assert sentence not in pantograph_verb(*words, "effects.pantograph_laws=false").output
    assert sentence not in pantograph_verb("en50318_2002").output
