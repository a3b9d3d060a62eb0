"""A storm over the viaduct: bounded, refused or ended in a sentence, never "done" without one."""

from __future__ import annotations

from pathlib import Path

import pytest
from scenes import with_words

import catenary

SCENE = with_words(
    "windy_viaduct",
    (
        "line.n_spans=14",
        "train.start_m=275",
        "evaluation.from_m=440",
        "evaluation.to_m=550",
        "mesh.elements_per_gap=4",
        "output.field_every_s=0",
    ),
)


def blown(speed: float, **tables: object) -> catenary.Scene:
    """The viaduct in a wind [m/s], with further changes."""
    return SCENE.replace(wind={"speed_m_per_s": speed}, **tables)


def test_contact_goes_on_beside_the_strips_and_is_told() -> None:
    """At 65 m/s the wind holds the wire 0.66 m beside the track's axis, and strips end at 0.6 m: it
    once was out of reach there, and the head came back with 5 kN."""
    run = catenary.run(blown(65.0))
    assert run.outcome == "done"
    assert any("a contact wire leaves the strips" in told for told in run.remarks)
    # Gusts of 0.18 about 65 m/s let the head hop; what hits a wire from below it has kilonewtons.
    assert run.statistics.max_N.iloc[0] < 1000.0
    (place,) = run.verdict[run.verdict.criterion.str.contains("lateral position")].passed
    assert not place


def test_arms_that_are_pushed_so_far_that_they_fold_are_refused(tmp_path: Path) -> None:
    drag = {f"{wire}_wire": {"drag_coefficient": 1.6} for wire in ("contact", "messenger")}
    with pytest.raises(catenary.InputError) as refused:
        catenary.run(blown(80.0, line=drag), tmp_path / "folded")
    assert "the line at rest is unstable near 66" in str(refused.value)
    assert "its wire pushes the steady arm at 660 m with 5" in str(refused.value)
    assert not (tmp_path / "folded" / "run.h5").exists()


def test_pushed_arms_are_told_before_a_run() -> None:
    scene = blown(50.0)
    for told in ("\n".join(catenary.check(scene)), str(catenary.static(scene))):
        assert "wires push 6 of 13 steady arms, the one at 660 m the most, with 13" in told


def test_of_several_wires_one_must_be_above_the_strips() -> None:
    """Of two wires one beside the strips is out of reach: an overlap passes the force so."""
    scene = catenary.load("overlap").replace(
        effects={"lateral_motion": True},
        wind={"speed_m_per_s": 70, "height_m": 6},
        line={"contact_wire.diameter_mm": 14.4, "messenger_wire.diameter_mm": 14},
    )
    with pytest.raises(catenary.InputError) as refused:
        catenary.check(scene)
    assert "at rest the contact wire stands beside the strips at" in str(refused.value)
    assert "strips end at 0.6 m, so that a pantograph would lose it" in str(refused.value)
