"""Effects in a scene: every switch comes from the registry, none is listed a second time."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import pytest
from scenes import Scene, load_scene, problem_of, resolved, scene_from

from catenary import InputError
from catenary.cases.run.plan import effect_rows
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.keys.keys import known_keys
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.effect import Effect, register, unregister

OPTIONAL = [name for name, effect in effects.registry().items() if not effect.always]


@pytest.fixture
def wind() -> Iterator[Effect]:
    effects.registry()
    effect = Effect(
        "side_wind",
        "wind on the wires",
        "a load",
        "this test",
        default=False,
        unknowns_of_wire=lambda wire: ("v", "theta_z"),
        requires=("gravity",),
    )
    register(effect)
    yield effect
    unregister("side_wind")


@pytest.mark.parametrize("name", OPTIONAL)
def test_each_effect_can_be_left_out_with_those_that_require_it(name: str) -> None:
    dependent = [n for n, e in effects.registry().items() if name in e.requires]
    scene = load_scene("ac_simple", [f"effects.{n}=false" for n in [name, *dependent]])
    on, off = effect_rows(scene, problem_of(scene))
    assert name not in problem_of(scene).effects
    assert name not in [row.name for row in on]
    assert [row.reason for row in off if row.name == name] == ["switched off by the scene"]


@pytest.mark.parametrize("name", OPTIONAL)
def test_an_effect_without_what_it_requires_is_refused(name: str) -> None:
    for required in effects.registry()[name].requires:
        with pytest.raises(InputError, match=rf"requires effects\.{required}, which is off"):
            load_scene("ac_simple", [f"effects.{name}=true", f"effects.{required}=false"])


# Effects whose own checks say what they lack, and how their sentences begin.
OWN_SENTENCE = {
    "residual_dropper_stiffness": "line.dropper.residual_stiffness_ratio is 0 by default",
    "contact_damping": "contact.damping_N_s_per_m is 0 N s/m by default",
    "axial_motion": "effects.axial_motion is on, but line.contact_wire (contact wire) in ",
}
# Without anything that an optional effect could act on but slack droppers and the contact's loss.
BARE = [
    "line.steady_arm.stiffness_N_per_m=0",
    "line.damping.alpha_s=0",
    "line.damping.beta_per_s=0",
]
WINDY = [
    "wind.speed_m_per_s=10",
    "line.contact_wire.diameter_mm=13",
    "line.messenger_wire.diameter_mm=14",
]
RIGID = [
    "contact.law=kinematic",
    "contact.stiffness_N_per_m=",
    "numerics.newmark_gamma=0.55",
    "numerics.newmark_beta=0.28",
]
PERMISSIONS = [name for name, effect in effects.registry().items() if effect.lifts]


@pytest.mark.parametrize(
    "name", [n for n, e in effects.registry().items() if e.data and n not in PERMISSIONS]
)
def test_an_effect_with_nothing_to_act_on_is_refused(name: str) -> None:
    effect = effects.registry()[name]
    words = [*BARE, *(f"effects.{required}=true" for required in effect.requires)]
    # A requirement that lacks data itself would be told in its place.
    words += WINDY if "wind" in effect.requires else []
    words += RIGID if name == "contact_loss" else []
    case = "en50318_2002"
    if name == "dropper_slackening":  # that line has droppers
        case, words = "conductor_rail", []
    load_scene(case, words)
    with pytest.raises(InputError) as refused:
        load_scene(case, [*words, f"effects.{name}=true"])
    if name in OWN_SENTENCE:
        assert str(refused.value).startswith(OWN_SENTENCE[name])
    else:
        assert str(refused.value) == (
            f"effects.{name} is true on the command line (--set); it acts only with {effect.data}; "
            "give that, or leave the effect out"
        )


def test_a_recorded_scene_names_effects_that_have_nothing_to_act_on() -> None:
    """Every effect that was on stands in a result, also one that its author did not write."""
    record = resolved(load_scene("en50318_2002"))
    assert record["effects"]["gusts"] is True
    scene_from(record, Origin("run.h5", recorded=True))
    del record["line"]["tensioner"], record["numerics"]  # of which results have every key, too
    with pytest.raises(InputError, match=r"effects\.pre_sag is true in case\.toml; it acts only"):
        scene_from(record, Origin("case.toml"))


def test_an_effect_that_permits_something_may_be_on_without_it() -> None:
    """Variants of one sweep may be on both sides of the limit that it lifts."""
    assert PERMISSIONS == ["several_pantographs", "supercritical_speed"]
    for name in PERMISSIONS:
        scene = load_scene("ac_simple", [f"effects.{name}=true"])
        assert name not in [row.name for row in effect_rows(scene, problem_of(scene))[0]]


def test_an_effect_that_does_not_act_says_what_does_instead() -> None:
    words = ["effects.lateral_motion=true", "line.steady_arm.stiffness_N_per_m=150"]
    load_scene("ac_simple_3d", words)
    with pytest.raises(InputError, match=r"arm_stiffness is true .* with lateral motion they are"):
        load_scene("ac_simple_3d", [*words, "effects.arm_stiffness=true"])


@pytest.mark.parametrize("case", ["en50318_2002", "ac_simple", "ambrosio2012"])
def test_the_plan_names_every_effect_once(case: str) -> None:
    scene = load_scene(case)
    on, off = effect_rows(scene, problem_of(scene))
    assert sorted(row.name for row in on + off) == sorted(effects.registry())


def test_the_plan_tells_why_an_effect_is_not_simulated() -> None:
    scene = load_scene("en50318_2002", ["effects.arm_stiffness=false"])
    _, off = effect_rows(scene, problem_of(scene))
    reason = {row.name: row.reason for row in off}
    assert reason["arm_stiffness"] == "switched off by the scene"
    assert reason["pre_sag"] == (
        "the scene has no data for it: line.dropper.pre_sag_mm or pre_sag_mid_mm other than 0"
    )
    assert reason["supercritical_speed"].startswith("the scene has no data for it: a train.speed")
    damped = ["contact.damping_N_s_per_m=10", "contact.law=linear"]
    scene = load_scene("ac_simple", [*damped, "effects.contact_damping=false"])
    _, off = effect_rows(scene, problem_of(scene))
    assert {row.name: row.reason for row in off}["contact_damping"] == "switched off by the scene"


def test_an_effect_that_needs_data_names_keys_that_scenes_have() -> None:
    known = {re.sub(r"\*", "X", key) for key in known_keys(Scene)}
    any_scene = {field.name: field.default for field in fields(Effect)}["applies"]
    for name, effect in effects.registry().items():
        assert bool(effect.data) == (effect.applies is not any_scene), name
        for key in re.findall(r"[a-z_]+(?:\.(?:[A-Za-z_0-9]+|\*))+", effect.data):
            assert key.replace("*", "X") in known, f"{name}: {key}"


def test_an_effect_that_could_be_switched_on_needs_no_data(wind: Effect) -> None:
    scene = load_scene("ac_simple")
    _, off = effect_rows(scene, problem_of(scene))
    assert {r.name: r.reason for r in off}[wind.name] == "off by default"


def test_a_new_effect_becomes_a_key_without_a_change_here(wind: Effect) -> None:
    assert load_scene("ac_simple").switches()[wind.name] is False
    scene = load_scene("ac_simple", ["effects.side_wind=true"])
    assert wind.name in problem_of(scene).effects
    assert resolved(scene)["effects"][wind.name] is True
    with pytest.raises(InputError, match=r"did you mean effects\.side_wind\?"):
        load_scene("ac_simple", ["effects.sidewind=true"])


def test_an_effect_of_yesterday_is_unknown() -> None:
    with pytest.raises(InputError, match=r"effects\.side_wind .* is unknown"):
        load_scene("ac_simple", ["effects.side_wind=true"])


def test_the_speed_limit_is_the_wave_speed_of_the_contact_wire() -> None:
    # sqrt(20000 / 1.35) = 121.72 m/s = 438.18 km/h
    load_scene("en50318_2002", ["train.speed_km_h=438.1"])
    with pytest.raises(InputError, match="below the wave speed"):
        load_scene("en50318_2002", ["train.speed_km_h=438.2"])
    scene = load_scene("en50318_2002", ["train.speed_km_h=450", "effects.supercritical_speed=true"])
    assert "supercritical_speed" in problem_of(scene).effects


def test_data_of_an_effect_may_stand_if_it_is_left_out_knowingly() -> None:
    scene = load_scene(
        "en50318_2002", ["contact.damping_N_s_per_m=10", "effects.contact_damping=false"]
    )
    assert "contact_damping" not in problem_of(scene).effects


EXAMPLE = Path(__file__).parents[2] / "docs/examples/two_messengers.toml"
ON, RATIOS = (
    "effects.residual_dropper_stiffness=true",
    [f"line.links.{i}.residual_stiffness_ratio=0.1" for i in (0, 1, 2, 3, 4, 5)],
)


@pytest.mark.parametrize(
    ("case", "changes", "says"),
    [
        ("conductor_rail", [ON], r"effects.residual_dropper_stiffness is true on .* no droppers"),
        (
            EXAMPLE,
            [ON],
            "line.links.0.residual_stiffness_ratio is 0 by default.* needs a value greater",
        ),
        (EXAMPLE, RATIOS, "line.links.0.residual_stiffness_ratio is 0.1 on .* acts only with"),
        (EXAMPLE, [*RATIOS, "effects.residual_dropper_stiffness=false"], ""),
        (EXAMPLE, [*RATIOS, ON], ""),
    ],
)
def test_force_of_slack_droppers_is_that_of_the_droppers_there_are(
    case: str | Path, changes: list[str], says: str
) -> None:
    """Lines without the table ``line.dropper`` were refused with a traceback."""
    if not says:
        load_scene(case, changes)
        return
    with pytest.raises(InputError, match=says):
        load_scene(case, changes)
