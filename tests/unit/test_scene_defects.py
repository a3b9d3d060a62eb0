"""Defects of scenes: in SI units, told in plan, result and summary, left out with their effects."""

from __future__ import annotations

import math

import pytest
from scenes import Scene, line_data_of, load_scene, mesh_of, problem_of, recorded, with_words

import catenary
from catenary.cases.run.description import defect_facts
from catenary.meshgen.line import DropperPlace, Fittings
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.solver.effects import all_effects
from catenary.solver.problem.defects import (
    HardSpot,
    Heights,
    HeightSpectrum,
    Kink,
    LengthErrors,
    LooseClamp,
    MissingDropper,
    WornWire,
    WrongTension,
)

KINDS = ("missing_dropper", "loose_clamp", "worn_wire", "wrong_tension", "hard_spot", "kink")
DEFECTS = (
    "defects=[{type='missing_dropper',span=5,dropper=3},{type='loose_clamp',span=6,dropper=1},"
    "{type='worn_wire',from_m=400,to_m=460,lost_share=0.2},"
    "{type='wrong_tension',wire='messenger_wire',factor=0.9},"
    "{type='hard_spot',at_m=500,mass_kg=5},{type='kink',at_m=550,angle_deg=0.5}]"
)
WORDS = (
    DEFECTS,
    "irregularities.contact_wire_height.standard_deviation_mm=10",
    "irregularities.running_surface={by_place=[[100,0],[110,-0.001],[120,0]]}",
    "irregularities.dropper_lengths={standard_deviation_mm=2,by_dropper=[[7,4,-10]]}",
    "line.fittings=[{kind='section_insulator',at_m=600,length_m=1.6,mass_kg=12}]",
)


def scene(*more: str) -> Scene:
    return load_scene("en50318_2002", [*WORDS, *more])


def test_defects_are_converted() -> None:
    problem = problem_of(scene())
    # Spans of 60 m, the first dropper at 5 m, the third at 17 m, the fourth at 23.5 m.
    assert problem.defects == (
        MissingDropper(DropperPlace(4 * 60.0 + 17.0)),
        LooseClamp(DropperPlace(5 * 60.0 + 5.0)),
        WornWire("contact_wire", 400.0, 460.0, 0.2),
        WrongTension("messenger_wire", 0.9),
        HardSpot("contact_wire", 500.0, 5.0, 0.0),
        Kink("contact_wire", 550.0, math.radians(0.5)),
    )
    irregular = problem.irregularities
    assert irregular.heights == Heights((0.0, 1320.0), HeightSpectrum(0.01, 2.0, 12.0, 120.0, 1))
    table = ((100.0, 0.0), (110.0, -0.001), (120.0, 0.0))
    assert irregular.surface == Heights((0.0, 1320.0), None, table)
    assert irregular.lengths == LengthErrors(
        0.002, 2.5, 1, ((DropperPlace(6 * 60.0 + 23.5), -0.01),)
    )
    assert problem.line.fittings == (
        Fittings("section_insulator", "contact_wire", (600.0, 601.6), (6.0, 6.0)),
    )


def test_a_resolved_scene_is_the_same_again() -> None:
    first = scene()
    again = recorded(first)
    assert problem_of(again) == problem_of(first)
    assert len(again.defects) == 6


def test_a_seed_is_a_key_of_its_own() -> None:
    seeds = [
        problem_of(scene(f"irregularities.contact_wire_height.seed={seed}")).irregularities.heights
        for seed in (1, 2)
    ]
    assert seeds[0] is not None and seeds[1] is not None and seeds[0] != seeds[1]
    assert seeds[1].spectrum is not None and seeds[1].spectrum.seed == 2


def test_the_plan_tells_defects_and_what_each_effect_leaves_out() -> None:
    text = str(catenary.plan(with_words("en50318_2002", [*WORDS, "mesh.elements_per_gap=1"])))
    simulated, left_out = text.split("Not simulated:")
    names = (*KINDS, "contact_wire_height", "running_surface", "dropper_lengths", "fittings")
    assert all(f"  {name}" in simulated for name in names)
    for says in (
        "droppers are cut for irregular heights of the contact wire: standard deviation 10 mm, "
        "waves of 12 to 120 m",
        "dropper 3 of span 5, at 257 m, is missing",
        "dropper 1 of span 6, at 305 m, has a loose clamp and carries nothing",
        "the contact wire has lost 20 % of its section from 400 to 460 m",
        "the messenger wire hangs with 14.4 kN, 0.9 of what its droppers are cut for",
        "hard spot of 5 kg on the contact wire at 500 m",
        "kink of 0.5 degrees of the contact wire at 550 m",
        "section insulator of 12 kg over 1.6 m on the contact wire at 600 m",
        "errors of the droppers' lengths: standard deviation 2 mm, cut off at 2.5 times that, "
        "seed 1; given for 1 dropper",
    ):
        assert f"  defect     {says}" in text, says
    assert not any(f"  {name} " in left_out for name in KINDS)


@pytest.mark.parametrize("name", [*KINDS, "contact_wire_height", "dropper_lengths", "fittings"])
def test_a_defect_is_left_out_with_its_effect(name: str) -> None:
    given = scene(f"effects.{name}=false")
    problem = problem_of(given)
    told = {fact["type"] for fact in defect_facts(given, problem)}
    assert name not in told and len(defect_facts(given, problem)) == 9
    assert name not in [effect.name for effect in all_effects.active(problem)]


def test_a_sound_scene_has_nothing_of_it() -> None:
    """No table, no wire that is worn, no cut of the mesh, no second form finding."""
    sound = load_scene("en50318_2002", ["line.n_spans=9", "train.end_m=450", "evaluation.to_m=430"])
    problem = problem_of(sound)
    assert defect_facts(sound, problem) == []
    assert problem.line == make_line(line_data_of(sound))
    assert all_effects.after_cutting(problem) == []
    assert all_effects.with_defects(problem) is problem
    wrong = load_scene(
        "en50318_2002",
        [*WORDS[:1], "line.n_spans=9", "train.end_m=450", "evaluation.to_m=430", "defects.5=",
         "defects.4="],
    )  # fmt: skip
    assert mesh_of(wrong).n_nodes == mesh_of(sound).n_nodes
