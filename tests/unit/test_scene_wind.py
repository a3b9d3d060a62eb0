"""Keys of the wind: a calm among windy variants, and cross wind on pantographs."""

from __future__ import annotations

import pytest
from scenes import load_scene, problem_of

from catenary import InputError
from catenary.cases.run.description import kind_lines
from catenary.solver.effects.all_effects import active

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
