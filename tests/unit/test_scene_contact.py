"""The contact table: which keys act with which law, and what a law refuses."""

from __future__ import annotations

import pytest
from scenes import load_scene, problem_of, recorded, resolved

from catenary import InputError
from catenary.solver.problem.contact_laws import HYSTERESIS, HertzLaw, KinematicLaw, LinearLaw

CASE = "en50318_2002"
NO_STIFFNESS = "contact.stiffness_N_per_m="
DAMPED = ["numerics.newmark_gamma=0.55", "numerics.newmark_beta=0.28"]


def test_linear_is_the_default() -> None:
    assert problem_of(load_scene(CASE)).contact == LinearLaw(5e4, 0.0)


@pytest.mark.parametrize("name", HYSTERESIS)
def test_laws_of_impact_have_the_factor_of_their_restitution(name: str) -> None:
    scene = load_scene(
        CASE,
        [f"contact.law={name}", "contact.restitution=0.8", "effects.contact_damping=true"],
    )
    law = problem_of(scene).contact
    assert isinstance(law, HertzLaw)
    assert law.hysteresis == HYSTERESIS[name](0.8)
    assert law.least_speed == 0.1
    # 120 N press 2.4 mm deep into 50 000 N/m, and into the spring of power 1.5.
    assert law.stiffness * (120 / 5e4) ** 1.5 == pytest.approx(120, rel=1e-12)


def test_hertz_s_stiffness_may_be_given_itself() -> None:
    scene = load_scene(
        CASE, ["contact.law=hertz", "contact.hertz_stiffness_N_per_m1_5=2e6", NO_STIFFNESS]
    )
    assert problem_of(scene).contact == HertzLaw(2e6, 1.5, 0.0, 0.1)


def test_kinematic_contact_has_no_loss_to_simulate() -> None:
    scene = load_scene(CASE, ["contact.law=kinematic", NO_STIFFNESS, *DAMPED])
    assert problem_of(scene).contact == KinematicLaw()


@pytest.mark.parametrize(
    "overrides",
    [
        [],
        ["contact.law=hertz"],
        ["contact.law=hertz", "contact.hertz_stiffness_N_per_m1_5=2e6", NO_STIFFNESS],
        ["contact.law=flores", "contact.restitution=0.9", "effects.contact_damping=true"],
        ["contact.law=kinematic", NO_STIFFNESS, *DAMPED],
        ["numerics.coupling=explicit"],
    ],
)
def test_the_resolved_scene_is_the_same_again(overrides: list[str]) -> None:
    scene = load_scene(CASE, overrides)
    again = recorded(scene)
    assert problem_of(again) == problem_of(scene)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["contact.law=flores"], "must give restitution"),
        (["contact.law=flores", "contact.restitution=0.01"], "contact.restitution is 0.01"),
        (
            ["contact.law=flores", "contact.restitution=0.9"],
            "it acts only with effects.contact_damping = true",
        ),
        (
            ["contact.law=flores", "contact.restitution=1", "effects.contact_damping=true"],
            "needs a value below 1",
        ),
        (["contact.restitution=0.9"], "must not have restitution with law"),
        (["contact.law=kinematic"], "must not have stiffness_N_per_m"),
        (["contact.law=kinematic", NO_STIFFNESS], "needs at least 0.55"),
        (
            ["contact.law=kinematic", NO_STIFFNESS, *DAMPED, "numerics.coupling=explicit"],
            "take implicit",
        ),
        (
            ["contact.law=kinematic", NO_STIFFNESS, *DAMPED, "numerics.scheme=fixed_point"],
            "take one_solve",
        ),
        (
            ["contact.law=kinematic", NO_STIFFNESS, "train.start_below_m=0.1"],
            "no gap that a head could rise through",
        ),
        (["contact.law=hertz", "effects.contact_loss=false"], "has no force that pulls"),
        (["contact.law=hertz", "effects.contact_damping=true"], "has no damping"),
        (["effects.contact_damping=true"], "needs a value greater than 0"),
        (["contact.damping_N_s_per_m=50"], "acts only with effects.contact_damping = true"),
        (["contact.law=hertz", "contact.hertz_stiffness_N_per_m1_5=2e6"], "not both"),
        (["contact.law=herz"], "contact.law is"),
        (["contact.restitutoin=0.9"], "did you mean contact.restitution?"),
        (["numerics.coupling=implicit", "numerics.scheme=fixed_point"], "must not have coupling"),
        (["numerics.coupling=loose"], "numerics.coupling is"),
        (
            ["numerics.iterations=6"],
            "must not have iterations with scheme one_solve, but with fixed_point only",
        ),
        (
            ["numerics.scheme=fixed_point", "numerics.iterations=6", "numerics.max_iterations=9"],
            "takes iterations or max_iterations",
        ),
        (["numerics.scheme=fixed_point", "numerics.iterations=0"], "numerics.iterations is 0"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_sentence(overrides: list[str], words: str) -> None:
    with pytest.raises(InputError) as refused:
        load_scene(CASE, overrides)
    sentence = str(refused.value)
    assert words in sentence and "\n" not in sentence


def test_a_scene_with_a_number_of_iterations_can_be_resolved_and_read_again() -> None:
    """A restart reads the resolved scene, which holds all defaults."""
    words = ["numerics.scheme=fixed_point", "numerics.iterations=6"]
    scene = load_scene("en50318_2002", words)
    plain = resolved(scene)
    assert plain["numerics"]["iterations"] == 6
    assert "max_iterations" not in plain["numerics"]
    assert type(scene.numerics).model_validate(plain["numerics"]) == scene.numerics
    assert problem_of(scene).numerics.iterations == 6
    assert resolved(load_scene("en50318_2002"))["numerics"]["max_iterations"] == 50
