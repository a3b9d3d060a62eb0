"""Keys that nothing reads in a scene: each is refused in one sentence, unless its effect is off."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import SOUND, assert_refused
from scenes import load_scene, recorded, resolved

from catenary.cases.studies.accuracy.axes import AXES

FREE = Path(__file__).parents[3] / "docs/examples/two_messengers.toml"
OVERLAP, TRAM = Path("overlap"), Path("tramway")
# Motion along the track on the free line, whose arms have their length in line.links.
ALONG = (
    "effects.axial_motion=true",
    *(f"line.wires.{i}.axial_stiffness_N=1e7" for i in range(5)),
)

IDLE = {
    "change of displacements": (
        SOUND,
        ["numerics.eps_d_m=1e-9"],
        "numerics.eps_d_m is 1e-09 m on the command line (--set); nothing reads it with scheme "
        'one_solve and coupling implicit; take numerics.scheme = "fixed_point", or leave',
    ),
    "change of velocities": (
        SOUND,
        ["numerics.eps_v_m_per_s=1e-9", "numerics.coupling=iterated"],
        "numerics.eps_v_m_per_s is 1e-09 m/s on the command line (--set); nothing reads it with "
        "scheme one_solve and coupling iterated",
    ),
    "change of forces": (
        SOUND,
        ["numerics.eps_force_N=1e-9", "numerics.scheme=fixed_point"],
        "nothing reads it with scheme fixed_point; take numerics.coupling = \"iterated\"",
    ),
    "corrections that are none": (
        SOUND,
        ["numerics.max_iterations=9", "numerics.coupling=explicit"],
        "nothing reads it with scheme one_solve and coupling explicit; take "
        'numerics.scheme = "fixed_point" or numerics.coupling = "iterated"',
    ),
    "mass of an arm without length": (
        SOUND,
        ["line.steady_arm.mass_kg_per_m=2"],
        "line.steady_arm.mass_kg_per_m is 2 kg/m on the command line (--set); an arm of length 0",
    ),
    "mass of a free arm without length": (
        FREE,
        ["line.links.6.length_m=0"],
        "line.links.6.mass_kg_per_m is 0.8 kg/m in ",
    ),
    "mass of a clamp that is none": (
        FREE,
        ["line.wires.0.clamp_kg=0.3"],
        "line.wires.0.clamp_kg is 0.3 kg on the command line (--set); contact_wire has no clamp",
    ),
    "stiffness of a clamp that is none": (
        FREE,
        ["line.wires.4.clamp_stiffness_N_per_m=1e6"],
        "high_messenger has no clamp: neither start nor end names a wire",
    ),
    "height of a line whose contact wires have their own": (
        FREE,
        ["line.wires.0.height_m=5.2"],
        "line.contact_height_m is 5.3 m in ",
    ),
    "stagger of a line whose contact wires have their own": (
        FREE,
        ["line.wires.0.stagger_m=0.1"],
        "nothing reads it: contact wires have places of their own (stagger_m or course_m)",
    ),
    "stagger of messenger wires that have their own": (
        FREE,
        [
            "line.messenger_stagger_m=0.3",
            "line.wires.3.stagger_m=0.1",
            "effects.lateral_motion=true",
        ],
        "line.messenger_stagger_m is [0.3] m on the command line (--set); nothing reads it",
    ),
    "stagger of a wire between clamps": (
        FREE,
        ["line.wires.1.stagger_m=0.1"],
        "line.wires.1.stagger_m is [0.1] m on the command line (--set); nothing holds "
        "auxiliary_wire sideways but the wires to which both of its ends are clamped",
    ),
    "lateral position beside a wire between clamps": (
        FREE,
        ["line.wires.1.sideways_m=0.1"],
        "line.wires.1.sideways_m is 0.1 m on the command line (--set); nothing holds "
        "auxiliary_wire",
    ),
    "lateral position beside a wire with one clamp": (
        FREE,
        ["line.wires.2.sideways_m=0.1"],
        "without stagger_m or course_m stitch_wire has the lateral position of the wire to which",
    ),
    "seed of heights that are given": (
        SOUND,
        ["irregularities.contact_wire_height={by_place=[[0,0],[100,0.01],[200,0]],seed=4}"],
        "irregularities.contact_wire_height.seed is 4 on the command line (--set); nothing is "
        "random without irregularities.contact_wire_height.standard_deviation_mm",
    ),
    "cut of errors that are given": (
        SOUND,
        ["irregularities.dropper_lengths={by_dropper=[[6,2,5]],cut_off=1.0}"],
        "irregularities.dropper_lengths.cut_off is 1 on the command line (--set); nothing is",
    ),
    "sag between two droppers": (
        SOUND,
        ["line.dropper.positions_m=[20,40]", "line.dropper.pre_sag_mid_mm=20"],
        "line.dropper.pre_sag_mid_mm is 20 mm on the command line (--set); it is that of droppers "
        "between the first and the last one of a span, of which there is none: spans have 2",
    ),
    "ground under a power law": (
        Path("windy_viaduct"),
        ["wind.gusts=", "wind.profile=power", "wind.exponent=0.2", "wind.roughness_length_m=0.1"],
        "wind.roughness_length_m is 0.1 m on the command line (--set); nothing reads it with the "
        "profile power and no gusts",
    ),
    "weights of a wire between clamps": (
        Path("re330_stitched"),
        [
            "effects.axial_motion=true",
            *(f"line.{wire}.axial_stiffness_N=1e7" for wire in ("contact_wire", "messenger_wire")),
            "line.stitch_wire.axial_stiffness_N=1e7",
            "line.ends.end.along=tensioner",
            "line.tensioner.weights_kg.stitch_wire=118.926265715256",
        ],
        "no end of this wire has a tensioner, only those of contact_wire, messenger_wire",
    ),
    "lengths of droppers that are none": (
        TRAM,
        ["irregularities.dropper_lengths.standard_deviation_mm=5"],
        "irregularities.dropper_lengths on the command line (--set) changes nothing: the line has "
        "no droppers; leave it out, or write effects.dropper_lengths = false",
    ),
    "overlaps that do not fit": (
        OVERLAP,
        ["line.overlap.repeat_every_spans=20"],
        "line.overlap.repeat_every_spans is 20 on the command line (--set); it adds no overlap: "
        "the next one would begin in span 34, and the last in which one may begin is 26",
    ),
    "tensioners of wires that stay": (
        OVERLAP,
        ["line.tensioner.efficiency=0.97"],
        "line.tensioner.efficiency is 0.97 on the command line (--set); it acts only with "
        "effects.axial_motion = true",
    ),
    "tensioner of a free wire that stays": (
        FREE,
        ["line.wires.0.end=tensioner"],
        'line.wires.0.end is "tensioner" on the command line (--set); it acts only with',
    ),
    "free wire that nothing holds": (
        FREE,
        [*ALONG, "line.wires.0.start=tensioner", "line.wires.0.end=tensioner"],
        "line.wires.0.start is \"tensioner\" on the command line (--set); it would have tensioners "
        "at both ends from 0 to 600 m",
    ),
    "height that a support cannot give": (
        FREE,
        ["line.links.7.holds=contact_wire"],
        'line.links.7.holds is "contact_wire" on the command line (--set); no clamp joins it to '
        "low_messenger",
    ),
    "height that an end has": (
        FREE,
        ["line.links.7.holds=stitch_wire"],
        "no static equilibrium: two of its parts are to hold the height of stitch_wire at 60 m",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", IDLE)
def test_a_key_that_nothing_reads_is_refused(name: str, tmp_path: Path) -> None:
    assert_refused(*IDLE[name], tmp_path)


@pytest.mark.parametrize(
    ("case", "words"),
    [
        (SOUND, ["numerics.eps_force_N=1e-9", "numerics.coupling=iterated"]),
        (SOUND, ["numerics.max_iterations=9", "numerics.coupling=iterated"]),
        (SOUND, ["numerics.eps_d_m=1e-9", "numerics.scheme=fixed_point"]),
        (SOUND, ["line.steady_arm.mass_kg_per_m=2", "effects.arm_inertia=false"]),
        (FREE, ["line.wires.2.clamp_kg=0.5", "line.wires.1.clamp_stiffness_N_per_m=1e6"]),
        (FREE, [*ALONG, "line.wires.0.end=tensioner", "line.tensioner.ratio=2"]),
        (OVERLAP, ["line.overlap.repeat_every_spans=12", "line.n_spans=40"]),
        (OVERLAP, ["line.tensioner.ratio=2", "effects.axial_motion=false"]),
        (
            TRAM,
            [
                "irregularities.dropper_lengths.standard_deviation_mm=5",
                "effects.dropper_lengths=false",
            ],
        ),
    ],
)
def test_where_something_reads_it_or_its_effect_is_off_it_is_taken(
    case: Path, words: list[str]
) -> None:
    load_scene(case, words)


@pytest.mark.parametrize("case", [SOUND, FREE, OVERLAP])
def test_a_recorded_scene_has_all_keys_and_is_read_again(case: Path) -> None:
    scene = load_scene(case)
    again = recorded(scene)
    assert resolved(again) == resolved(scene)


@pytest.mark.parametrize(
    "words",
    [
        ["numerics.scheme=fixed_point", "numerics.eps_d_m=1e-9", "numerics.max_iterations=90"],
        ["numerics.coupling=iterated", "numerics.eps_force_N=1e-9", "numerics.max_iterations=90"],
    ],
)
def test_accuracy_varies_schemes_of_a_scene_with_tolerances(words: list[str]) -> None:
    """Levels that do not iterate take the tolerances away; others keep what is theirs."""
    scene = load_scene(SOUND, words)
    for axis in ("scheme", "coupling", "adaptive"):
        for level in AXES[axis].levels(scene):
            load_scene(SOUND, [*words, *level.assignments])
