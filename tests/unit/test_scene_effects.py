"""Effects in a scene: every switch comes from the registry, none is listed a second time."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import fields

import pytest

from catenary.cases.run.planning.plan import effect_rows
from catenary.cases.scene.convert.course import resolved
from catenary.cases.scene.convert.problem import problem_of
from catenary.cases.scene.keys.keys import known_keys
from catenary.cases.scene.load import load_scene
from catenary.cases.scene.scene import Scene
from catenary.solver.base.errors import InputError
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.effect import Effect, register, unregister

OPTIONAL = [name for name, effect in effects.registry().items() if not effect.always]


@pytest.fixture
def wind() -> Iterator[Effect]:
    effects.registry()
    effect = register(
        Effect(
            "side_wind",
            "wind on the wires",
            "a load",
            "this test",
            default=False,
            unknowns_of_wire=lambda wire: ("v", "theta_z"),
            requires=("gravity",),
        )
    )
    yield effect
    unregister("side_wind")


@pytest.mark.parametrize("name", OPTIONAL)
def test_each_effect_can_be_left_out_with_those_that_require_it(name: str) -> None:
    dependent = [n for n, e in effects.registry().items() if name in e.requires]
    scene = load_scene("ac_simple", [f"effects.{n}=false" for n in [name, *dependent]])
    on, off = effect_rows(scene, problem_of(scene))
    assert name not in problem_of(scene).effects
    assert name not in [row.name for row in on]
    assert [row.reason for row in off if row.name == name] == ["left out by the scene"]


@pytest.mark.parametrize("name", OPTIONAL)
def test_an_effect_without_what_it_requires_is_refused(name: str) -> None:
    for required in effects.registry()[name].requires:
        with pytest.raises(InputError, match=rf"requires effects\.{required}, which is off"):
            load_scene("ac_simple", [f"effects.{name}=true", f"effects.{required}=false"])


@pytest.mark.parametrize("case", ["en50318_2002", "ac_simple", "ambrosio2012"])
def test_the_plan_names_every_effect_once(case: str) -> None:
    scene = load_scene(case)
    on, off = effect_rows(scene, problem_of(scene))
    assert sorted(row.name for row in on + off) == sorted(effects.registry())


def test_the_plan_tells_why_an_effect_is_not_simulated() -> None:
    scene = load_scene("en50318_2002", ["effects.arm_stiffness=false"])
    _, off = effect_rows(scene, problem_of(scene))
    reason = {row.name: row.reason for row in off}
    assert reason["arm_stiffness"] == "left out by the scene"
    assert reason["pre_sag"] == (
        "the scene has no data for it: line.dropper.pre_sag_mm or pre_sag_mid_mm other than 0"
    )
    assert reason["supercritical_speed"].startswith("the scene has no data for it: a train.speed")
    damped = ["contact.damping_N_s_per_m=10", "contact.law=linear"]
    scene = load_scene("ac_simple", [*damped, "effects.contact_damping=false"])
    _, off = effect_rows(scene, problem_of(scene))
    assert {row.name: row.reason for row in off}["contact_damping"] == "left out by the scene"


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
    assert {r.name: r.reason for r in off}[wind.name] == "off unless the scene asks for it"


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
