"""Defects, incidents and wind of scenes: in SI units, told, left out with their effects."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scenes import Scene, line_data_of, load_scene, mesh_of, problem_of, recorded, with_words

import catenary
from catenary import InputError
from catenary.cases.run.description import defect_facts, incident_facts, kind_lines
from catenary.mbs.head.stepping import Lowering
from catenary.meshgen.line import DropperPlace, Fittings
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.solver.effects import all_effects
from catenary.solver.effects.all_effects import active
from catenary.solver.problem.defects import (
    DropperBreak,
    HardSpot,
    Heights,
    HeightSpectrum,
    Kink,
    LengthErrors,
    LooseClamp,
    MissingDropper,
    TensionLoss,
    WornWire,
    WrongTension,
)
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.statics.rest_nearby import errors_of_length

# --- defects of scenes ----------------------------------------------------------------------------


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


def with_defects(*more: str) -> Scene:
    return load_scene("en50318_2002", [*WORDS, *more])


def test_defects_are_converted() -> None:
    problem = problem_of(with_defects())
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
    first = with_defects()
    again = recorded(first)
    assert problem_of(again) == problem_of(first)
    assert len(again.defects) == 6


def test_a_seed_is_a_key_of_its_own() -> None:
    seeds = [
        problem_of(
            with_defects(f"irregularities.contact_wire_height.seed={seed}")
        ).irregularities.heights
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
    given = with_defects(f"effects.{name}=false")
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


# --- incidents of scenes --------------------------------------------------------------------------


INCIDENTS = (
    "incidents=[{type='lowering',at_s=3.0004,force_N=-75.0,drop_m=0.25},"
    "{type='dropper_break',at_s=2.0,span=5,dropper=3},"
    "{type='tension_loss',at_s=2.5,wire='messenger_wire',share=0.8}]"
)
INCIDENT_KINDS = ("dropper_break", "tension_loss", "lowering")


def with_incidents(*more: str) -> Scene:
    return load_scene("en50318_2002", [INCIDENTS, *more])


def test_incidents_are_converted_and_rounded_to_steps() -> None:
    problem = problem_of(with_incidents())
    # Spans of 60 m, the third dropper at 17 m.
    assert problem.incidents == (
        DropperBreak(2.0, DropperPlace(4 * 60.0 + 17.0)),
        TensionLoss(2.5, "messenger_wire", 0.8),
    )
    assert problem.train.placements[0].lowering == Lowering(3.0, -75.0, 0.2, 0.25)
    coarse = problem_of(with_incidents("numerics.dt_s=4e-3"))
    assert [incident.time for incident in coarse.incidents] == pytest.approx([2.0, 2.5])
    assert coarse.train.placements[0].lowering.time == pytest.approx(3.0)
    rounded = problem_of(with_incidents("numerics.dt_s=3e-3"))
    assert rounded.incidents[0].time == pytest.approx(667 * 3e-3)


def test_a_resolved_scene_has_the_same_incidents() -> None:
    first = with_incidents()
    again = recorded(first)
    assert problem_of(again) == problem_of(first)
    assert len(again.incidents) == 3


def test_one_key_of_an_incident_is_changed() -> None:
    assert (
        problem_of(with_incidents("incidents.1.dropper=9")).incidents[0].place.x == 4 * 60.0 + 55.0
    )


def test_the_plan_tells_incidents_in_order_of_time() -> None:
    text = str(catenary.plan(with_words("en50318_2002", [INCIDENTS])))
    simulated, _ = text.split("Not simulated:")
    assert all(kind in simulated for kind in INCIDENT_KINDS)
    first, second, third = (line for line in text.splitlines() if line.startswith("  incident"))
    assert "at 2 s: dropper 3 of span 5, at 257 m, breaks" in first
    assert (
        "at 2.5 s: the tension of the messenger wire falls to 12.8 kN, 0.8 of what it was" in second
    )
    assert "at 3 s: pantograph 1 is lowered" in third and "-75 N within 0.2 s" in third


@pytest.mark.parametrize(
    ("words", "says"),
    [
        # 60 N over 50 N/m would be 1.2 m.
        ([], "its head is caught 0.4 m lower"),
        (["pantographs.reference.stiffnesses_N_per_m=[4200,160]"], "holds its head at rest less"),
        (
            ["pantographs.reference.aerodynamics={uplift_polynomial=[0,0,0.001]}"],
            "the air lifts it with 62.5 N, so that it stays up",  # 0.001 * 250^2
        ),
        (
            ["pantographs.reference.aerodynamics={uplift_polynomial=[0,0,0.001]}"]
            + ["effects.pantograph_aerodynamics=false"],
            "its head is caught 0.4 m lower",
        ),
    ],
)
def test_the_plan_tells_what_becomes_of_a_head_that_is_lowered(words: list[str], says: str) -> None:
    lowered = 'incidents=[{type="lowering",at_s=3.0}]'
    found = load_scene("en50318_2002", [lowered, *words])
    (fact,) = incident_facts(found, problem_of(found))
    assert says in fact["says"]


@pytest.mark.parametrize("kind", INCIDENT_KINDS)
def test_an_effect_that_is_left_out_is_not_told(kind: str) -> None:
    words = [INCIDENTS, f"effects.{kind}=false"]
    found = load_scene("en50318_2002", words)
    told = [fact["type"] for fact in incident_facts(found, problem_of(found))]
    assert sorted([*told, kind]) == sorted(INCIDENT_KINDS)
    plan = catenary.plan(with_words("en50318_2002", words))
    assert plan.effects.simulated[kind] is False
    assert str(plan).count("\n  incident") == 2


def test_an_incident_that_cannot_be_is_told_beside_a_chosen_effect() -> None:
    """Whether an effect has something to act on is asked of sound scenes only."""
    with pytest.raises(InputError, match=r"incidents\.1\.span is 622"):
        with_incidents("effects.contact_loss=true", "incidents.1.span=622")


def test_a_dropper_that_breaks_has_its_place() -> None:
    found = with_incidents()
    facts = incident_facts(found, problem_of(found))
    assert [fact.get("at_m") for fact in facts] == [257.0, None, None]


def test_without_incidents_there_are_no_effects_of_them() -> None:
    plan = catenary.plan("en50318_2002")
    for kind in INCIDENT_KINDS:
        assert plan.effects.reason[kind] == (
            f"the scene has no data for it: an entry of incidents of type {kind}"
        )
    assert "incident" not in str(plan).split("Simulated:")[0]


def test_a_lost_tension_may_make_a_train_supercritical() -> None:
    words = "incidents=[{type='tension_loss',at_s=2.0,wire='contact_wire',share=0.3}]"
    found = with_words("en50318_2002", [words, "effects.supercritical_speed=true"])
    assert catenary.plan(found).effects.simulated["supercritical_speed"] is True


@pytest.mark.parametrize(
    ("case", "own", "span"),
    [("dc_twin", ("effects.relative_motion=true",), 6), ("overlap", ("line.n_spans=30",), 15)],
)
def test_droppers_of_two_wires_at_one_place_have_numbers_of_their_own(
    case: str, own: tuple[str, ...], span: int
) -> None:
    """Twin wires, and two tension sections side by side, have two droppers at one place: the
    numbers 3 and 4 once meant one of them, and the other could not be named."""
    scene_of = load_scene(case, [*own])
    rest = line_at_rest(problem_of(scene_of), mesh_of(scene_of))
    lower = rest.mesh.droppers[:, 1]
    wires = []
    for number in (3, 4):
        both = [
            f"incidents=[{{type='dropper_break',at_s=0.1,span={span},dropper={number}}}]",
            f"defects=[{{type='missing_dropper',span={span},dropper={7 - number}}}]",
            f"irregularities.dropper_lengths.by_dropper=[[{span},{number},5.0]]",
        ]
        changed = load_scene(case, [*own, *both])
        problem = problem_of(changed)
        (broken,) = rest.model.droppers_at([problem.incidents[0].place])
        (missing,) = rest.model.droppers_at([problem.defects[0].place])
        (longer,) = np.flatnonzero(errors_of_length(problem, rest.model))
        assert longer == broken != missing
        (fact,) = incident_facts(changed, problem)  # by which films leave it out
        assert DropperPlace(fact["at_m"], fact["nth"]) == problem.incidents[0].place
        assert rest.mesh.x(lower[broken]) == rest.mesh.x(lower[missing])
        wires.append(next(n for n, nodes in rest.mesh.wires.items() if lower[broken] in nodes))
    assert len(set(wires)) == 2, wires


# --- keys of the wind -----------------------------------------------------------------------------


CALM = "wind.speed_m_per_s=0"
FACTOR = "pantographs.three_masses.crosswind_factor"


def test_a_calm_has_no_wind_and_no_gusts() -> None:
    problem = problem_of(load_scene("windy_viaduct", [CALM]))
    still = problem_of(load_scene("windy_viaduct", ["effects.wind=false", "effects.gusts=false"]))
    assert problem.wind is None
    names = {effect.name for effect in active(problem)}
    assert names == {effect.name for effect in active(still)}
    assert not names & {"wind", "gusts"}


def test_effects_of_the_wind_may_stay_on_in_a_calm() -> None:
    words = ["effects.wind=true", "effects.gusts=true"]
    load_scene("windy_viaduct", [CALM, *words])
    # Without the table there is nothing that a variant could switch off.
    with pytest.raises(InputError, match=r"effects\.gusts is true .* acts only with a table"):
        load_scene("windy_viaduct", [CALM, *words, "wind.gusts="])


def test_a_calm_needs_no_diameters_and_a_wind_does() -> None:
    words = ["line.contact_wire.diameter_mm=", "effects.lateral_motion=true"]
    load_scene("windy_viaduct", [CALM, *words])
    with pytest.raises(InputError, match=r"line\.contact_wire\.diameter_mm is missing"):
        load_scene("windy_viaduct", words)


def test_a_wind_of_less_than_no_speed_is_refused() -> None:
    with pytest.raises(InputError, match=r"wind\.speed_m_per_s is -1 .* at least 0"):
        load_scene("windy_viaduct", ["wind.speed_m_per_s=-1"])


@pytest.mark.parametrize(
    ("words", "factor", "said"),
    [
        ([], 0.0, "a cross wind does not change it (crosswind_factor 0)"),
        (
            [f"{FACTOR}=0.4"],
            0.4,
            "0.4 of the square of a cross wind adds to that of the air's speed",
        ),
    ],
)
def test_what_a_cross_wind_counts_is_told_beside_the_pantograph(
    words: list[str], factor: float, said: str
) -> None:
    scene = load_scene("windy_viaduct", words)
    problem = problem_of(scene)
    assert problem.train.placements[0].data.crosswind_factor == factor
    (line,) = kind_lines(scene, problem)["three_masses"]
    assert said in line


def test_in_still_air_nothing_is_told_of_cross_wind() -> None:
    scene = load_scene("windy_viaduct", [CALM])
    (line,) = kind_lines(scene, problem_of(scene))["three_masses"]
    assert "cross wind" not in line


def test_a_factor_of_cross_wind_without_wind_is_refused() -> None:
    load_scene("windy_viaduct", [CALM, f"{FACTOR}=0.5"])  # a variant of a sweep
    with pytest.raises(InputError, match=r"crosswind_factor is 0\.5 .*; there is no wind: give"):
        load_scene("windy_viaduct", ["wind=", f"{FACTOR}=0.5"])


def test_a_factor_of_cross_wind_without_forces_of_the_air_is_refused() -> None:
    with pytest.raises(InputError, match=r"crosswind_factor is 0\.5 .* has no forces on this"):
        load_scene("ac_simple", [f"{FACTOR}=0.5"])
