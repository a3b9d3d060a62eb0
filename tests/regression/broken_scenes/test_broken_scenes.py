"""Broken scenes: each ends in one sentence, exit code 2, no traceback, and nothing written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from program import ENTRY
from refusals import SOUND, assert_one_sentence, assert_refused
from verb_runner import invoke

# A car of [vehicle.suspension].
CAR = (
    "body_mass_kg=3e4,pitch_inertia_kg_m2=2e6,stiffness_N_per_m=9e5,damping_N_s_per_m=4e4,"
    "bogie_distance_m=19,wheelbase_m=2.5"
)

# Assignments on the sound scene, and what the sentence must hold.
ASSIGNMENTS = {
    "negative tension": (
        ["line.contact_wire.tension_N=-5"],
        "is -5 on the command line (--set); it must be greater than 0 [N]",
    ),
    "unit in the value": (["line.contact_wire.tension_N=20 kN"], '"20 kN"'),
    "kilonewtons as a number": (
        ["line.contact_wire.tension_N=2e7"],
        "at most 1e+06 [N]; usual are 5000 to 40000 N",
    ),
    "not a number": (["line.contact_wire.mass_kg_per_m=nan"], "a finite number [kg/m]"),
    "infinite": (["line.messenger_wire.tension_N=inf"], "a finite number [N]"),
    "negative infinity": (["line.damping.alpha_s=-inf"], "a finite number [s]"),
    "true for a number": (["line.encumbrance_m=true"], "must be a number [m]"),
    "number for a switch": (["effects.contact_loss=1"], "must be true or false"),
    "fraction of a span": (["line.n_spans=10.5"], "must be a whole number"),
    "no spans": (["line.n_spans=0"], "at least 1"),
    "a date": (["train.speed_km_h=2012-03-23"], "must be a number [km/h]"),
    "huge integer": (["line.n_spans=" + "9" * 50], "at most 20000"),
    "integer beyond printing": (["line.n_spans=" + "9" * 5000], "must be"),
    "value in place of a table": (["line=3"], "must be a table"),
    "table in place of a value": (["train.speed_km_h={a=1}"], "must be a number"),
    "misspelt key": (["train.speed=300"], "did you mean train.speed_km_h?"),
    "misspelt table": (["numeric.dt_s=1e-3"], "did you mean numerics.dt_s?"),
    "key in the wrong table": (["line.tension_N=1"], "did you mean line.contact_wire.tension_N?"),
    "misspelt effect": (["effects.gravty=true"], "did you mean effects.gravity?"),
    "no equals sign": (["line.n_spans"], "key=value"),
    "empty part of a key": (["line..n_spans=3"], "key=value"),
    "through a value": (["train.speed_km_h.x=3"], "train.speed_km_h"),
    "entry beyond a list": (["train.pantographs.5.behind_m=3"], "from 0 to 1"),
    "name of an entry": (["train.pantographs.first.behind_m=3"], "from 0 to 1"),
    "required key taken away": (["line.n_spans="], "is missing"),
    "required effect off": (["effects.gravity=false", "effects.pre_sag=false"], "requires"),
    "what cannot be left out": (["effects.vertical=false"], "cannot be left out"),
    "damping without its effect": (["contact.damping_N_s_per_m=10"], "effects.contact_damping"),
    "effect without its damping": (["effects.contact_damping=true"], "needs a value"),
    "effect without its ratio": (["effects.residual_dropper_stiffness=true"], "needs a value"),
    "droppers of next to no stiffness": (
        ["line.dropper.stiffness_N_per_m=5e-324"],
        "line.dropper.stiffness_N_per_m is 5e-324 on the command line (--set); it must be at least",
    ),
    "a kind of a thousand letters": (
        ["defects=[{type='" + "x" * 1000 + "'}]"],
        "hard_spot or kink, not " + "x" * 57 + "...",
    ),
    "samples without a time between": (
        [
            "pantographs.reference.regulation={measures='contact_force',target=150,delay_s=0.02,"
            "gains=[{at=0,error=0.5}],sample_s=5e-324}"
        ],
        "pantographs.reference.regulation.sample_s is 5e-324 on the command line (--set); it must "
        "be at least 1e-06 [s]",
    ),
    "rise of no spans": (
        ["line.transition.rise_m=0.5"],
        "line.transition on the command line (--set) must not have rise_m without transition spans",
    ),
    "length of no spans": (["line.transition.span_m=50"], "must not have span_m without"),
    "ends of an overlap that stay": (
        ["line.overlap={first_span=8, rise_m=0.6, along='fixed'}"],
        'line.overlap.along is "fixed" on the command line (--set); it acts only with',
    ),
    "tunnel for a pantograph that is none": (
        ["line.tunnels=[{from_m=300, to_m=400}]", "train.pantographs.0.name=third"],
        "train.pantographs.0.name is",
    ),
    "stiffness of a stop that is none": (
        ["line.steady_arm.uplift_stop_stiffness_N_per_m=1e5"],
        "has an uplift_stop_stiffness_N_per_m, but no uplift_stop_m; give both, or neither",
    ),
    "uplift stop below the wire": (
        ["line.steady_arm.uplift_stop_m=-0.1"],
        "line.steady_arm.uplift_stop_m is -0.1 on the command line (--set); it must be greater",
    ),
    "ratio without its effect": (["line.dropper.residual_stiffness_ratio=0.01"], "acts only with"),
    "ratio of one": (["line.dropper.residual_stiffness_ratio=1"], "must be less than 1"),
    "dropper outside its span": (["line.dropper.positions_m=[10, 61]"], "between 0 and 60 m"),
    "dropper at the support": (["line.dropper.positions_m=[0, 10]"], "greater than 0"),
    "two droppers at one place": (["line.dropper.positions_m=[10, 10]"], "ascending"),
    "no dropper": (["line.dropper.positions_m=[]"], "at least 1"),
    "two ways to place droppers": (["line.dropper.count=8"], "exactly one of positions_m"),
    "count without spacing": (
        ["line.dropper.count=8", "line.dropper.positions_m="],
        "count and spacing_m together",
    ),
    "too many droppers": (
        ["line.dropper.count=12", "line.dropper.spacing_m=6", "line.dropper.positions_m="],
        "do not fit into a span of 60 m",
    ),
    "two stiffnesses": (["line.dropper.axial_stiffness_N=1e6"], "exactly one of"),
    "pre-sag of other length": (["line.dropper.pre_sag_mm=[1, 2]"], "2 values for 9 droppers"),
    "pre-sag twice": (
        ["line.dropper.pre_sag_mid_mm=5", "line.dropper.pre_sag_mm=[0,0,0,0,0,0,0,0,0]"],
        "both are given",
    ),
    "several span lengths": (["line.span_m=[60, 55]"], "holds for one span length"),
    "more lengths than spans": (["line.span_m=[60,60,60]", "line.n_spans=2"], "more lengths"),
    "a span of a kilometre": (
        ["line.span_m=1000"],
        "line.span_m is 1000 on the command line (--set); it must be at most 500 [m]",
    ),
    "stagger for some supports": (["line.stagger_m=[0.2, -0.2]"], "one per support (23)"),
    "stagger beyond the head": (["line.stagger_m=20"], "must be at most 2 [m]"),
    "only transition spans": (["line.transition.n_spans_start=22"], "more spans"),
    "encumbrance too small": (["line.encumbrance_m=0.3"], "below the contact wire"),
    "slack messenger wire": (["line.messenger_wire.tension_N=2000"], "below the contact wire"),
    "no damping component": (
        ["line.damping.per_component.dropper={alpha_s=1.0,beta_per_s=0.0}"],
        "did you mean droppers? the line has contact_wire, messenger_wire, droppers",
    ),
    "half a damping": (["line.damping.per_component.droppers.alpha_s=1"], "beta_per_s"),
    "no elements": (["mesh.elements_per_gap=0"], "at least 1"),
    "too many elements": (["mesh.elements_per_gap=129"], "at most 128"),
    "mesh made and given": (["mesh.file=own.msh"], "both are given"),
    "missing mesh file": (["mesh.file=own.msh", "mesh.elements_per_gap="], "no such file"),
    "standing still": (["train.speed_km_h=0"], "at least 1 [km/h]"),
    "faster than the wave": (["train.speed_km_h=450"], "wave speed of the contact wire (438.2"),
    "start before the line": (["train.start_m=-1"], "at least 0 [m]"),
    "start behind the line": (["train.start_m=1400"], "0 to 1320 m"),
    "end before the start": (["train.end_m=50"], "greater than train.start_m"),
    "end behind the line": (["train.end_m=1321"], "0 to 1320 m"),
    "no pantograph": (["train.pantographs=[]"], "at least 1"),
    "unknown pantograph": (["train.pantographs.0.name=referense"], "did you mean reference?"),
    "strip shorter than the stagger": (
        ["line.stagger_m=0.2", "pantographs.reference.strips.length_m=0.3"],
        "so that they must be at least 0.4 m long",
    ),
    "strips that overlap": (
        [
            "pantographs.reference.strips.number=2",
            "pantographs.reference.strips.spacing_m=0.6",
            "train.pantographs.1.name=reference",
            "train.pantographs.1.behind_m=1.2",
        ],
        "at least 1.6 m more than the 0 m",
    ),
    "raked strips of no length": (
        ["pantographs.reference.strips={rake_deg=10}"],
        "needs length_m for strips with rake_deg",
    ),
    "strips along the track": (
        ["pantographs.reference.strips={rake_deg=80,length_m=1.6}"],
        "at most 45",
    ),
    "raked strips that pitch": (
        [
            "pantographs.reference.strips={number=2,spacing_m=0.5,length_m=1.6,rake_deg=10,"
            "pitch_inertia_kg_m2=0.4,pitch_spring_distance_m=0.5}"
        ],
        "must not have rake_deg with pitch_inertia_kg_m2",
    ),
    "roll without its effect": (
        ["pantographs.reference.roll={inertia_kg_m2=2, spring_distance_m=0.6}"],
        "acts only with effects.head_roll = true",
    ),
    "suspension without a track": (
        [
            "effects.vehicle_motion=true",
            "vehicle.vertical={amplitude_m=0.01,frequency_hz=1.5}",
            f"vehicle.suspension={{{CAR}}}",
        ],
        "must have irregularity or a course by_place with suspension",
    ),
    "half a bogie": (
        [
            "effects.vehicle_motion=true",
            "vehicle.irregularity.spectrum=fra_6",
            f"vehicle.suspension={{{CAR},bogie_mass_kg=2600}}",
        ],
        "primary_damping_N_s_per_m together, but only has bogie_mass_kg",
    ),
    "car that turns over": (
        [
            "effects.vehicle_motion=true",
            "vehicle.irregularity.spectrum=fra_6",
            f"vehicle.suspension={{{CAR},lateral={{roll_inertia_kg_m2=6e4,stiffness_N_per_m=3e5,"
            "damping_N_s_per_m=6e4,spring_distance_m=0.5,centre_above_m=0.8,roof_above_m=1.8}}",
        ],
        "its weight turns it over on springs of 900000 N/m that are 0.5 m apart",
    ),
    "vehicle without its effect": (
        ["vehicle.irregularity.spectrum=fra_6"],
        "acts only with effects.vehicle_motion = true",
    ),
    "no such spectrum": (
        ["vehicle.irregularity.spectrum=fra_9", "effects.vehicle_motion=true"],
        "it must be fra_4, fra_5",
    ),
    "first one trails": (["train.pantographs.0.behind_m=5"], "must be 0"),
    "two in one place": (
        ["train.pantographs.1.name=reference", "train.pantographs.1.behind_m=0"],
        "train.pantographs.1.behind_m is 0 m on the command line (--set); it must be at least 1 m",
    ),
    "two in one place by default": (
        ["train.pantographs.1.name=reference"],
        "train.pantographs.1.behind_m is 0 m by default, as it is not given in ",
    ),
    "trailing one outside": (
        ["train.pantographs.1.name=reference", "train.pantographs.1.behind_m=200"],
        "would start at -110 m",
    ),
    "trailing one misses the evaluation": (
        [
            "train.pantographs.1.name=reference",
            "train.pantographs.1.behind_m=200",
            "train.start_m=300",
            "train.end_m=900",
        ],
        "the trailing pantograph only runs from 100 to 700 m",
    ),
    "several pantographs switched off": (
        [
            "train.pantographs.1.name=reference",
            "train.pantographs.1.behind_m=100",
            "effects.several_pantographs=false",
        ],
        "2 entries",
    ),
    "masses without springs": (["pantographs.reference.masses_kg=[7, 9, 6]"], "one value per mass"),
    "weightless head": (["pantographs.reference.masses_kg=[0, 15]"], "at least 0.001 [kg]"),
    "loose head": (["pantographs.reference.stiffnesses_N_per_m=[0, 50]"], "only the last"),
    "negative damper": (["pantographs.reference.dampings_N_s_per_m=[-1, 90]"], "at least 0"),
    "two static forces": (
        ["pantographs.reference.static_force_by_speed=[[200, 100]]"],
        "exactly one of",
    ),
    "speed outside the forces": (
        [
            "pantographs.reference.static_force_by_speed=[[275, 143], [320, 169]]",
            "pantographs.reference.static_force_N=",
        ],
        "only holds forces for 275 to 320 km/h",
    ),
    "another model": (["pantographs.reference.type=multibdy"], "must be"),
    "evaluation backwards": (["evaluation.to_m=400"], "must end behind its start"),
    "evaluation beyond the line": (["evaluation.to_m=1500"], "only runs from 90 to 1320 m"),
    "evaluation before the start": (["evaluation.from_m=50"], "only runs from 90"),
    "raised too late": (["train.raise_time_s=10"], "must be raised by then"),
    "unknown edition": (["evaluation.edition=1999"], "must be one of 2006, 2012, 2020"),
    "unknown edition as text": (['evaluation.edition="1999"'], "must be one of"),
    "unknown system": (["evaluation.system=steam"], "must be one of"),
    # Contact laws, schemes and steps.
    "no contact stiffness": (["contact.stiffness_N_per_m=0"], "greater than 0 [N/m]"),
    "step above 20 Hz": (["numerics.dt_s=0.03"], "20 Hz"),
    "step of nothing": (["numerics.dt_s=0"], "at least 1e-06 [s]"),
    "unknown scheme": (["numerics.scheme=newton"], "one_solve or fixed_point"),
    "unstable Newmark": (["numerics.newmark_gamma=0.7"], "2 newmark_beta >= newmark_gamma"),
    "unknown integrator": (["numerics.integrator=rk4"], "newmark, hht or generalized_alpha"),
    "spectral radius of Newmark": (
        ["numerics.spectral_radius=0.8"],
        "must not have spectral_radius with integrator newmark",
    ),
    "no spectral radius": (
        ["numerics.integrator=generalized_alpha"],
        "must give spectral_radius with integrator generalized_alpha",
    ),
    "spectral radius above 1": (
        ["numerics.integrator=generalized_alpha", "numerics.spectral_radius=1.1"],
        "at most 1",
    ),
    "spectral radius below HHT's": (
        ["numerics.integrator=hht", "numerics.spectral_radius=0.4"],
        "from 0.5 to 1 with integrator hht",
    ),
    "two ways to damp": (
        [
            "numerics.integrator=hht",
            "numerics.spectral_radius=0.8",
            "numerics.newmark_gamma=0.55",
            "numerics.newmark_beta=0.28",
        ],
        "must not have newmark_beta and newmark_gamma with integrator",
    ),
    "kinematic contact by another method": (
        [
            "contact.law=kinematic",
            "contact.stiffness_N_per_m=",
            "numerics.integrator=generalized_alpha",
            "numerics.spectral_radius=0.5",
        ],
        "only if one method steps both: take newmark",
    ),
    "negative Newmark damping": (["numerics.newmark_gamma=0.4"], "at least 0.5"),
    "no iterations": (["numerics.max_iterations=0"], "at least 1"),
    # Options of PETSc, and the table of tests.
    "list for a PETSc option": (["petsc.march_ksp_type=[1]"], "must be preonly, richardson"),
    "PETSc option with its dash": (["petsc.-march_ksp_type=cg"], "mean petsc.march_ksp_type?"),
    "unknown key in the test table": (["test.train.sped_km_h=3"], "did you mean train.speed_km_h?"),
}

# Changes to the text of a case file: (old, new, what the sentence must hold).
EDITS = {
    "no TOML": ("[line]", "[line", "is not valid TOML"),
    "key twice": ("n_spans = 22", "n_spans = 22\nn_spans = 23", "is not valid TOML"),
    "unit without quotes": ("= 20000.0", "= 20 kN", "is not valid TOML"),
    "misspelt table": ("[train]", "[trian]", "did you mean train?"),
    "unknown table": ("[contact]", "[zzzzzz]", "zzzzzz in"),
    "missing table": ("[evaluation]", "[output]", "did you mean"),
    "missing key": ("n_spans = 22", "", "line.n_spans (number of spans"),
    "negative": ("mass_kg_per_m = 1.35", "mass_kg_per_m = -1.35", "case.toml; it must be greater"),
    "not UTF-8": ("Reference model", "R\udce9f\udce9rence", "UTF-8"),
    "integer too long to read": ("n_spans = 22", "n_spans = " + "9" * 5000, "is not valid TOML"),
    "nested too deeply": ("n_spans = 22", "n_spans = " + "[" * 5000, "case.toml"),
}


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", ASSIGNMENTS)
def test_a_broken_assignment_ends_in_one_sentence_and_code_2(name: str, tmp_path: Path) -> None:
    assert_refused(SOUND, *ASSIGNMENTS[name], tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", EDITS)
def test_a_broken_file_ends_in_one_sentence_that_names_it(name: str, tmp_path: Path) -> None:
    old, new, expected = EDITS[name]
    text = SOUND.read_text(encoding="utf-8")
    assert old in text
    file = tmp_path / "case.toml"
    file.write_bytes(text.replace(old, new, 1).encode("utf-8", "surrogateescape"))
    out = tmp_path / "out"
    result = invoke("run", str(file), "-o", str(out))
    assert result.exit_code == 2, result.output
    assert_one_sentence(result.stderr, out, expected)
    assert str(file) in result.stderr
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(
    ("case", "expected"),
    [
        ("en50318", "did you mean en50318_2002?"),
        ("nothing/of/the/kind.toml", "there is no case or file"),
        (".", "is no case file and no folder"),
        ("a" * 5000, "there is no case or file"),
        ("nul\0byte", "there is no case or file"),
    ],
)
def test_a_case_that_is_not_there_is_named(case: str, expected: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = invoke("run", case, "-o", str(out))
    assert result.exit_code == 2, result.output
    assert_one_sentence(result.stderr, out, expected)


def test_the_sound_scene_is_sound() -> None:
    result = invoke("check", str(SOUND))
    assert result.exit_code == 0, result.output


def test_an_empty_file_lacks_its_first_table(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text("")
    result = invoke("check", str(tmp_path))
    assert result.exit_code == 2
    assert result.stderr.count(" is missing in ") == len(result.stderr.splitlines()) == 4


def test_a_line_whose_droppers_would_be_slack_at_rest_is_refused() -> None:
    words = ["check", str(SOUND), "--set", "line.dropper.pre_sag_mid_mm=500"]
    result = invoke(*words)
    assert result.exit_code == 2, result.output
    assert "would be slack at rest" in result.stderr


def test_a_mesh_without_a_group_is_refused(tmp_path: Path) -> None:
    made = tmp_path / "line.msh"
    assert invoke("mesh", str(SOUND), "-o", str(made)).exit_code == 0
    made.write_text(made.read_text().replace('"steady_arms"', '"study_arms"'))
    words = [
        "check",
        str(SOUND),
        "--set",
        f"mesh.file={made}",
        "--set",
        "mesh.elements_per_gap=",
    ]
    result = invoke(*words)
    assert result.exit_code == 2, result.output
    assert "steady_arms" in result.stderr


@pytest.mark.parametrize(
    "words",
    [
        pytest.param(
            ["run", "en50318_2002", "-o", "out", "--set", "train.speed_km_h=-1"],
            marks=pytest.mark.study,
        ),
        pytest.param(["run", "no_such_case", "-o", "out"], marks=pytest.mark.study),
        pytest.param(["run", "en50318_2002"], marks=pytest.mark.study),
        pytest.param(
            ["run", "en50318_2002", "-o", "out", "--no-such-option"], marks=pytest.mark.study
        ),
        ["plan", "en50318_2002", "--set", "line.contact_wire.tension_N=20 kN"],
        ["nonsense"],
    ],
)
def test_the_program_itself_exits_with_2(words: list[str], tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", ENTRY, *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert done.stderr.strip()
    assert list(tmp_path.iterdir()) == []
