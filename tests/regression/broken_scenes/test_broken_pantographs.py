"""Pantographs that cannot be: one sentence, exit code 2, nothing written."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import SOUND
from verb_runner import invoke

TELESCOPE = Path(__file__).parents[2] / "support" / "telescope.toml"
KIND = "pantographs.telescope"

# Assignments on the sound scene with a telescope, and what the sentence must hold.
ASSIGNMENTS = {
    "unknown type": ([f"{KIND}.type=multibdy"], "must be of type lumped or multibody"),
    "key of the other type": ([f"{KIND}.masses_kg=[3]"], f"{KIND}.masses_kg on"),
    "misspelt key": ([f"{KIND}.working_hight_m=1"], f"did you mean {KIND}.working_height_m?"),
    "misspelt key of a body": (
        [f"{KIND}.bodies.head.mass=7"],
        f"did you mean {KIND}.bodies.head.mass_kg?",
    ),
    "key of another joint": (
        [f"{KIND}.joints.guide.axes_i=[0,0,1]"],
        f"did you mean {KIND}.joints.guide.axis_i?",
    ),
    "unknown joint": (
        [f"{KIND}.joints.guide.type=hinge"],
        "must be of type fixed, revolute, spherical",
    ),
    "joint without type": ([f"{KIND}.joints.guide.type="], "must have a type"),
    "weightless body": ([f"{KIND}.bodies.mast.mass_kg=0"], "at least 0.001 [kg]"),
    "negative inertia": (
        [f"{KIND}.bodies.mast.inertia_kg_m2=[1, -1, 1]"],
        f"{KIND}.bodies.mast.inertia_kg_m2.1 is -1",
    ),
    "two moments of inertia": ([f"{KIND}.bodies.mast.inertia_kg_m2=[1, 1]"], "at least 3 entries"),
    "turn beyond one": ([f"{KIND}.bodies.mast.turn=[1, 1, 0]"], "must be at most 1 long"),
    "axis of no length": ([f"{KIND}.joints.guide.axis_i=[0,0,0]"], "must not have zero length"),
    "unknown head": (
        [f"{KIND}.head=hed"],
        'is "hed" on the command line (--set); did you mean head',
    ),
    "unknown arm": ([f"{KIND}.arm=boom"], "it must be one of mast, head"),
    "unknown actuator": ([f"{KIND}.actuator=jak"], "did you mean jack?"),
    "unknown body of a joint": (
        [f"{KIND}.joints.slide.i=must"],
        f'{KIND}.joints.slide.i is "must" on the command line (--set); did you mean mast?',
    ),
    "unknown body of a force": ([f"{KIND}.forces.brake.j=nothing"], "one of mast, head, space"),
    "head is arm": ([f"{KIND}.head=mast"], "the arm is this body too; they are two"),
    "joint of one body": ([f"{KIND}.joints.slide.i=head"], 'has "head" on both sides'),
    "uplift twice": (
        [f"{KIND}.aerodynamics={{uplift_polynomial=[1], uplift_by_speed=[[0, 0], [300, 80]]}}"],
        "needs exactly one of uplift_polynomial, uplift_by_speed",
    ),
    "no uplift": ([f"{KIND}.aerodynamics.head_share=0.5"], "but none is given"),
    "uplift in no order": (
        [f"{KIND}.aerodynamics.uplift_by_speed=[[300, 80], [200, 40]]"],
        "in ascending order, but 200 follows 300",
    ),
    "uplift of a plane": (
        [f"{KIND}.aerodynamics.uplift_by_speed=[[0, 0], [300, 8000]]"],
        "within 2000 N in uplift_by_speed, but one is 8000",
    ),
    "air at the speed of sound": (
        [f"{KIND}.aerodynamics.uplift_by_speed=[[0, 0], [3000, 80]]"],
        "between 0 and 1500 km/h in uplift_by_speed, but one is 3000",
    ),
    "more than all on the head": (
        [f"{KIND}.aerodynamics={{uplift_polynomial=[1], head_share=1.5}}"],
        f"{KIND}.aerodynamics.head_share is 1.5",
    ),
    "pressed down": (
        [f"{KIND}.aerodynamics.uplift_polynomial=[-500]"],
        "presses the head down by 500 N at 250 km/h",
    ),
    "tunnel without length": (
        ["line.tunnels=[{from_m=300, to_m=200}]"],
        "must end behind its start, but to_m is 200 and from_m 300",
    ),
    "tunnel in a tunnel": (
        [
            "line.tunnels=[{from_m=100, to_m=300}, {from_m=200, to_m=400}]",
            f"{KIND}.aerodynamics.uplift_polynomial=[5]",
        ],
        "line.tunnels.1.from_m is 200 m on the command line (--set); it must be 300 at least",
    ),
    "tunnel beyond the line": (
        [
            "line.tunnels=[{from_m=90000, to_m=90001}]",
            f"{KIND}.aerodynamics.uplift_polynomial=[5]",
        ],
        "the line ends at",
    ),
    "wind without diameters": (
        ["wind.speed_m_per_s=20"],
        "line.contact_wire.diameter_mm is missing",
    ),
    "wind of no speed": (["wind.height_m=6"], "wind.speed_m_per_s (mean speed"),
    "two strengths of gusts": (
        ["wind={speed_m_per_s=20, gusts={turbulence_intensity=0.2, friction_velocity_m_per_s=2}}"],
        "takes turbulence_intensity or friction_velocity_m_per_s, but both are given",
    ),
    "no frequencies": (
        ["wind={speed_m_per_s=20, gusts={lowest_hz=0.5, highest_hz=0.2}}"],
        "must have frequencies, but lowest_hz is 0.5 and highest_hz 0.2",
    ),
    "von Karman without a length": (
        ["wind={speed_m_per_s=20, gusts={spectrum='von_karman'}}"],
        "must have length_scale_m with the spectrum von_karman",
    ),
    "unknown spectrum": (
        ["wind={speed_m_per_s=20, gusts={spectrum='simiu'}}"],
        'wind.gusts.spectrum is "simiu"',
    ),
    "power law without exponent": (
        ["wind={speed_m_per_s=20, profile='power'}"],
        "must have exponent with the profile power",
    ),
    "stretch without length": (
        ["wind={speed_m_per_s=20, stretches=[{from_m=5, to_m=5}]}"],
        "must end behind its start, but to_m is 5 and from_m 5",
    ),
    "stretches that overlap": (
        [
            "wind={speed_m_per_s=20, stretches=[{from_m=5, to_m=50}, {from_m=40, to_m=60}]}",
            "effects.wind=false",
            "effects.gusts=false",
        ],
        "wind.stretches.1.from_m is 40 m on the command line (--set); it must be 50 at least",
    ),
    "gusts without wind": (
        [
            "wind={speed_m_per_s=20, gusts={seed=1}}",
            "effects.wind=false",
        ],
        "effects.gusts is on by default and requires effects.wind",
    ),
    "tunnel that nothing notices": (
        ["line.tunnels=[{from_m=100, to_m=300}]"],
        "changes nothing: no pantograph of the train has aerodynamics",
    ),
    "no static force": ([f"{KIND}.static_force_N="], "exactly one of static_force_N"),
    "static force twice": (
        [f"{KIND}.static_force_by_speed=[[100, 90], [300, 120]]"],
        "static_force_N and static_force_by_speed are given",
    ),
    "static force without calibration": (
        [f"{KIND}.calibrate=false"],
        "must not have static_force_N with calibrate = false",
    ),
    "speed outside the forces": (
        [f"{KIND}.static_force_N=", f"{KIND}.static_force_by_speed=[[275, 143], [320, 169]]"],
        "only holds forces for 275 to 320 km/h",
    ),
    "nothing to calibrate": ([f"{KIND}.actuator="], "needs actuator"),
    "a spring to calibrate": ([f"{KIND}.actuator=brake"], "a spring_damper, no actuator"),
    "a table to calibrate": (
        [f"{KIND}.forces.jack.force_N=", f"{KIND}.forces.jack.force_by_length=[[0, 9], [1, 8]]"],
        "write calibrate = false",
    ),
    "two forces of an actuator": (
        [f"{KIND}.forces.jack.force_by_length=[[0, 9], [1, 8]]"],
        "force_N and force_by_length are given",
    ),
    "table that goes back": (
        [f"{KIND}.forces.spring.pull_by_extension=[[1, 9], [0, 8]]"],
        "ascending order, but 0 follows 1",
    ),
    "stop without a limit": (
        [f"{KIND}.forces.stop={{type='bump_stop', j='mast', stiffness_N_per_m=1e4}}"],
        "must have shortest_m, longest_m or both",
    ),
    "correction of nothing": (
        [f"{KIND}.corrections=[{{key='bodies.mast.weight', published=1, reason='so'}}]"],
        "bodies.mast.weight is none",
    ),
    "published without corrections": ([f"{KIND}.as_published=true"], "must list corrections"),
    "published beyond what is allowed": (
        [
            f"{KIND}.as_published=true",
            f"{KIND}.corrections=[{{key='bodies.mast.mass_kg', published=-1, reason='misprint'}}]",
        ],
        "the published bodies.mast.mass_kg is not allowed",
    ),
    "loop that does not close": (
        [f"{KIND}.joints.guide.at_i_m=[0.07, 0, 0]"],
        "cannot be built: its loops do not close: joint 'guide' misses by 70 mm",
    ),
    "joint twice": (
        [f"{KIND}.joints.again={{type='prismatic', j='mast'}}"],
        "its joints again (5) repeat",
    ),
    "held fast": (
        [
            f"{KIND}.joints.guide.axis_i=[1, 0, 0]",
            f"{KIND}.joints.guide.axis_j=[1, 0, 0]",
            f"{KIND}.joints.guide.normal_i=[0, 0, 1]",
            f"{KIND}.joints.guide.normal_j=[0, 0, 1]",
            f"{KIND}.joints.guide.at_i_m=[0, 0, 1]",
        ],
        "leave no way to raise the arm 'mast'",
    ),
    "more than one way up": (
        [
            f"{KIND}.bodies.rod={{mass_kg=5, inertia_kg_m2=[1,1,1], position_m=[0.5, 0, 1]}}",
            f"{KIND}.joints.pin={{type='revolute', i='mast', j='rod', at_j_m=[-0.5, 0, 0]}}",
        ],
        "more than one way to move",
    ),
    "actuator without effect": (
        [
            f"{KIND}.forces.side={{type='actuator', j='mast', at_i_m=[-1, 0, 1], force_N=1}}",
            f"{KIND}.actuator=side",
        ],
        "'side' does not act on",
    ),
    "head without spring": (
        [f"{KIND}.forces.spring.stiffness_N_per_m=0"],
        "'head' stands on no spring",
    ),
    "head on a table": (
        [
            f"{KIND}.forces.spring.stiffness_N_per_m=",
            f"{KIND}.forces.spring.pull_by_extension=[[-1, -4200], [1, 4200]]",
        ],
        "must be a spring with a constant stiffness",
    ),
    "head without guide": (
        [f"{KIND}.joints.slide.type=spherical", f"{KIND}.joints.slide.i=space"],
        "ties the head 'head' to space",
    ),
    "arm locked": (
        [f"{KIND}.joints.lock={{type='prescribed_point', body='mast', coordinate_m=1}}"],
        "leave no way to raise",
    ),
    "hardly a mass": (
        [f"{KIND}.bodies.mast.mass_kg=1e-300"],
        "is 1e-300 on the command line (--set); it must be at least 0.001 [kg]",
    ),
    "hardly an inertia": (
        [f"{KIND}.bodies.mast.inertia_kg_m2=[1, 1e-300, 1]"],
        "inertia_kg_m2.1 is 1e-300 on the command line (--set); it must be at least 1e-06 [kg m2]",
    ),
    "switch for a number of strips": (
        [f"{KIND}.strips.number=true"],
        f"{KIND}.strips.number is true on the command line (--set); it must be 1 or 2",
    ),
    "force on what is at rest": (
        [f"{KIND}.forces.push={{type='point_force', body='space', force_N=[0, 0, 9]}}"],
        f'{KIND}.forces.push.body is "space" on the command line (--set); it must be one of mast',
    ),
    "joint of what is at rest": (
        [f"{KIND}.joints.point={{type='prescribed_point', body='space', coordinate_m=0}}"],
        f'{KIND}.joints.point.body is "space"',
    ),
    "other model's table": ([f"{KIND}.type=lumped"], "does not belong to type lumped"),
    "negative speed of a force": (
        [f"{KIND}.static_force_N=", f"{KIND}.static_force_by_speed=[[-300, 90], [300, 90]]"],
        "must have speeds between 0 and 1000 km/h in static_force_by_speed, but one is -300",
    ),
    "force for one other speed": (
        [f"{KIND}.static_force_N=", f"{KIND}.static_force_by_speed=[[200, 90]]"],
        "static_force_by_speed only holds forces for 200 km/h",
    ),
    "no joints": ([f"{KIND}.joints={{}}"], "must have at least 1 entry"),
    "actuator nearly across": (
        [
            f"{KIND}.forces.side={{type='actuator', j='mast', at_i_m=[-1, 0, 0.999999], "
            "force_N=1}",
            f"{KIND}.actuator=side",
        ],
        "it hardly acts on the arm 'mast'; check its points",
    ),
    "stop that nothing overcomes": (
        [
            f"{KIND}.forces.stop={{type='bump_stop', j='mast', at_i_m=[0, 0, -50], longest_m=1, "
            "stiffness_N_per_m=1e8}",
        ],
        "for a static force of 120 N, which is beyond calculation",
    ),
    "wire out of reach": (
        [f"{KIND}.nominal_height_m=9"],
        "away from there, beyond the reach of its mechanism",
    ),
    "substeps of tables": ([f"{KIND}.substeps=2"], "acts only with motion = all_bodies"),
    "motion of lumped masses": (
        ["pantographs.reference.motion=all_bodies"],
        "pantographs.reference.motion on the command line (--set) does not belong to type lumped",
    ),
    "too weak": (
        [f"{KIND}.calibrate=false", f"{KIND}.static_force_N=", f"{KIND}.forces.jack.force_N=100"],
        "its actuators cannot raise it",
    ),
}


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """The sound scene with the telescope on its train."""
    text = SOUND.read_text(encoding="utf-8") + TELESCOPE.read_text(encoding="utf-8")
    path = tmp_path / "case.toml"
    path.write_text(text.replace('name = "reference"', 'name = "telescope"'), encoding="utf-8")
    return path


def test_the_scene_with_a_telescope_is_sound(scene: Path) -> None:
    result = invoke("check", str(scene))
    assert result.exit_code == 0, result.output
    assert "1 of 2 degrees of freedom is the raising" in result.stdout
    assert "guide 0.0 mm, slide 0.0 mm" in result.stdout


@pytest.mark.parametrize("name", ASSIGNMENTS)
def test_a_broken_pantograph_ends_in_one_sentence_and_code_2(name: str, scene: Path) -> None:
    assignments, expected = ASSIGNMENTS[name]
    words = [word for text in assignments for word in ("--set", text)]
    result = invoke("check", str(scene), *words)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    sentences = result.stderr.splitlines()
    assert all(sentence.startswith("catenary: ") for sentence in sentences), sentences
    assert any(expected in sentence for sentence in sentences), sentences
    assert list(scene.parent.iterdir()) == [scene]


def test_paper_does_not_reach_six_metres() -> None:
    """Its two arms together are below 4 m long."""
    words = ["check", "ambrosio2012", "--set", "pantographs.seven_body.working_height_m=6"]
    result = invoke(*words)
    assert result.exit_code == 2, result.output
    assert "'stabilisation_arm' does not reach its working height of 6 m" in result.stderr
    assert result.stderr.count("\n") == 1


def test_paper_as_published_names_the_joint_that_does_not_close() -> None:
    """0.200 - 0.020 m along and 5 mm across: 182 mm."""
    words = ["check", "ambrosio2012", "--set", "pantographs.seven_body.as_published=true"]
    result = invoke(*words)
    assert result.exit_code == 2, result.output
    assert "joint 'joint_1' misses by 182 mm" in result.stderr
    assert result.stderr.count("\n") == 1
