"""The table of axes: what each varies, on which cases, and how runs are shared."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from scenes import load_scene, resolved
from verb_runner import invoke

from catenary import InputError
from catenary.cases.studies.accuracy import axes as models
from catenary.cases.studies.accuracy.axes import AXES, DISCRETISATION, parse_axes
from catenary.cases.studies.accuracy.runs import Plan, make_plan

CASE = "en50318_2002"


@pytest.fixture(scope="module")
def plan() -> Plan:
    """All axes of the reference model."""
    return make_plan(CASE, parse_axes(None))


def test_all_levels_of_the_reference_model_make_scenes(plan: Plan) -> None:
    for planned in plan.axes:
        assert not planned.refused, planned.axis.name
        names = [level.name for level in planned.levels]
        assert len(set(names)) == len(names)
        assert bool(planned.chains) == (planned.axis.kind == DISCRETISATION)
    names = [job.variant.name for job in plan.jobs]
    assert len(set(names)) == len(names)


def test_settings_that_make_the_same_scene_are_run_once(plan: Plan) -> None:
    scenes = [json.dumps(resolved(job.scene), sort_keys=True, default=str) for job in plan.jobs]
    assert len(set(scenes)) == len(scenes)
    runs = {planned.axis.name: planned.runs for planned in plan.axes}
    # The case has 1 ms, average acceleration, 5e4 N/m and droppers that slacken.
    own = runs["dt"]["1_ms"]
    assert runs["scheme"]["average_acceleration"] == own
    assert runs["contact"]["linear_50000"] == own
    assert runs["dropper"]["slackening"] == own


def test_references_are_finer_than_all_levels_in_all_that_is_refined() -> None:
    """The grid, from which settings are recommended: strictly, in step and in mesh."""
    scene = load_scene(CASE)
    for quick in (False, True):
        for axis in AXES.values():
            if axis.chains is None:
                continue
            finest = axis.chains(quick)[0][0]
            for level in axis.chosen(scene, quick):
                for name, size in level.sizes.items():
                    assert size > finest.sizes.get(name, 0.0), axis.name
        grid = AXES["grid"]
        assert grid.chains is not None
        assert grid.chains(quick)[0][0].sizes.keys() == {"dt", "h"}


def test_the_reference_is_measured_by_ones_of_half_its_fineness() -> None:
    for quick in (False, True):
        for axis in AXES.values():
            if axis.chains is None:
                continue
            chains = axis.chains(quick)
            finest = chains[0][0].sizes
            assert len(chains) == len(finest)
            for first, second, third in chains:
                (own,) = (name for name in finest if first.sizes[name] != second.sizes[name])
                assert first.sizes[own] == finest[own]
                sizes = [level.sizes[own] for level in (first, second, third)]
                assert sizes == pytest.approx([sizes[0], 2 * sizes[0], 4 * sizes[0]])
                others = [{**level.sizes, own: None} for level in (first, second, third)]
                assert others[0] == others[1] == others[2]


def test_errors_of_step_and_mesh_are_measured_apart(plan: Plan) -> None:
    planned = next(one for one in plan.axes if one.axis.name == "grid")
    scenes = {job.variant.name: job.scene for job in plan.jobs}
    reference = scenes[planned.reference]
    for level, run in planned.runs.items():
        own, alone = scenes[run], scenes[planned.step_alone[level]]
        assert alone.mesh.elements_per_gap == own.mesh.elements_per_gap
        assert alone.numerics.dt_s == reference.numerics.dt_s < own.numerics.dt_s
        assert own.mesh.elements_per_gap < reference.mesh.elements_per_gap


@pytest.fixture(scope="module")
def of_a_mechanism() -> Plan:
    """The axis of pantographs where the case has a mechanism: fits take seconds."""
    return make_plan("ambrosio2012", parse_axes("pantograph"))


@pytest.mark.study
def test_a_mechanism_is_varied_as_one(of_a_mechanism: Plan) -> None:
    plan = of_a_mechanism
    (planned,) = plan.axes
    assert [*planned.runs] == [
        "fitted_1_mass",
        "fitted_2_mass",
        "fitted_3_mass",
        "reduced",
        "all_bodies",
    ]
    jobs = {job.variant.name: job for job in plan.jobs}
    fitted = jobs[planned.runs["fitted_3_mass"]].scene
    assert len(fitted.pantographs[fitted.train.pantographs[0].name].masses_kg) == 3
    assert planned.runs["reduced"] == planned.reference


def test_a_pantograph_that_is_fitted_to_itself_is_found_again(plan: Plan) -> None:
    """The fit of two masses to the reference model's two masses: 7.2 and 15 kg."""
    jobs = {job.variant.name: job.scene for job in plan.jobs}
    (planned,) = [one for one in plan.axes if one.axis.name == "pantograph"]
    scene = jobs[planned.runs["fitted_2_mass"]]
    masses = scene.pantographs["fitted_2"].masses_kg
    # The fit ends when its residual changes by less than 1e-8; masses follow to some 1e-4.
    assert masses == pytest.approx([7.2, 15.0], rel=1e-3)
    assert scene.train.pantographs[0].name == "fitted_2"


@pytest.mark.study
def test_a_level_that_a_case_does_not_allow_is_told(
    of_a_mechanism: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Strips with a mass of their own are not moved with all bodies."""
    fitted = {level.name: level for level in of_a_mechanism.axes[0].levels}
    monkeypatch.setattr(models, "_fitted", lambda scene, kind, n: fitted[f"fitted_{n}_mass"])
    strips = "pantographs.seven_body.strips"
    own = (f"{strips}.mass_kg=1.0", f"{strips}.stiffness_N_per_m=2e4")
    (planned,) = make_plan("ambrosio2012", parse_axes("pantograph"), own).axes
    assert [*planned.refused] == ["all_bodies"]
    assert "strips" in planned.refused["all_bodies"]
    assert "all_bodies" not in planned.runs


@pytest.mark.parametrize(
    ("case", "changes", "levels"),
    [
        (CASE, [], ["vertical", "lateral"]),
        ("ac_simple_3d", [], ["vertical", "lateral"]),
        (
            "ac_simple_3d",
            [
                "line.contact_wire.axial_stiffness_N=15e6",
                "line.messenger_wire.axial_stiffness_N=12e6",
            ],
            ["vertical", "lateral", "axial", "three_planes"],
        ),
    ],
)
def test_wires_move_in_the_planes_that_a_scene_has_data_for(
    case: str, changes: list[str], levels: list[str]
) -> None:
    plan = make_plan(case, parse_axes("planes"), changes)
    (planned,) = plan.axes
    assert [*planned.runs] == levels and not planned.refused
    scenes = {job.variant.name: job.scene for job in plan.jobs}
    for level, run in planned.runs.items():
        on = scenes[run].switches()
        assert on["lateral_motion"] == (level in ("lateral", "three_planes"))
        assert on["axial_motion"] == (level in ("axial", "three_planes"))
    # The case as it is is one of them, and run once.
    assert planned.reference in planned.runs.values()
    assert len(plan.jobs) == len(levels)


def test_lateral_motion_is_damped_over_the_band_of_measurements() -> None:
    plan = make_plan("ac_simple_3d", parse_axes("lateral_damping"))
    (planned,) = plan.axes
    assert [*planned.runs] == [f"{beta}_per_s" for beta in (0.003, 0.2, 0.9, 3, 10)]
    scenes = {job.variant.name: job.scene for job in plan.jobs}
    for level, run in planned.runs.items():
        lateral = scenes[run].line.damping.lateral
        assert lateral is not None and lateral.alpha_s == 0.0
        assert f"{lateral.beta_per_s:g}_per_s" == level
    # Of wires that move up and down only there is nothing to damp.
    with pytest.raises(InputError, match=r"the axes lateral_damping have nothing to vary in \w+$"):
        make_plan(CASE, parse_axes("lateral_damping"))


@pytest.mark.parametrize(
    ("case", "level", "left"),
    [
        ("re330_stitched", "without_stitch_wire", "simple"),
        ("shinkansen_compound", "without_auxiliary_wire", "simple"),
        ("dc_twin", "without_twin", "simple"),
        ("overlap", "without_overlap", "simple"),
    ],
)
def test_a_line_is_compared_with_itself_less_a_part(case: str, level: str, left: str) -> None:
    plan = make_plan(case, parse_axes("parts"))
    (planned,) = plan.axes
    assert [*planned.runs] == [level] and not planned.refused
    scenes = {job.variant.name: job.scene for job in plan.jobs}
    scene, part = scenes[planned.runs[level]], level.removeprefix("without_")
    assert scene.line.topology == left and getattr(scene.line, part) is None
    assert getattr(scenes[planned.reference].line, part) is not None


def test_a_simple_line_has_no_part_to_do_without() -> None:
    assert not [*parse_axes("parts")[0].chosen(load_scene(CASE), False)]


def test_an_own_mesh_leaves_nothing_to_refine(tmp_path: Path) -> None:
    path = tmp_path / "line.msh"
    made = invoke("mesh", CASE, "-o", str(path))
    assert made.exit_code == 0, made.output
    own = (f"mesh.file={path}", "mesh.elements_per_gap=")
    with pytest.raises(InputError, match="nothing to vary"):
        make_plan(CASE, parse_axes("elements,grid"), own)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--axes", "step"), "there are dt, elements"),
        (("--axes", "dt,dt"), "twice"),
        (("--target", "0"), "percentage"),
        (("--repeats", "0"), "between 1 and"),
    ],
)
def test_bad_input_is_one_sentence(words: tuple[str, ...], said: str, tmp_path: Path) -> None:
    done = invoke("accuracy", CASE, "-o", str(tmp_path / "out"), *words)
    assert done.exit_code == 2
    assert said in done.stderr and not (tmp_path / "out").exists()
