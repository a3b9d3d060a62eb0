"""Scenes: loading, overriding, conversion to SI, and the resolved configuration."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scenes import (
    Scene,
    find_case,
    line_data_of,
    load_scene,
    problem_of,
    resolved,
    scene_from,
    shipped,
)

from catenary import InputError
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.keys.units import unit_of
from catenary.cases.scene.scene import end_of

# Keys that other programs rely on.
CONTRACT = [
    "train.speed_km_h",
    "train.start_m",
    "numerics.dt_s",
    "numerics.scheme",
    "mesh.elements_per_gap",
    "line.n_spans",
    "line.damping.alpha_s",
    "line.damping.beta_per_s",
    "contact.stiffness_N_per_m",
    "evaluation.from_m",
    "evaluation.to_m",
    "effects.gravity",
]


@pytest.mark.parametrize("case", ["ambrosio2012", "en50318_2002", "ac_simple"])
def test_the_promised_cases_are_shipped(case: str) -> None:
    assert case in shipped()


@pytest.mark.parametrize("case", list(shipped()))
@pytest.mark.parametrize("shortened", [False, True])
def test_every_shipped_case_loads(case: str, shortened: bool) -> None:
    scene = load_scene(case, shortened=shortened)
    problem = problem_of(scene)
    assert scene.case.name == case
    assert scene.case.title and scene.case.source
    assert problem.train.end > problem.evaluation[1]
    if shortened:
        assert problem.line.n_spans < load_scene(case).line.n_spans


@pytest.mark.parametrize("case", list(shipped()))
def test_the_resolved_configuration_loads_to_the_same_problem(case: str) -> None:
    scene = load_scene(case, ["train.raise_time_s=0.25"])
    carried = json.loads(json.dumps(resolved(scene), allow_nan=False))
    again = scene_from(carried, Origin("the result file", recorded=True))
    assert problem_of(again) == problem_of(scene)
    assert resolved(again) == resolved(scene)


@pytest.mark.parametrize("key", CONTRACT)
def test_contract_keys_can_be_set_and_are_resolved(key: str) -> None:
    plain = resolved(load_scene("en50318_2002"))
    table, name = plain, key
    while "." in name:
        first, name = name.split(".", 1)
        table = table[first]
    value = table[name]
    again = load_scene("en50318_2002", [f"{key}={json.dumps(value)}"])
    assert resolved(again) == plain


def test_the_later_assignment_wins_over_the_earlier_and_both_over_the_file() -> None:
    scene = load_scene("en50318_2002", ["train.speed_km_h=260", "train.speed_km_h = 300"])
    assert problem_of(scene).train.speed == pytest.approx(300 / 3.6, rel=1e-15)


def test_assignments_win_over_the_test_table() -> None:
    short = load_scene("en50318_2002", shortened=True)
    mine = load_scene("en50318_2002", ["line.n_spans=18"], shortened=True)
    assert short.line.n_spans < 18 == mine.line.n_spans
    assert mine.evaluation == short.evaluation


def test_an_empty_value_takes_a_key_away() -> None:
    kind = "pantographs.three_masses"
    scene = load_scene(
        "ac_simple", [f"{kind}.static_force_N=140", f"{kind}.static_force_by_speed="]
    )
    assert problem_of(scene).train.placements[0].static_force == 140.0
    assert load_scene("ac_simple", ["numerics.dt_s="]).numerics.dt_s == 1e-3
    absent = ["wind.gusts=", "vehicle.suspension.lateral=", "train.pantographs.1.behind_m="]
    assert load_scene("ac_simple", absent).model_dump() == load_scene("ac_simple").model_dump()


def test_a_second_pantograph_is_appended_by_its_number() -> None:
    scene = load_scene(
        "en50318_2002",
        [
            "train.start_m=300",
            "train.pantographs.1.name=reference",
            "train.pantographs.1.behind_m=200",
        ],
    )
    train = problem_of(scene).train
    assert [place.behind for place in train.placements] == [0.0, 200.0]
    # The trailing one is to cross the evaluated stretch as well, and one span more.
    assert train.end == scene.evaluation.to_m + 200.0 + 60.0


def test_an_entry_of_a_list_is_replaced_by_its_number() -> None:
    scene = load_scene("en50318_2002", ["pantographs.reference.masses_kg.1=16"])
    assert scene.pantographs["reference"].masses_kg == [7.2, 16.0]
    for key, sentence in (
        ("pantographs.reference.masses_kg.2", "masses_kg has 2 entries, which count from 0"),
        ("line.dropper.pre_sag_mm.3", "line.dropper.pre_sag_mm has no list in the case"),
        ("line.contact_wire.tension_N.0", "line.contact_wire.tension_N is 20000.0 and no list"),
    ):
        with pytest.raises(InputError, match=f"{key} cannot be set .*: .*{sentence}"):
            load_scene("en50318_2002", [f"{key}=16"])


def test_the_end_stops_at_the_end_of_the_running_range() -> None:
    scene = load_scene("en50318_2002", ["line.n_spans=13", "evaluation.to_m=750"])
    assert end_of(scene) == 780.0


def test_quantities_reach_the_problem_in_si_units() -> None:
    scene = load_scene("ac_simple", ["train.speed_km_h=288"])
    problem = problem_of(scene)
    assert problem.train.speed == pytest.approx(80.0, rel=1e-15)
    line = line_data_of(scene)
    assert line.pre_sag[0] == pytest.approx((0, 0.024, 0.041, 0.052, 0.055, 0.052, 0.041, 0.024, 0))
    assert line.stagger[:3] == (0.2, -0.2, 0.2)
    assert len(line.stagger) == line.n_spans + 1
    assert problem.line.wire("contact_wire").tension == 22000.0
    assert problem.damping.alpha == 1e-4
    assert problem.damping.beta == 0.0125


def test_the_static_force_is_interpolated_over_the_speed() -> None:
    def force(speed: float) -> float:
        scene = load_scene("ac_simple", [f"train.speed_km_h={speed}"])
        return problem_of(scene).train.placements[0].static_force

    low, high = force(290), force(295)
    assert force(292.5) == pytest.approx(0.5 * (low + high), rel=1e-12)


def test_span_lengths_are_repeated_over_the_running_spans() -> None:
    scene = load_scene(
        "ambrosio2012", ["line.span_m=[54, 52]", "line.n_spans=9", *_short_evaluation()]
    )
    assert line_data_of(scene).span_lengths == (50, 50, 54, 52, 54, 52, 50, 50, 50)
    without = load_scene(
        "ambrosio2012",
        ["line.span_m=[54, 52]", "line.n_spans=9", "line.transition.span_m=", *_short_evaluation()],
    )
    assert line_data_of(without).span_lengths == (54, 52, 54, 52, 54, 52, 54, 52, 54)


def _short_evaluation() -> list[str]:
    return ["evaluation.from_m=200", "evaluation.to_m=300"]


def test_counted_droppers_are_centred_and_their_pre_sag_is_a_parabola() -> None:
    line = line_data_of(load_scene("ambrosio2012"))
    x, sag = np.array(line.dropper_positions[10]), np.array(line.pre_sag[10])
    assert x[0] == pytest.approx(54 - x[-1])
    assert np.diff(x) == pytest.approx(np.full(7, 6.75))
    # A parabola has one second difference: 2 * 4 s / (7 * 6.75)^2 * 6.75^2 with s = 54 mm.
    assert np.diff(sag, 2) == pytest.approx(np.full(6, -8 * 0.054 / 49))
    assert sag[0] == sag[-1] == 0
    mid = np.polyval(np.polyfit(x, sag, 2), 27.0)
    assert mid == pytest.approx(0.054)
    assert line.pre_sag[0] == (0.0,) * 8  # a transition span


def test_patterns_give_each_span_length_its_droppers() -> None:
    patterns = (
        "line.dropper.patterns=[{span_m=50, positions_m=[10, 40]},"
        " {span_m=54, positions_m=[10, 27, 44], pre_sag_mm=[0, 20, 0]}]"
    )
    removed = [f"line.dropper.{key}=" for key in ("count", "spacing_m", "pre_sag_mid_mm")]
    line = line_data_of(load_scene("ambrosio2012", [patterns, *removed]))
    assert line.dropper_positions[0] == (10, 40)
    assert line.dropper_positions[5] == (10, 27, 44)
    assert line.pre_sag[5] == (0, 0.02, 0)
    with pytest.raises(InputError, match="no entry for spans of 53 m"):
        load_scene("ambrosio2012", [patterns, *removed, "line.span_m=53"])


def test_damping_of_single_components_replaces_the_lines() -> None:
    scene = load_scene(
        "en50318_2002", ["line.damping.per_component.droppers={alpha_s=0.01, beta_per_s=0.0}"]
    )
    assert problem_of(scene).damping.per_component == {"droppers": (0.01, 0.0)}


def test_a_mesh_file_is_relative_to_its_case_or_to_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    for folder in (here, there):
        folder.mkdir()
        (folder / "own.msh").touch()
    text = find_case("en50318_2002").read_text()
    case = there / "case.toml"
    case.write_text(text.replace("elements_per_gap = 8", 'file = "own.msh"'))
    monkeypatch.chdir(here)
    assert load_scene(case).mesh.file == str(there / "own.msh")
    assert load_scene(case, ["mesh.file=own.msh"]).mesh.file == str(here / "own.msh")
    assert resolved(load_scene(case))["mesh"] == {"file": str(there / "own.msh")}


def test_a_case_is_found_by_name_file_and_folder_and_takes_its_folders_name(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "my_line"
    folder.mkdir()
    text = find_case("en50318_2002").read_text().replace('name = "en50318_2002"\n', "")
    (folder / "case.toml").write_text(text)
    assert load_scene(folder).case.name == "my_line"
    assert problem_of(load_scene(folder / "case.toml")) == problem_of(load_scene("en50318_2002"))


def test_a_sentence_says_whether_the_file_or_the_command_line_is_wrong(tmp_path: Path) -> None:
    file = tmp_path / "case.toml"
    text = find_case("en50318_2002").read_text()
    file.write_text(text.replace("tension_N = 20000.0", "tension_N = -5"))
    with pytest.raises(InputError) as caught:
        load_scene(file)
    assert str(caught.value) == (
        f"line.contact_wire.tension_N is -5 in {file}; it must be greater than 0 [N]; usual are "
        "5000 to 40000 N"
    )
    with pytest.raises(InputError, match=r"is -6 on the command line \(--set\)"):
        load_scene(file, ["line.contact_wire.tension_N=-6"])


def test_the_number_of_further_problems_is_told() -> None:
    with pytest.raises(InputError, match=r"\(and 2 more, in the attribute faults\)$"):
        load_scene("en50318_2002", ["line.n_spans=0", "numerics.dt_s=0", "contact=3"])


def test_every_key_has_a_help_text() -> None:
    from catenary.cases.scene.keys.keys import tables_in

    tables = [Scene]
    for table in tables:
        for name, field in table.model_fields.items():
            assert field.description, f"{table.__name__}.{name}"
            inner, _ = tables_in(field.annotation)
            tables += [table for table in inner if table not in tables]
    assert len(tables) > 30


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("train.speed_km_h", "km/h"),
        ("line.contact_wire.tension_N", "N"),
        ("line.contact_wire.mass_kg_per_m", "kg/m"),
        ("line.contact_wire.bending_stiffness_N_m2", "N m2"),
        ("pantographs.x.dampings_N_s_per_m.0", "N s/m"),
        ("pantographs.x.bodies.y.inertia_kg_m2.1", "kg m2"),
        ("pantographs.x.joints.y.angle_deg", "deg"),
        ("pantographs.x.forces.y.coefficient_N_s2_per_m2.2", "N s2/m2"),
        ("line.damping.beta_per_s", "1/s"),
        ("line.dropper.pre_sag_mm", "mm"),
        ("numerics.eps_v_m_per_s", "m/s"),
        ("line.n_spans", ""),
        ("numerics.max_iterations", ""),
        ("output.flush_every_steps", ""),
    ],
)
def test_units_follow_from_names(key: str, unit: str) -> None:
    assert unit_of(key) == unit


@pytest.mark.parametrize(
    ("ends", "key"),
    [
        (["train.start_m=700"], "train.start_m"),  # the default end is that of the statistics
        (["train.start_m=500", "train.end_m=500"], "train.end_m"),
        (["train.end_m=50"], "train.end_m"),
    ],
)
def test_a_train_that_ends_before_it_starts_has_one_fault(ends: list[str], key: str) -> None:
    with pytest.raises(InputError) as refused:
        load_scene("en50318_2002", ends, shortened=True)
    (fault,) = refused.value.faults
    assert fault.key == key and "nothing" not in fault.sentence
