"""How the line ends, as a scene says it: keys, defaults, sentences, and what the plan tells."""

from __future__ import annotations

from typing import Any

import pytest
from scenes import load_scene, problem_of, with_words

import catenary
from catenary import InputError
from catenary.cases.run.arrivals import arrival_facts
from catenary.solver.problem.ends import AbsorbingLayer, Fixed, Periodic

END = "line.ends.end"
LAYER = f"{END}.kind=absorbing_layer"
PERIODIC = f"{END}.kind=periodic"
LONG = "line.n_spans=40"


def test_lines_are_fixed_unless_the_scene_says_otherwise() -> None:
    assert problem_of(load_scene("en50318_2002")).ends == (Fixed(), Fixed())


def test_a_layer_has_usual_spans_and_damping_and_may_have_others() -> None:
    assert problem_of(load_scene("en50318_2002", [LONG, LAYER])).ends[1] == AbsorbingLayer(20, 1.5)
    own = [LONG, LAYER, f"{END}.spans=8", f"{END}.damping_per_s=3.5"]
    assert problem_of(load_scene("en50318_2002", own)).ends == (Fixed(), AbsorbingLayer(8, 3.5))


def test_a_line_may_go_on_where_no_dropper_breaks() -> None:
    broken = "incidents=[{type='dropper_break', at_s=1, span=20, dropper=2}]"
    assert problem_of(load_scene("en50318_2002", [PERIODIC, broken])).ends[1] == Periodic()


@pytest.mark.parametrize(
    ("assignments", "sentence"),
    [
        ([f"{END}.kind=dashpot"], "it must not be dashpot: matched dashpots sqrt.* 0.26 to 0.84"),
        ([f"{END}.kind=tensioner"], "kind says what becomes of vertical waves"),
        ([f"{END}.kind=free"], "it must be fixed, absorbing_layer or periodic"),
        ([f"{END}.kind=3"], "line.ends.end.kind"),
        ([f"{END}.spans=4"], "takes spans with kind absorbing_layer, not with fixed"),
        ([f"{END}.damping_per_s=4"], "takes damping_per_s with kind absorbing_layer"),
        ([LAYER, f"{END}.spans=0"], "it must be at least 1"),
        ([LAYER, f"{END}.damping_per_s=-1"], "it must be greater than 0"),
        ([LAYER, f"{END}.spans=22"], "the line has 22 spans"),
        ([LAYER, f"{END}.spans=13"], r"into the evaluated stretch \(evaluation.to_m = 600\)"),
        (
            ["line.ends.start.kind=absorbing_layer", "line.ends.start.spans=7"],
            r"reaches to 420 m, into the evaluated stretch \(evaluation.from_m = 360\)",
        ),
        ([PERIODIC, f"{END}.spans=4"], "takes spans with kind absorbing_layer, not with periodic"),
        ([PERIODIC, "numerics.adaptive_tolerance_N=1"], "adaptive_tolerance_N must not be given"),
        (
            [PERIODIC, "line.transition.n_spans_end=2"],
            "line.transition.n_spans_end must be 0, not 2",
        ),
        (
            [
                PERIODIC,
                "line.span_m=[60, 62]",
                "line.dropper.positions_m=",
                "line.dropper.count=8",
                "line.dropper.spacing_m=6.5",
            ],
            "must have one length .line.span_m., not 60 and 62 m",
        ),
        (
            [PERIODIC, "incidents=[{type='tension_loss', at_s=1, wire='contact_wire', share=0.8}]"],
            "which incidents.0 lets wires do",
        ),
        (
            [PERIODIC, "incidents=[{type='dropper_break', at_s=1, span=21, dropper=2}]"],
            "incidents.0 breaks a dropper .span 21",
        ),
        (
            ["line.ends.middle.kind=fixed"],
            "line.ends.middle.kind .* is unknown; did you mean line.ends.end.kind",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(assignments: list[str], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence) as refused:
        load_scene("en50318_2002", assignments)
    assert "\n" not in str(refused.value)


def test_plan_and_arrivals_tell_how_the_line_ends() -> None:
    short = load_scene("en50318_2002", ["line.n_spans=16", "evaluation.to_m=900"])
    fixed = arrival_facts(short, problem_of(short))
    assert any("reflection from the end of the line" in text for text in fixed["warnings"])
    words = ["line.n_spans=16", "evaluation.to_m=700", LAYER, f"{END}.spans=4"]
    scene = load_scene("en50318_2002", words)
    facts = arrival_facts(scene, problem_of(scene))
    assert not any("reflection" in text for text in facts["warnings"])
    (inside,) = (text for text in facts["warnings"] if "inside the absorbing layer" in text)
    assert "begins at 720 m" in inside
    assert facts["pantographs"][0]["far_end_met_at_m"] is None
    assert "end 4 spans that absorb waves" in str(catenary.plan(with_words("en50318_2002", words)))


def test_the_far_end_is_not_met_where_a_window_ends_before_it() -> None:
    """Fixed ends far beyond a window of some spans reflect nothing that the train meets."""
    line = ["line.n_spans=60", "evaluation.to_m=2700", "window.mode=bounded"]
    window = ["window.spans_ahead=5", "window.spans_behind=5"]

    def facts(words: list[str]) -> dict[str, Any]:
        scene = load_scene("en50318_2002", words)
        return arrival_facts(scene, problem_of(scene))

    whole, moving = facts(line[:2]), facts([*line, *window])
    assert any("reflection from the end of the line" in text for text in whole["warnings"])
    assert not any("reflection" in text for text in moving["warnings"])
    by_motion = facts([*line, "window.tolerance=1e-6"])
    assert by_motion["warnings"] == whole["warnings"]
    # A window that reaches the end under way: what is reflected from then on is met later.
    wide = facts([*line, "window.spans_ahead=24", "window.spans_behind=5"])
    (at,) = (one["far_end_met_at_m"] for one in wide["pantographs"])
    assert at is not None and at > whole["pantographs"][0]["far_end_met_at_m"]
