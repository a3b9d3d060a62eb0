"""How the line ends and what holds wires along the track, as a scene says it."""

from __future__ import annotations

from typing import Any

import pytest
from scenes import load_scene, problem_of, with_words

import catenary
from catenary import InputError
from catenary.cases.run.arrivals import arrival_facts
from catenary.solver.problem.ends import AbsorbingLayer, AlongTrack, Fixed, Periodic, Tensioner

# --- how the line ends, as a scene says it --------------------------------------------------------


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


# --- what holds wires along the track, as a scene says it -----------------------------------------


ON = "effects.axial_motion=true"
CONTACT = "line.contact_wire"
STIFF = ["line.contact_wire.axial_stiffness_N=18e6", "line.messenger_wire.axial_stiffness_N=11e6"]
WHOLE = [ON, *STIFF]
TENSIONED = [*WHOLE, "line.ends.end.along=tensioner"]
WRONG = "defects=[{type='wrong_tension',wire='contact_wire',factor=0.9}]"


def test_wires_are_held_along_the_track_unless_the_scene_says_otherwise() -> None:
    problem = problem_of(load_scene("en50318_2002"))
    assert problem.along == AlongTrack() and "axial_motion" not in problem.effects
    assert problem.line.wires[0].axial_stiffness is None


def test_axial_stiffness_is_given_or_that_of_a_section() -> None:
    assert problem_of(load_scene("en50318_2002", WHOLE)).line.wires[0].axial_stiffness == 18e6
    by_section = [f"{CONTACT}.section_mm2=150", f"{CONTACT}.youngs_modulus_GPa=120"]
    wire = problem_of(load_scene("en50318_2002", by_section)).line.wires[0]
    assert wire.axial_stiffness == pytest.approx(18e6, rel=1e-14)


def test_a_tensioner_has_all_that_the_scene_gives() -> None:
    given = [
        "line.tensioner.ratio=4",
        "line.tensioner.efficiency=0.97",
        "line.tensioner.travel_m=0.6",
        "line.tensioner.weights_kg.contact_wire=510",
        "line.mid_points_m=[660]",
        "line.ends.start.along=tensioner",
    ]
    along = problem_of(load_scene("en50318_2002", [*TENSIONED, *given])).along
    tensioner = Tensioner(4.0, 0.97, 0.6, 1e6, {"contact_wire": 510.0})
    assert along == AlongTrack(tensioner, True, True, True, (660.0,))


@pytest.mark.parametrize(
    ("assignments", "sentence"),
    [
        ([ON], r"line.contact_wire .contact wire. .* has no axial stiffness; give it axial_stiff"),
        ([ON, *STIFF[:1]], "line.messenger_wire .* has no axial stiffness"),
        ([f"{CONTACT}.axial_stiffness_N=0"], "it must be greater than 0"),
        ([f"{CONTACT}.section_mm2=150"], "needs section_mm2 and youngs_modulus_GPa together"),
        (
            [*STIFF, f"{CONTACT}.section_mm2=150", f"{CONTACT}.youngs_modulus_GPa=120"],
            "takes axial_stiffness_N or section_mm2, but both are given",
        ),
        (["line.ends.start.along=tensioner"], "acts only with effects.axial_motion = true"),
        (
            ["line.tensioner.ratio=4"],
            "line.tensioner .* has ratio, but no wire ends at a tensioner",
        ),
        (
            [*WHOLE, "line.tensioner={efficiency=0.9, travel_m=1}"],
            r"has efficiency, travel_m, but no wire ends at a tensioner: line.ends.start.along or",
        ),
        (
            [*WHOLE, "line.ends.end.along=tensioner", "line.tensioner.stop_stiffness_N_per_m=1e5"],
            "stop_stiffness_N_per_m is 100000 N/m .* acts only with line.tensioner.travel_m",
        ),
        (["line.mid_points_m=[660]"], "acts only with effects.axial_motion = true"),
        (["line.temperature.difference_K=20"], "acts only with effects.axial_motion = true"),
        ([*WHOLE, "line.temperature.difference_K=200"], "it must be at most 150"),
        ([*WHOLE, f"{CONTACT}.expansion_per_K=-1"], "it must be at least 0"),
        (["line.ends.start.along=free"], "it must be fixed or tensioner"),
        (
            [*TENSIONED, "line.ends.start.along=tensioner"],
            "from 0 to 1320 m would have tensioners at both ends .* line.mid_points_m",
        ),
        ([*WHOLE, "line.mid_points_m=[660, 660]"], "mid_points_m.1 is 660 m .* listed twice"),
        ([*WHOLE, "line.mid_points_m=[650]"], "stands at a mast .* such as 660 m"),
        ([*TENSIONED, "line.tensioner.ratio=0.5"], "it must be at least 1"),
        ([*TENSIONED, "line.tensioner.efficiency=1.1"], "it must be at most 1"),
        ([*TENSIONED, "line.tensioner.travel_m=-1"], "it must be greater than 0"),
        ([*TENSIONED, "line.tensioner.weights_kg.stitch=700"], "the line has contact_wire"),
        (
            [*TENSIONED, "line.tensioner.weights_kg.contact_wire=700"],
            r"would hold 20601 N .* has 20000 N, which 679\.579 kg hold",
        ),
        (
            [*TENSIONED, "line.tensioner.weights_kg.contact_wire=679.579", WRONG],
            r"would hold 20000 N .* has 18000 N, which 611\.621 kg hold",
        ),
        ([*WHOLE, "line.ends.end.kind=periodic"], "ends fixed or in an absorbing_layer"),
        ([*WHOLE, "window.mode=bounded"], "waves along the track run far ahead"),
        (
            [*WHOLE, "line.stagger_m=[0.2]"],
            "line.steady_arm.length_m is 0 m .* swings about its hinge: it must be greater than 0",
        ),
    ],
)
def test_what_cannot_hold_wires_along_the_track_is_refused(
    assignments: list[str], sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence) as refused:
        load_scene("en50318_2002", assignments)
    assert all(line for line in str(refused.value).splitlines())


def test_weights_are_those_of_the_tension_with_which_a_wire_hangs() -> None:
    """A wrong one has wrong weights."""
    weights = "line.tensioner.weights_kg.contact_wire=611.621"
    along = problem_of(load_scene("en50318_2002", [*TENSIONED, weights, WRONG])).along
    assert along.tensioner.weights == {"contact_wire": 611.621}


def test_data_may_stay_where_the_effect_is_left_out() -> None:
    given = ["effects.axial_motion=false", *STIFF, "line.ends.end.along=tensioner"]
    assert "axial_motion" not in problem_of(load_scene("en50318_2002", given)).effects


def test_inside_an_overlap_wires_have_tensioners() -> None:
    held = ["line.mid_points_m="]
    stiff = [
        "line.contact_wire.axial_stiffness_N=18e6",
        "line.messenger_wire.axial_stiffness_N=1e7",
    ]
    assert problem_of(load_scene("overlap", [ON, *stiff, *held])).along.overlap
    fixed = load_scene("overlap", [ON, *stiff, "line.overlap.along=fixed"])
    assert not problem_of(fixed).along.overlap
    with pytest.raises(InputError, match="line.overlap.along is .tensioner"):
        load_scene("overlap", [ON, *stiff, "line.ends.start.along=tensioner"])
