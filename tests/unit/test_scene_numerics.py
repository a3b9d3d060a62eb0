"""Contact, steps that adapt and windows in a scene: keys, what they become, what is refused."""

from __future__ import annotations

import pytest
from scenes import load_scene, problem_of, recorded, resolved, with_words

import catenary
from catenary import InputError
from catenary.solver.problem.contact_laws import HYSTERESIS, HertzLaw, KinematicLaw, LinearLaw
from catenary.solver.problem.problem import WindowChoice
from catenary.solver.window.choice import estimated_error

# --- the contact table ----------------------------------------------------------------------------


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


# --- keys of steps that adapt ---------------------------------------------------------------------


GIVEN = ("numerics.adaptive_tolerance_N=0.5", "numerics.smallest_dt_s=1e-4")


def test_keys_of_steps_reach_the_problem() -> None:
    numerics = problem_of(load_scene("en50318_2002", GIVEN)).numerics
    assert (numerics.adaptive_tolerance, numerics.smallest_dt) == (0.5, 1e-4)
    plain = problem_of(load_scene("en50318_2002")).numerics
    assert (plain.adaptive_tolerance, plain.smallest_dt) == (None, None)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (GIVEN[1:], "must not have smallest_dt_s without adaptive_tolerance_N"),
        ((GIVEN[0], "numerics.smallest_dt_s=6e-4"), "from dt_s / 4096 to dt_s / 2"),
        ((GIVEN[0], "numerics.smallest_dt_s=2e-7"), "from dt_s / 4096 to dt_s / 2"),
        (("numerics.adaptive_tolerance_N=0",), "greater than 0"),
        (
            (*GIVEN, "contact.law=kinematic", "contact.stiffness_N_per_m=",
             "numerics.newmark_gamma=0.55", "numerics.newmark_beta=0.28"),
            "contact.law kinematic has no stiffness to estimate an error with",
        ),
    ],
)  # fmt: skip
def test_steps_that_cannot_be_are_refused(words: tuple[str, ...], says: str) -> None:
    with pytest.raises(InputError, match=says):
        load_scene("en50318_2002", words)


# --- keys of the window ---------------------------------------------------------------------------


BOUNDED = "window.mode=bounded"
AHEAD, BEHIND = "window.spans_ahead=6", "window.spans_behind=4"


def test_keys_of_the_window_reach_the_problem() -> None:
    def window(*keys: str) -> WindowChoice:
        return problem_of(load_scene("en50318_2002", keys)).window

    assert not window().moves
    assert window("window.mode=exact").mode == "exact"
    assert window(BOUNDED, "window.tolerance=1e-6").by_motion == 1e-6
    spans = window(BOUNDED, AHEAD, BEHIND)
    assert (spans.by_motion, spans.spans_ahead, spans.spans_behind) == (0.0, 6.0, 4.0)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("window.mode=short",), "window.mode .* must be off, exact or bounded"),
        (
            ("window.tolerance=1e-6",),
            "must not have tolerance with mode off, but with bounded only",
        ),
        (
            ("window.mode=exact", AHEAD),
            "must not have spans_ahead with mode exact, but with bounded only",
        ),
        ((BOUNDED, "window.tolerance=0.1"), "window.tolerance .* must be at most 0.01"),
        ((BOUNDED, "window.spans_ahead=1", BEHIND), "window.spans_ahead .* must be at least 2"),
        ((BOUNDED, "window.spans_behind=0", AHEAD), "window.spans_behind .* must be at least 2"),
        ((BOUNDED, AHEAD), "needs spans_ahead and spans_behind together, but only has spans_ahead"),
        ((BOUNDED, AHEAD, BEHIND, "window.tolerance=1e-6"), "takes tolerance or spans_ahead"),
        ((BOUNDED, "numerics.scheme=fixed_point"), "window.mode is .*bounded.* it must be off, as"),
        (("window.mode=exact", "numerics.coupling=explicit"), "it must be off, as .* explicit"),
    ],
)
def test_a_window_that_cannot_be_is_refused(words: tuple[str, ...], says: str) -> None:
    with pytest.raises(InputError, match=says) as refused:
        load_scene("en50318_2002", words)
    assert len(str(refused.value).splitlines()) == 1


def test_spans_follow_from_damping_and_speed() -> None:
    """Waves that fade within a span need few of them; the estimate falls with each further one."""

    def ahead(case: str, *keys: str) -> float:
        return problem_of(load_scene(case, (BOUNDED, *keys))).window.spans_ahead

    assert ahead("en50318_2002") == 22
    assert ahead("en50318_2002", "train.speed_km_h=300") < 22
    light = ahead("ambrosio2012", "line.damping.alpha_s=0.00275")
    assert ahead("ambrosio2012") <= light < 10
    problem = problem_of(load_scene("en50318_2002", (BOUNDED,)))
    errors = [estimated_error(problem, n, 0.8 * n) for n in (4, 10, 20, 30, 40)]
    assert errors == sorted(errors, reverse=True)
    assert errors[3] < 0.1
    # Twice the wave speed of 121.7 m/s times a span of 60 m.
    assert abs(problem.window.fading / (2.0 * 121.7 * 60.0) - 1.0) < 1e-3
    assert light_fading() == 0.0


def light_fading() -> float:
    return problem_of(load_scene("ambrosio2012", (BOUNDED,))).window.fading


def test_the_plan_says_what_moves() -> None:
    assert "window" not in str(catenary.plan("en50318_2002"))
    bounded = str(catenary.plan(with_words("en50318_2002", (BOUNDED, AHEAD, BEHIND))))
    assert "6 spans move ahead of the train and 4 behind" in bounded
    assert "% of its standard deviation (estimate)" in bounded
    assert "what the line's own ends send back from beyond is left out" in bounded
    exact = str(catenary.plan(with_words("en50318_2002", ["window.mode=exact"])))
    assert "whatever a wave has reached moves" in exact
