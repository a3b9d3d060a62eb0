"""Lateral motion and the relative motion of twin wires: what keys become, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from free_tables import as_free
from scenes import line_data_of, load_scene, mesh_of, problem_of, scene_from, with_words

import catenary
from catenary import InputError
from catenary.cases.run.at_rest import static_table
from catenary.cases.run.needs import needs_before_meshing
from catenary.cases.run.plan import effect_rows
from catenary.cases.scene.checks.effects import needs_relative_motion
from catenary.cases.scene.checks.mesh_size import size_of
from catenary.cases.scene.input.faults import Origin, SceneError
from catenary.cases.studies.accuracy.axes import planes
from catenary.cases.studies.asked import Excited
from catenary.cases.studies.effect_cost import switchable_effects
from catenary.cases.studies.waves.study import excitation_of
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.all_effects import active
from catenary.solver.effects.build_model import numbering_of

# --- keys of lateral motion -----------------------------------------------------------------------


ON = "effects.lateral_motion=true"


def test_an_inclination_is_an_angle_of_the_arm() -> None:
    scene = load_scene("ac_simple", [ON, "line.steady_arm.inclination_deg=10"])
    assert line_data_of(scene).steady_arm.inclination == pytest.approx(np.pi / 18)
    assert line_data_of(load_scene("ac_simple", [])).steady_arm.inclination is None


def test_a_curve_is_a_curvature_a_tilt_and_a_stretch() -> None:
    given = "{radius_m=2000, side='right', cant_mm=150, from_m=200, to_m=900, transition_m=100}"
    line = line_data_of(load_scene("ac_simple", [ON, f"line.curve={given}"]))
    assert line.curve is not None
    x = np.array([100.0, 250.0, 500.0])
    assert np.allclose(line.curve.curvature_at(x), [0.0, -1 / 4000, -1 / 2000], atol=1e-18)
    assert np.allclose(line.curve.tilt, np.arcsin(0.1))
    assert line.curve.sideways_pull_at(x)[-1] == pytest.approx(-np.tan(np.arcsin(0.1)))


def test_a_messenger_wire_has_a_stagger_of_its_own() -> None:
    line = line_data_of(load_scene("ac_simple", [ON, "line.messenger_stagger_m=0.1"]))
    assert line.messenger_stagger is not None
    assert line.messenger_stagger[:3] == (0.1, -0.1, 0.1) and line.stagger[0] == 0.2


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (["line.steady_arm.inclination_deg=10"], "acts only with effects.lateral_motion = true"),
        (
            [ON, "line.steady_arm.inclination_deg=10", "line.steady_arm.holds_height=true"],
            "takes holds_height or inclination_deg, but both are given",
        ),
        ([ON, "line.steady_arm.inclination_deg=40"], "inclination_deg"),
        (
            [ON, "line.steady_arm.inclination_deg=10", "line.steady_arm.length_m=0"],
            "line.steady_arm .* needs length_m above 0 for inclination_deg",
        ),
        (
            ["line.steady_arm.stiffness_by_radial_force=true", "line.steady_arm.length_m=0"],
            "needs length_m above 0 for stiffness_by_radial_force",
        ),
        (
            [
                "line.steady_arm.stiffness_by_radial_force=true",
                "line.steady_arm.stiffness_N_per_m=9",
            ],
            "takes stiffness_N_per_m or stiffness_by_radial_force, but both are given",
        ),
        (["line.messenger_stagger_m=0.2"], "line.messenger_stagger_m .* acts only with"),
        (
            ["line.curve.radius_m=3000"],
            "line.curve.radius_m is 3000 m .* acts only with effects.lat",
        ),
        ([ON, "line.curve.radius_m=50"], "line.curve.radius_m"),
        ([ON, "line.curve={radius_m=3000, side='up'}"], "left.* or .*right"),
        ([ON, "line.curve={radius_m=3000, from_m=100}"], "needs from_m and to_m together"),
        ([ON, "line.curve={radius_m=3000, transition_m=100}"], "takes transition_m with from_m"),
        (
            [ON, "line.curve={radius_m=3000, from_m=100, to_m=200, transition_m=60}"],
            r"to_m \(200\) must be greater than 220 m",
        ),
        (
            [ON, "line.curve={radius_m=3000, cant_mm=100, from_m=100, to_m=200, transition_m=9}"],
            r"line.curve .*takes cant_mm \(100\) with a transition_m of 10 m or more",
        ),
        ([ON, "line.messenger_stagger_m=[0.1, 0.2]"], "must give messenger_stagger_m as one"),
    ],
)
def test_keys_that_do_not_fit_are_refused(changes: list[str], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        load_scene("ac_simple", changes)


def test_lateral_motion_goes_with_ends_that_go_on() -> None:
    problem = problem_of(load_scene("ac_simple", [ON, 'line.ends.end.kind="periodic"']))
    assert {"lateral_motion", "periodic_ends"} <= {effect.name for effect in active(problem)}


def test_lateral_motion_goes_with_another_temperature() -> None:
    """And finds its rest: arms slew, the line is warmer than at its installation."""
    wires = [f"line.{wire}.axial_stiffness_N=1.5e7" for wire in ("contact_wire", "messenger_wire")]
    changes = [ON, "effects.axial_motion=true", "line.temperature.difference_K=30", *wires]
    problem = problem_of(load_scene("ac_simple", [*changes, "line.ends.end.along=tensioner"]))
    assert {"lateral_motion", "temperature"} <= {effect.name for effect in active(problem)}


def test_arms_of_a_vertical_scene_have_the_stiffness_of_their_radial_force() -> None:
    """4 F a / (L l) of a zig-zag, and no effect without a stagger."""
    changes = ["line.steady_arm.stiffness_by_radial_force=true", "line.n_spans=4"]
    changes += ["train.start_m=60", "evaluation.from_m=120", "evaluation.to_m=160"]
    problem = problem_of(load_scene("ac_simple", changes))
    (arms,) = problem.line.steady_arms
    found = arms.vertical_stiffness(problem.line.wire(arms.wire))
    assert found == pytest.approx(4 * 22e3 * 0.2 / (55 * 1.22), rel=1e-12)
    assert "arm_stiffness" in {effect.name for effect in active(problem)}
    straight = problem_of(load_scene("ac_simple", [*changes, "line.stagger_m=0"]))
    assert "arm_stiffness" not in {effect.name for effect in active(straight)}


def test_a_stiffness_that_bars_do_not_take_stands_among_what_is_left_out() -> None:
    def reason(*changes: str) -> str:
        scene = load_scene("re330_stitched", list(changes))
        on, off = effect_rows(scene, problem_of(scene))
        return next(row.reason for row in [*on, *off] if row.name == "arm_stiffness")

    assert reason() == "default"
    assert reason(ON, "line.steady_arm.stiffness_N_per_m=300").startswith(
        "of steady_arms 300 N/m are not used: with lateral motion they are bars"
    )
    arm = "line.steady_arm"
    springs = [f"{arm}.length_m=0", f"{arm}.inclination_deg=", f"{arm}.mass_kg_per_m="]
    assert reason(ON, *springs) == "default"
    radial = f"{arm}.stiffness_by_radial_force=true"
    assert reason(ON, f"{arm}.stiffness_N_per_m=0", radial).startswith(
        "steady_arms have it as bars"
    )
    assert reason(ON, "line.steady_arm.stiffness_N_per_m=0").startswith(
        "the scene has no data for it: "
    )


def test_arms_of_a_free_line_are_checked_too() -> None:
    raw = as_free(load_scene("ac_simple", []))
    number, arms = next(
        (i, link) for i, link in enumerate(raw["line"]["links"]) if link["type"] == "steady_arms"
    )
    arms.pop("holds_height", None)
    arms["inclination_deg"] = 9
    raw["effects"].pop("lateral_motion")
    with pytest.raises(InputError, match=rf"links.{number}.inclination_deg is 9 .*acts only with"):
        scene_from(raw, Origin("case.toml", recorded=True))


def test_a_tight_curve_names_the_arms_that_lift_the_wire() -> None:
    """Arms of 10 degrees lift by 22 kN 55 m / 300 m tan 10 deg, 711 N: more than droppers carry."""
    scene = load_scene("ac_simple_3d", ["line.curve.radius_m=300"], shortened=True)
    with pytest.raises(InputError, match="slack at rest .* inclination of the steady arms, which"):
        static_table(scene)


# --- `effects.relative_motion = false` ------------------------------------------------------------


TWIN = "dc_twin"
REFUSED = {
    "droppers by turns": (["line.twin.droppers=alternating"],
        "droppers hang the two wires by turns, .* line.twin.droppers = pairs, or switch this on"),
    "lateral motion": (["effects.lateral_motion=true"], "effects.lateral_motion is simulated"),
    "axial motion": ([
        "effects.axial_motion=true",
        "line.contact_wire.axial_stiffness_N=1e7", "line.messenger_wire.axial_stiffness_N=1e7",
    ], "effects.axial_motion is simulated"),
    "wind": ([
        "effects.lateral_motion=true", "wind={speed_m_per_s=20}",
        "line.contact_wire.diameter_mm=14", "line.messenger_wire.diameter_mm=14",
    ], "effects.(wind|lateral_motion) is simulated"),
    "worn wire": ([
        "defects=[{type='worn_wire',wire='contact_wire',from_m=300,to_m=320,lost_share=0.1}]",
    ], "effects.worn_wire is simulated"),
    "missing dropper": (["defects=[{type='missing_dropper',span=6,dropper=2}]"],
                        "effects.missing_dropper is simulated"),
    "heights": (["irregularities.contact_wire_height.standard_deviation_mm=5"],
                "effects.contact_wire_height is simulated"),
    "waviness": (["irregularities.running_surface.standard_deviation_mm=0.1"],
                 "effects.running_surface is simulated"),
    "dropper lengths": (["irregularities.dropper_lengths.standard_deviation_mm=2"],
                        "effects.dropper_lengths is simulated"),
    "dropper breaks": (["incidents=[{type='dropper_break',at_s=1,span=6,dropper=2}]"],
                       "effects.dropper_break is simulated"),
    "tension lost": (["incidents=[{type='tension_loss',at_s=1,wire='contact_wire',share=0.9}]"],
                     "effects.tension_loss is simulated"),
    "an insulator": (["line.fittings=[{kind='splice',at_m=333,mass_kg=5}]"],
                     "effects.fittings is simulated"),
    "a head that rolls": ([
        "effects.head_roll=true", "pantographs.three_masses.strips={number=1,length_m=1.6}",
        "pantographs.three_masses.roll={inertia_kg_m2=2,spring_distance_m=0.8}",
    ], "effects.head_roll is simulated"),
    "raked strips": (["pantographs.three_masses.strips={number=1,length_m=1.6,rake_deg=10}"],
                     "effects.raked_strips is simulated"),
    "damping of one wire": (["line.damping.per_component.contact_wire_2={alpha_s=0,beta_per_s=0}"],
                            "contact_wire_2 and contact_wire have different damping"),
    "damping of one wire's droppers": (
        ["line.damping.per_component.droppers={alpha_s=0,beta_per_s=0}"],
        "droppers_2 and droppers have different damping .*, or switch this on"),
    "damping of one wire's arms": (
        ["line.damping.per_component.steady_arms_2={alpha_s=0,beta_per_s=0}"],
        "steady_arms_2 and steady_arms have different damping"),
    "damping of one wire's supports": (
        ["line.topology=twin_messenger",
         "line.damping.per_component.supports={alpha_s=0,beta_per_s=0}"],
        "supports_2 and supports have different damping"),
    "kinematic contact": ([
        "contact.law=kinematic", "contact.stiffness_N_per_m=",
        "numerics.newmark_gamma=0.55", "numerics.newmark_beta=0.28",
    ], "with contact.law kinematic"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_would_move_the_wires_apart_is_refused_in_a_sentence(name: str) -> None:
    words, sentence = REFUSED[name]
    with pytest.raises(SceneError, match=sentence) as refused:
        load_scene(TWIN, words)
    text = str(refused.value)
    assert text.startswith("effects.relative_motion is false in ") and "\n" not in text
    # With their relative motion there is nothing to refuse.
    load_scene(TWIN, [*words, "effects.relative_motion=true"])


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["line.topology=twin_messenger"],
        ["line.damping.per_component.messenger_wire={alpha_s=0,beta_per_s=0}"],
        [f"line.damping.per_component.{name}={{alpha_s=1e-3,beta_per_s=0}}"
         for name in ("contact_wire", "contact_wire_2")],
        ["effects.contact_damping=true", "contact.damping_N_s_per_m=10"],
        ["incidents=[{type='lowering',at_s=2}]"],
        ["line.steady_arm.uplift_stop_m=0.1"],
        ["line.overlap={first_span=8,n_spans=3,rise_m=0.3,distance_m=0.2}"],
    ],
)  # fmt: skip
def test_what_treats_both_alike_is_taken(words: list[str]) -> None:
    problem = problem_of(load_scene(TWIN, words))
    assert effects.move_together(problem)


def test_a_force_on_one_of_two_wires_is_refused() -> None:
    """`waves --excite` acts on the first contact wire alone."""
    for kind in ("force", "pulse", "hammer"):
        one, apart = (
            problem_of(load_scene(TWIN, words)) for words in ([], ["effects.relative_motion=true"])
        )
        with pytest.raises(InputError, match=f"--excite {kind} acts on one of two contact wires"):
            excitation_of(kind, Excited(), one, 1e-3)
        excitation_of(kind, Excited(), apart, 1e-3)


def test_it_is_refused_where_there_are_no_twin_wires() -> None:
    with pytest.raises(SceneError, match=r"relative_motion is true .* only with two wires side by"):
        load_scene("ac_simple", ["effects.relative_motion=true"])
    # As of other effects, false says that a scene does without what it does not have.
    assert not load_scene("ac_simple", ["effects.relative_motion=false"]).switches()[
        "relative_motion"
    ]


def test_an_effect_that_nobody_has_looked_at_is_taken_to_move_them_apart() -> None:
    """What is registered tomorrow is refused until it is said to treat both alike."""
    one, apart = (
        problem_of(load_scene(TWIN, words)) for words in ([], ["effects.relative_motion=true"])
    )
    assert needs_relative_motion(one, "of_tomorrow")
    assert not needs_relative_motion(apart, "of_tomorrow")
    alike = {name for name in effects.registry() if not needs_relative_motion(one, name)}
    told = {"lateral_motion", "axial_motion", "tensioners", "temperature", "wind", "gusts"}
    told |= {"head_roll", "flexible_strips", "raked_strips", "dropper_break", "tension_loss"}
    told |= {"missing_dropper", "loose_clamp", "worn_wire", "wrong_tension", "hard_spot", "kink"}
    told |= {"contact_wire_height", "dropper_lengths", "running_surface", "fittings"}
    assert set(effects.registry()) - alike == told


@pytest.mark.parametrize("topology", ["twin", "twin_messenger"])
@pytest.mark.parametrize("relative", [True, False])
def test_what_is_planned_counts_shared_unknowns_once(topology: str, relative: bool) -> None:
    """Before there is a mesh, and of it; so that memory and time are estimated for stations of
    four unknowns, not six or eight."""
    words = [f"line.topology={topology}", f"effects.relative_motion={str(relative).lower()}"]
    scene = load_scene(TWIN, words, shortened=True)
    numbering = numbering_of(problem_of(scene), mesh_of(scene))
    size, needs = size_of(scene), needs_before_meshing(scene)
    plan = catenary.plan(with_words(TWIN, words, short=True))
    assert size is not None and needs is not None
    assert size.unknowns == plan.figures["n_unknowns"] == numbering.n_unknowns
    assert size.nodes == plan.figures["n_nodes"] == numbering.numbers.shape[0]
    assert needs.march == pytest.approx(plan.figures["wall_s"], rel=1e-9)
    text = str(plan)
    assert ("contact_wire_2 with those of contact_wire" in text) != relative
    assert f"{numbering.n_unknowns} " in text
    assert ("  relative_motion " in text[: text.index("Not simulated:")]) == relative


def test_other_effects_are_switched_on_with_the_relative_motion() -> None:
    """`plan --cost` and `accuracy` of the shipped case, whose wires move as one."""
    switches = {one.name: one for one in switchable_effects(load_scene(TWIN)).switches}
    assert switches["relative_motion"].keys == {"relative_motion": True}
    keys = {"lateral_motion": True, "relative_motion": True}
    assert switches["lateral_motion"].keys == keys
    whole = load_scene(TWIN, switches["lateral_motion"].assignments)
    mesh = mesh_of(whole)
    assert numbering_of(problem_of(whole), mesh).width == 12
    apart = switchable_effects(load_scene(TWIN, ["effects.relative_motion=true"])).switches
    keys_apart = {one.name: one.keys for one in apart}
    assert keys_apart["lateral_motion"] == {"lateral_motion": True}
    assert keys_apart["relative_motion"] == {"relative_motion": False}
    levels = {level.name: level.assignments for level in planes(load_scene(TWIN))}
    assert "effects.relative_motion=true" in levels["lateral"]
    assert "effects.relative_motion=true" not in levels["vertical"]
    for words in levels.values():
        load_scene(TWIN, list(words))
