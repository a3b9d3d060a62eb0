"""Ready pantographs: their data beside those of shipped cases, and how a scene names one."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from scenes import load_scene, problem_of, scene_from
from verb_runner import invoke

from catenary import InputError
from catenary.cases.scene.train.pantograph import Ready
from catenary.mbs.lumped import READY, LumpedData

# Which case states the same pantograph.
IN_CASES = {
    "en50318_2002": ("en50318_2002", "reference"),
    "en50318_2018": ("ac_simple", "three_masses"),
    "ambrosio2012": ("ambrosio2012", "lumped"),
}


def with_model(*words: str) -> list[str]:
    return ["pantographs.ready.model=dsa380", "train.pantographs.0.name=ready", *words]


@pytest.mark.parametrize("name", IN_CASES)
def test_cases_state_the_same_numbers(name: str) -> None:
    case, kind = IN_CASES[name]
    scene = load_scene(case, [f"train.pantographs.0.name={kind}"])
    assert problem_of(scene).train.placements[0].data == READY[name].chain


def test_a_scene_takes_chain_and_force() -> None:
    """DSA380 at 300 km/h: 70 + 0.00095 300^2 + 0.0017 300 - 0.2 = 155.81 N."""
    place = problem_of(load_scene("ac_simple", with_model("train.speed_km_h=300"))).train.placements
    assert place[0].data == LumpedData((7.12, 6.0, 5.8), (9430.0, 14100.0, 0.1), (0.0, 0.0, 70.0))
    assert place[0].static_force == pytest.approx(155.81)


def test_the_air_only_lifts() -> None:
    """The law is negative below 13.6 km/h."""
    dsa = READY["dsa380"]
    assert dsa.force_at(5.0) == 70.0
    assert np.isclose(float(dsa.force_at(20.0) or 0.0), 70.0 + 0.00095 * 400.0 + 0.034 - 0.2)


def test_every_ready_pantograph_has_its_name_in_the_schema() -> None:
    assert get_args(Ready) == tuple(READY)


def test_own_force_wins() -> None:
    scene = load_scene("ac_simple", with_model("pantographs.ready.static_force_N=80"))
    assert problem_of(scene).train.placements[0].static_force == 80.0


def test_the_scene_of_a_result_is_the_same_again() -> None:
    scene = load_scene("ac_simple", with_model())
    recorded = replace(scene.origin, recorded=True)  # with every key, as results have them
    again = scene_from(scene.model_dump(mode="json", exclude_none=True), recorded)
    assert problem_of(again) == problem_of(scene)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["pantographs.ready.model=dsa38"], "it must be en50318_2002, en50318_2018, dsa380 or"),
        (["pantographs.ready.model=[1]"], "pantographs.ready.model is"),
        (["pantographs.ready.masses_kg=[7.0, 6.0, 5.8]"], 'masses_kg beside model = "dsa380"'),
        (["pantographs.ready.model=en50318_2018"], "exactly one of static_force_N"),
        (["pantographs.ready.type=multibody"], "does not belong to type multibody"),
    ],
)
def test_what_cannot_be_is_one_sentence(words: list[str], said: str) -> None:
    with pytest.raises(InputError) as refused:
        load_scene("ac_simple", with_model(*words))
    assert said in str(refused.value)


def test_the_list_names_all_with_their_sources() -> None:
    told = invoke("list", "--pantographs")
    assert told.exit_code == 0
    for name, ready in READY.items():
        assert name in told.output.splitlines()
        assert ready.source in told.output
    both = invoke("list", "--pantographs", "--keys")
    assert both.exit_code == 2
