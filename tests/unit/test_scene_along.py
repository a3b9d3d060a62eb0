"""What holds wires along the track, as a scene says it: keys, defaults, sentences."""

from __future__ import annotations

import pytest
from scenes import load_scene, problem_of

from catenary import InputError
from catenary.solver.problem.ends import AlongTrack, Tensioner

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
def test_what_cannot_be_is_refused_in_a_sentence(assignments: list[str], sentence: str) -> None:
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
