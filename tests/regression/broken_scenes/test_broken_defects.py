"""Irregularities, defects and incidents that cannot be: one sentence with key, value and reason."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import SOUND, assert_refused
from verb_runner import invoke

# Sound tables, of which an entry is changed at a time.
DEFECTS = """
[[line.fittings]]
kind = "section_insulator"
at_m = 600.0
length_m = 1.6
mass_kg = 12.0

[irregularities.contact_wire_height]
standard_deviation_mm = 10.0

[irregularities.running_surface]
by_place = [[100.0, 0.0], [110.0, -0.001], [120.0, 0.0]]

[irregularities.dropper_lengths]
by_dropper = [[7, 4, -10.0]]

[[defects]]
type = "missing_dropper"
span = 5
dropper = 3

[[defects]]
type = "loose_clamp"
span = 6
dropper = 1

[[defects]]
type = "worn_wire"
from_m = 400.0
to_m = 460.0
lost_share = 0.2

[[defects]]
type = "wrong_tension"
wire = "contact_wire"
factor = 0.9

[[defects]]
type = "hard_spot"
at_m = 500.0
mass_kg = 5.0

[[defects]]
type = "kink"
at_m = 550.0
angle_deg = 0.5
"""
HEIGHT, SURFACE = "irregularities.contact_wire_height", "irregularities.running_surface"
LENGTHS = "irregularities.dropper_lengths"

OF_DEFECTS = {
    "no such kind": (["defects.0.type=rust"], "defects.0 on the command line (--set) must be of"),
    "no such span": (["defects.0.span=23"], "defects.0.span is 23 on the command line (--set); the "
                     "line has 22 spans"),
    "no such dropper": (["defects.1.dropper=10"], "span 6 has 9 droppers"),
    "a dropper twice": (
        ["defects.1.span=5", "defects.1.dropper=3"],
        "defects.1.dropper is 3 on the command line (--set); defects.0 has this already",
    ),
    "broken again": (
        ["incidents=[{type='dropper_break',at_s=1.0,span=5,dropper=3}]"],
        "incidents.0.dropper is 3 on the command line (--set); defects.0 lets this one carry",
    ),
    "no such wire": (["defects.2.wire=third_rail"], "the line has contact_wire, messenger_wire"),
    "worn backwards": (["defects.2.to_m=300"], "must end behind its start, but to_m is 300"),
    "worn beyond the line": (["defects.2.to_m=2000"], "contact_wire runs from 0 to 1320 m"),
    "worn away": (["defects.2.lost_share=0.6"], "must be at most 0.5"),
    "worn twice": (
        ["defects.6={type='worn_wire',from_m=450,to_m=480,lost_share=0.1}"],
        "defects.2 has a stretch of contact_wire that reaches into this one",
    ),
    "slower than the train": (
        ["defects.3.factor=0.6", "train.speed_km_h=350"],
        "the wave speed of contact_wire would be 339.4 km/h",
    ),
    "tension of nothing": (["defects.3.factor=0"], "must be at least 0.5"),
    "two tensions": (
        ["defects.6={type='wrong_tension',wire='contact_wire',factor=1.1}"],
        "defects.3 has this already",
    ),
    "spot of nothing": (["defects.4.mass_kg=0"], "needs mass_kg or stiffness_N_per_m"),
    "spot beyond the line": (["defects.4.at_m=1321"], "contact_wire runs from 0 to 1320 m"),
    "kink of a messenger": (["defects.5.wire=messenger_wire"], "strips run on contact wires only"),
    "kink like a hook": (["defects.5.angle_deg=90"], "must be at most 10 [deg]"),
    "kink of a string": (
        ["line.contact_wire.bending_stiffness_N_m2=0"],
        "contact_wire has no bending stiffness, and so keeps no bend under tension",
    ),
    "key of another kind": (["defects.0.factor=2"], "does not belong to type missing_dropper"),
    "misspelt key": (["defects.0.droper=3"], "did you mean defects.0.dropper?"),
    "no gravity": (
        ["effects.gravity=false", "effects.pre_sag=false", "effects.dropper_slackening=false"],
        "requires effects.gravity",
    ),
    "surface beyond the line": (
        [f"{SURFACE}.by_place=[[1310, 0], [1330, 0.001]]"],
        f"{SURFACE}.by_place.1.0 is 1330 on the command line (--set); the line runs from 0 to 1320",
    ),
    "no heights": ([f"{HEIGHT}.standard_deviation_mm="], "needs standard_deviation_mm or by_place"),
    "heights that end before they begin": (
        [f"{HEIGHT}.from_m=200", f"{HEIGHT}.to_m=100"],
        f"{HEIGHT}.to_m is 100 m on the command line (--set); it must be greater than the 200 m",
    ),
    "negative heights": ([f"{HEIGHT}.standard_deviation_mm=-1"], "must be greater than 0 [mm]"),
    "no waves": ([f"{HEIGHT}.shortest_m=200"], "must have waves, but longest_m is 120"),
    "no room": ([f"{HEIGHT}.from_m=1310", f"{HEIGHT}.to_m=1315"], "no wave of shortest_m"),
    "begins nowhere": ([f"{HEIGHT}.from_m=1400"], "the line ends at 1320 m"),
    "no begin without waves": ([f"{SURFACE}.from_m=10"], "must not have from_m without"),
    "too many waves": (
        ["line.n_spans=20000", f"{SURFACE}={{standard_deviation_mm=0.1,shortest_m=0.05}}"],
        "it must be at least 3 m on 1.2e+06 m",
    ),
    "a table that goes back": (
        [f"{SURFACE}.by_place=[[100,0],[90,0]]"],
        "must list its first numbers in ascending order, but 90 follows 100",
    ),
    "a table of cliffs": ([f"{SURFACE}.by_place=[[1,0],[2,3]]"], "must stay within 0.5 m"),
    "no such dropper's length": ([f"{LENGTHS}.by_dropper=[[7,14,1]]"], "span 7 has 9 droppers"),
    "half a dropper": ([f"{LENGTHS}.by_dropper=[[7,1.5,1]]"], "with whole numbers from 1 on"),
    "a metre too long": ([f"{LENGTHS}.by_dropper=[[7,1,1000]]"], "must have errors within 500 mm"),
    "lengths of nothing": ([f"{LENGTHS}.by_dropper="], "needs standard_deviation_mm or by_dropper"),
    "no such fitting": (["line.fittings.0.kind=lamp"], "must be section_insulator"),
    "fitting at a fixed end": (["line.fittings.0.at_m=0"], "ends there, where it is held"),
    "spot at a fixed end": (["defects.4.at_m=1320"], "contact_wire ends there, where it is held"),
    "fitting beyond the line": (["line.fittings.0.at_m=1400"], "contact_wire runs from 0"),
    "fitting that sticks out": (
        ["line.fittings.0.at_m=1319"],
        "line.fittings.0.length_m is 1.6 m",
    ),
    "fitting of nothing": (["line.fittings.0.mass_kg=0"], "must be greater than 0 [kg]"),
    "fitting on no wire": (["line.fittings.0.wire=fence"], "the line has contact_wire"),
}  # fmt: skip

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

OF_INCIDENTS = {
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
CASES = {"defects": (DEFECTS, OF_DEFECTS), "incidents": (INCIDENTS, OF_INCIDENTS)}


def sound(what: str, folder: Path) -> Path:
    """The sound scene with these tables."""
    file = folder / "case.toml"
    file.write_text(SOUND.read_text(encoding="utf-8") + CASES[what][0], encoding="utf-8")
    return file


@pytest.mark.parametrize(
    ("what", "name"), [(what, name) for what, (_, rows) in CASES.items() for name in rows]
)
def test_what_cannot_be_is_refused(what: str, name: str, tmp_path: Path) -> None:
    assert_refused(sound(what, tmp_path), *CASES[what][1][name], tmp_path)


@pytest.mark.parametrize("what", CASES)
def test_the_tables_themselves_are_sound(what: str, tmp_path: Path) -> None:
    result = invoke("check", str(sound(what, tmp_path)))
    assert result.exit_code == 0, result.output


def test_a_mechanism_that_does_not_reach_down_is_told() -> None:
    words = "incidents=[{type='lowering',at_s=1.0,drop_m=4.0}]"
    result = invoke("check", "ambrosio2012", "--set", words)
    assert result.exit_code == 2, result.output
    assert "incidents.0.drop_m is 4 m on the command line (--set)" in result.stderr
    assert "does not reach down so far" in result.stderr
