"""Incidents of scenes: in SI units, told in order of time, left out with their effects."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import Scene, load_scene, problem_of, recorded, with_words

import catenary
from catenary import InputError
from catenary.cases.run.description import incident_facts
from catenary.cases.run.scene_mesh import mesh_of
from catenary.mbs.head.stepping import Lowering
from catenary.meshgen.line import DropperPlace
from catenary.solver.problem.defects import DropperBreak, TensionLoss
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.statics.rest_nearby import errors_of_length

INCIDENTS = (
    "incidents=[{type='lowering',at_s=3.0004,force_N=-75.0,drop_m=0.25},"
    "{type='dropper_break',at_s=2.0,span=5,dropper=3},"
    "{type='tension_loss',at_s=2.5,wire='messenger_wire',share=0.8}]"
)
KINDS = ("dropper_break", "tension_loss", "lowering")


def scene(*more: str) -> Scene:
    return load_scene("en50318_2002", [INCIDENTS, *more])


def test_incidents_are_converted_and_rounded_to_steps() -> None:
    problem = problem_of(scene())
    # Spans of 60 m, the third dropper at 17 m.
    assert problem.incidents == (
        DropperBreak(2.0, DropperPlace(4 * 60.0 + 17.0)),
        TensionLoss(2.5, "messenger_wire", 0.8),
    )
    assert problem.train.placements[0].lowering == Lowering(3.0, -75.0, 0.2, 0.25)
    coarse = problem_of(scene("numerics.dt_s=4e-3"))
    assert [incident.time for incident in coarse.incidents] == pytest.approx([2.0, 2.5])
    assert coarse.train.placements[0].lowering.time == pytest.approx(3.0)
    rounded = problem_of(scene("numerics.dt_s=3e-3"))
    assert rounded.incidents[0].time == pytest.approx(667 * 3e-3)


def test_a_resolved_scene_is_the_same_again() -> None:
    first = scene()
    again = recorded(first)
    assert problem_of(again) == problem_of(first)
    assert len(again.incidents) == 3


def test_one_key_of_an_incident_is_changed() -> None:
    assert problem_of(scene("incidents.1.dropper=9")).incidents[0].place.x == 4 * 60.0 + 55.0


def test_the_plan_tells_incidents_in_order_of_time() -> None:
    text = str(catenary.plan(with_words("en50318_2002", [INCIDENTS])))
    simulated, _ = text.split("Not simulated:")
    assert all(kind in simulated for kind in KINDS)
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


@pytest.mark.parametrize("kind", KINDS)
def test_an_effect_that_is_left_out_is_not_told(kind: str) -> None:
    words = [INCIDENTS, f"effects.{kind}=false"]
    found = load_scene("en50318_2002", words)
    told = [fact["type"] for fact in incident_facts(found, problem_of(found))]
    assert sorted([*told, kind]) == sorted(KINDS)
    plan = catenary.plan(with_words("en50318_2002", words))
    assert plan.effects.simulated[kind] is False
    assert str(plan).count("\n  incident") == 2


def test_an_incident_that_cannot_be_is_told_beside_a_chosen_effect() -> None:
    """Whether an effect has something to act on is asked of sound scenes only."""
    with pytest.raises(InputError, match=r"incidents\.1\.span is 622"):
        scene("effects.contact_loss=true", "incidents.1.span=622")


def test_a_dropper_that_breaks_has_its_place() -> None:
    found = scene()
    facts = incident_facts(found, problem_of(found))
    assert [fact.get("at_m") for fact in facts] == [257.0, None, None]


def test_without_incidents_there_are_no_effects_of_them() -> None:
    plan = catenary.plan("en50318_2002")
    for kind in KINDS:
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
