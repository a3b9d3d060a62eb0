"""Incidents that cannot be: one sentence that names key, value and what is allowed; exit code 2."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import SOUND, assert_refused
from verb_runner import invoke

# A sound list, of which an entry is changed at a time.
INCIDENTS = """
[[incidents]]
type = "dropper_break"
at_s = 2.0
span = 5
dropper = 3

[[incidents]]
type = "tension_loss"
at_s = 2.5
wire = "contact_wire"
share = 0.8

[[incidents]]
type = "lowering"
at_s = 3.0
"""

ASSIGNMENTS = {
    "no such kind": (
        ["incidents.0.type=explosion"],
        "incidents.0 on the command line (--set) must be of type dropper_break, tension_loss or "
        "lowering, not explosion",
    ),
    "no kind": (["incidents.0.type="], "incidents.0 on the command line (--set) must have a type"),
    "no such span": (["incidents.0.span=23"], "incidents.0.span is 23"),
    "span 0": (["incidents.0.span=0"], "at least 1"),
    "no such dropper": (["incidents.0.dropper=10"], "span 5 has 9 droppers"),
    "half a dropper": (["incidents.0.dropper=1.5"], "must be a whole number"),
    "dropper of nowhere": (["incidents.0.span="], "incidents.0.span (number of its span"),
    "a dropper twice": (
        ["incidents.3={type='dropper_break',at_s=4.0,span=5,dropper=3}"],
        "incidents.3.dropper is 3 on the command line (--set); this happens in incidents.0 already",
    ),
    "before the start": (["incidents.0.at_s=-0.1"], "at least 0 [s]"),
    "after the end": (["incidents.0.at_s=100"], "at most 10.799 s, a step before the run ends"),
    "in the last step": (["incidents.0.at_s=10.7996"], "at most 10.799 s"),
    "at no time": (["incidents.1.at_s=nan"], "a finite number [s]"),
    "no such wire": (["incidents.1.wire=third_rail"], "the line has contact_wire, messenger_wire"),
    "share of one": (["incidents.1.share=1"], "must be less than 1"),
    "share of nothing": (["incidents.1.share=0"], "must be at least 0.01"),
    "negative share": (["incidents.1.share=-0.5"], "must be at least 0.01"),
    "tension that comes back": (
        ["incidents.3={type='tension_loss',at_s=4.0,wire='contact_wire',share=0.9}"],
        "incidents.3.share is 0.9 on the command line (--set); it must be less than the 0.8 that "
        "incidents.1 leaves at 2.5 s",
    ),
    "tension that comes back, told first": (
        ["incidents.3={type='tension_loss',at_s=1.0,wire='contact_wire',share=0.7}"],
        "it must be less than the 0.7 that incidents.3 leaves at 1 s",
    ),
    "two tensions at a time": (
        ["incidents.3={type='tension_loss',at_s=2.5,wire='contact_wire',share=0.7}"],
        "incidents.3.at_s is 2.5 s on the command line (--set); this happens in incidents.1",
    ),
    "slower than the train": (
        ["incidents.1.share=0.3"],
        "would fall to 240.0 km/h: it must be greater than 0.326 at train.speed_km_h = 250",
    ),
    "no such pantograph": (["incidents.2.pantograph=2"], "the train has 1 pantograph"),
    "lowered twice": (["incidents.3={type='lowering',at_s=5}"], "happens in incidents.2 already"),
    "lowered upward": (["incidents.2.force_N=10"], "must be less than 0 [N]"),
    "lowered at once": (["incidents.2.within_s=0"], "at least 0.01 [s]"),
    "lowered by nothing": (["incidents.2.drop_m=0"], "greater than 0 [m]"),
    "held by the wire": (["effects.contact_loss=false"], "effects.contact_loss is off"),
    "held by the contact": (
        [
            "contact={law='kinematic'}",
            "numerics.newmark_gamma=0.55",
            "numerics.newmark_beta=0.28",
        ],
        "holds only while contact lasts",
    ),
    "nothing to lose": (
        [
            "effects.gravity=false",
            "effects.pre_sag=false",
            "effects.dropper_slackening=false",
        ],
        "a line that does not hang has no balance to lose",
    ),
    "key of another kind": (["incidents.0.share=0.5"], "does not belong to type dropper_break"),
    "misspelt key": (["incidents.0.droper=5"], "did you mean incidents.0.dropper?"),
    "no list": (["incidents=3"], "must be a list"),
}


@pytest.fixture
def case(tmp_path: Path) -> Path:
    file = tmp_path / "case.toml"
    file.write_text(SOUND.read_text(encoding="utf-8") + INCIDENTS, encoding="utf-8")
    return file


@pytest.mark.parametrize("name", ASSIGNMENTS)
def test_an_incident_that_cannot_be_is_refused(name: str, case: Path) -> None:
    assert_refused(case, *ASSIGNMENTS[name], case.parent)


def test_the_list_itself_is_sound(case: Path) -> None:
    result = invoke("check", str(case))
    assert result.exit_code == 0, result.output


def test_a_mechanism_that_does_not_reach_down_is_told() -> None:
    words = "incidents=[{type='lowering',at_s=1.0,drop_m=4.0}]"
    result = invoke("check", "ambrosio2012", "--set", words)
    assert result.exit_code == 2, result.output
    assert "incidents.0.drop_m is 4 m on the command line (--set)" in result.stderr
    assert "does not reach down so far" in result.stderr
