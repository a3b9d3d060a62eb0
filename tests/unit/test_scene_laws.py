"""Laws and regulated lifts in a scene: converted to SI, refused in one sentence."""

from __future__ import annotations

import pytest
from scenes import Scene, load_scene, problem_of, recorded

from catenary import InputError
from catenary.cases.run.description import kind_lines
from catenary.mbs.head.laws import Law, Regulation
from catenary.solver.effects import all_effects as effects

CASE, KIND = "en50318_2002", "pantographs.reference"
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


def load(*overrides: str) -> Scene:
    return load_scene(CASE, overrides)


@pytest.mark.parametrize("text", LAWS)
def test_a_law_is_a_table_of_force(text: str) -> None:
    (place,) = problem_of(load(f"{KIND}.laws=[{text}]")).train.placements
    assert place.data.laws == (LAWS[text],)


def test_a_mechanism_has_head_and_arm() -> None:
    words = "pantographs.seven_body.laws=[{type='damper',up_N_s_per_m=9,down_N_s_per_m=1}]"
    (place,) = problem_of(load_scene("ambrosio2012", [words])).train.placements
    assert place.data.laws == (Law(1, 2, True, (-1.0, 0.0, 1.0), (-1.0, 0.0, 9.0)),)


def test_a_regulation_is_data() -> None:
    scene = load(f"{KIND}.regulation={{{PI},filter_s=0.2,delay_s=0.02,from_s=0.5,most_N=30}}")
    (place,) = problem_of(scene).train.placements
    assert place.regulator == Regulation(
        False, 125.0, ((0.0, 0.1, 1.0, 0.0),), -50.0, 30.0, 0.01, 0.2, 0.02, 0.5
    )


def test_the_resolved_scene_is_the_same_again_and_names_what_acts() -> None:
    scene = load(f"{KIND}.laws=[{','.join(LAWS)}]", f"{KIND}.regulation={{{PI}}}")
    again = recorded(scene)
    assert problem_of(again) == problem_of(scene)
    active = {effect.name for effect in effects.active(problem_of(scene))}
    assert {"pantograph_laws", "regulated_lift"} <= active
    (told,) = kind_lines(scene, problem_of(scene))["reference"]
    assert told.endswith("; 6 laws not linear; regulated lift")


def test_what_is_switched_off_is_left_out() -> None:
    off = ["effects.pantograph_laws=false", "effects.regulated_lift=false"]
    laws = f"{KIND}.laws=[{','.join(LAWS)}]"
    simulated = effects.simulated(problem_of(load(laws, f"{KIND}.regulation={{{PI}}}", *off)))
    assert not simulated.pantograph_laws and not simulated.regulated_lift


REFUSED = {
    f"{KIND}.laws=[{{type='brake'}}]": "must be of type limiter, damper, spring or friction",
    f"{KIND}.laws=[{{type='limiter',rise_m=0.1}}]": "needs exactly one of stiffness_N_per_m",
    f"{KIND}.laws=[{{type='limiter',stiffness_N_per_m=1e4}}]": "needs rise_m and stiffness_N_per_m",
    f"{KIND}.laws=[{{type='friction',force_N=3,at_mass=3}}]": "the pantograph has 2 masses",
    f"{KIND}.laws=[{{type='damper',up_N_s_per_m=3}}]": "needs up_N_s_per_m and down_N_s_per_m",
    f"{KIND}.laws=[{{type='damper',force_by_velocity=[[-1,5],[1,9]]}}]": "must brake, but has 5 N",
    f"{KIND}.laws=[{{type='spring',force_by_extension=[[0,9],[1,5]]}}]": "must not fall",
    f"{KIND}.laws=[{{type='spring',force_by_extension=[[0,0],[1e-9,5]]}}]": "must not rise by more",
    f"{KIND}.laws=[{{type='limiter',force_by_rise=[[0.1,3],[1,9]]}}]": "must begin with a force",
    f"{KIND}.regulation={{measures='force',target=1,gains=[]}}": "be contact_force or",
    f"{KIND}.regulation={{measures='contact_force',target=1,gains=[{{at=0}}]}}": "a gain above 0",
    f"{KIND}.regulation={{{PI},delay_s=0.015}}": "a delay of whole samples",
    f"{KIND}.regulation={{{PI},sample_s=1e-4}}": "a sample takes at least a step",
    f"{KIND}.regulation={{{PI},least_N=0,most_N=0}}": "room between least_N and most_N",
    f"{KIND}.regulation={{{PI},controller='os.system'}}": "regulation.controller",
}


@pytest.mark.parametrize("word", REFUSED)
def test_what_cannot_be_is_one_sentence(word: str) -> None:
    with pytest.raises(InputError) as refused:
        load(word)
    assert REFUSED[word] in str(refused.value)


def test_a_mechanism_with_all_its_bodies_has_none() -> None:
    laws = "pantographs.seven_body.laws=[{type='friction',force_N=3}]"
    with pytest.raises(InputError) as refused:
        load_scene("ambrosio2012", [laws, "pantographs.seven_body.motion=all_bodies"])
    assert "reduced to tables only" in str(refused.value)
