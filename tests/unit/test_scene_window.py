"""Keys of the window: what they become, and what is refused."""

from __future__ import annotations

import pytest
from scenes import load_scene, problem_of, with_words

import catenary
from catenary import InputError
from catenary.solver.problem.problem import WindowChoice
from catenary.solver.window.choice import estimated_error

BOUNDED = "window.mode=bounded"
AHEAD, BEHIND = "window.spans_ahead=6", "window.spans_behind=4"


def test_keys_reach_the_problem() -> None:
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
def test_what_cannot_be_is_refused(words: tuple[str, ...], says: str) -> None:
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
