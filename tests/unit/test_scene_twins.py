"""`effects.relative_motion = false`: refused where twin wires would move relative to each other."""

from __future__ import annotations

import pytest
from scenes import load_scene, mesh_of, problem_of, with_words

import catenary
from catenary import InputError
from catenary.cases.run.needs import needs_before_meshing
from catenary.cases.scene.checks.effects import needs_relative_motion
from catenary.cases.scene.checks.mesh_size import size_of
from catenary.cases.scene.input.faults import SceneError
from catenary.cases.studies.accuracy.axes import planes
from catenary.cases.studies.asked import Excited
from catenary.cases.studies.effect_cost import switchable_effects
from catenary.cases.studies.waves.study import excitation_of
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import numbering_of

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
