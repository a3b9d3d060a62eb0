"""What hostile and unlucky input did once, and what it does now: one sentence, code 2, no file.

Each row of a table is an input that broke the program, by the name of what it did.
"""

from __future__ import annotations

import json
import logging
import os
from pathlib import Path

import pytest
from program import catenary, short_run
from scenes import load_scene, mesh_of, problem_of, resolved, scene_from, shipped
from verb_runner import invoke

from catenary import InputError
from catenary.cases.run import scene_mesh
from catenary.cases.scene.checks.mesh_size import size_of
from catenary.cases.scene.input.faults import Origin
from catenary.cases.studies.sweep.variants import read_named
from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.meshgen.topologies.all_topologies import second
from catenary.solver.effects.all_effects import move_together

SOUND = Path(__file__).parent / "broken_scenes" / "sound.toml"
NOT_FOR_A_SCENE = "is no PETSc option that a scene may give"

# What it did; the options of the [petsc] table; a part of the sentence now.
PETSC = {
    "ran a command": (
        ["petsc.start_in_debugger=true", 'petsc.debug_terminal="touch canary"'],
        NOT_FOR_A_SCENE,
    ),
    "loaded a library": (['petsc.dll_append="./canary.so"'], NOT_FOR_A_SCENE),
    "ran a file of Python": (
        ["petsc.march_pc_type=python", "petsc.march_pc_python_type=canary.PC"],
        "petsc.march_pc_python_type",
    ),
    "ran a file of Python as stepper": (["petsc.march_ts_type=python"], NOT_FOR_A_SCENE),
    "ran Python as Krylov method": (["petsc.march_ksp_type=python"], "it must be preonly"),
    "ran a shell preconditioner": (["petsc.march_pc_type=shell"], "it must be none"),
    "overwrote a file by its log": (['petsc.log_view=":canary"'], NOT_FOR_A_SCENE),
    "filled a file with a history": (["petsc.history=canary"], NOT_FOR_A_SCENE),
    "wrote citations": (["petsc.citations=canary"], NOT_FOR_A_SCENE),
    "wrote information": (["petsc.info=canary"], NOT_FOR_A_SCENE),
    "traced into a file": (["petsc.log_trace=canary"], NOT_FOR_A_SCENE),
    "viewed into a file": (['petsc.march_ksp_view="ascii:canary"'], NOT_FOR_A_SCENE),
    "stored solutions": (
        ['petsc.march_ts_monitor_solution="binary:canary"'],
        NOT_FOR_A_SCENE,
    ),
    "stored a trajectory": (["petsc.march_ts_save_trajectory=true"], NOT_FOR_A_SCENE),
    "showed a file's first line": (["petsc.options_file=/etc/passwd"], NOT_FOR_A_SCENE),
    "read options in YAML": (["petsc.options_file_yaml=/etc/passwd"], NOT_FOR_A_SCENE),
    "killed the process": (["petsc.fp_trap=true"], NOT_FOR_A_SCENE),
    "took memory": (["petsc.malloc_debug=true"], NOT_FOR_A_SCENE),
    "listened on a port": (["petsc.saws_port=8080"], NOT_FOR_A_SCENE),
    "hid behind capitals": (["petsc.LOG_VIEW=:canary"], NOT_FOR_A_SCENE),
    "hid behind capitals of a known name": (["petsc.MARCH_PC_TYPE=lu"], NOT_FOR_A_SCENE),
    "hid behind a dash": (["petsc.-log_view=:canary"], NOT_FOR_A_SCENE),
    "hid in a value with a space": (
        ['petsc.march_pc_type="lu -log_view :canary"'],
        "it must be none",
    ),
    "hid in a value with a line": (['petsc.march_pc_type="lu\\n-log_view"'], "petsc.march_pc_type"),
    "was of absurd size": (["petsc.march_ksp_max_it=" + "9" * 5000], "petsc.march_ksp_max_it"),
    "was no tolerance": (["petsc.march_ksp_rtol=1e300"], "at most 0.001"),
    "was text": (['petsc.march_ksp_rtol="1e-8"'], "must be a number"),
    "pushed a prefix": (["petsc.prefix_push=march_"], NOT_FOR_A_SCENE),
}
# What it did; the assignments; a part of the sentence now.
REPORTED = {
    "ended in a traceback after run.h5 was gone": (
        ['case.name="a\\u0000b"'],
        'case.name is "a\\u0000b" on the command line (--set); it must not hold the control '
        "character \\u0000",
    ),
    "coloured the terminal": (['case.title="\\u001b[31mred"'], "control character \\u001b"),
    "ended in a RecursionError": (
        ["line." + ".".join(["a"] * 3000) + "=1"],
        "has a key of more than 32 parts",
    ),
    "worked for minutes without a word": (
        ["line.n_spans=20000", "mesh.elements_per_gap=64"],
        "25600002 nodes and 51200004 unknowns",
    ),
    "told a tension in kN as a speed": (
        ["line.contact_wire.tension_N=20"],
        "line.contact_wire.tension_N is 20 N on the command line (--set); usual are 5000 to "
        "40000 N: is it 20 kN? write 20000",
    ),
    "told a low tension as a speed alone": (
        ["line.contact_wire.tension_N=2000"],
        "which tension_N = 2000 and mass_kg_per_m = 1.35 give it",
    ),
    "told metres of pre-sag as nothing": (
        ["line.dropper.pre_sag_mid_mm=0.05"],
        "is it 0.05 m? write 50",
    ),
    "told millimetres as a bound alone": (
        ["line.contact_height_m=5080"],
        "usual are 4 to 7 m: is it 5080 mm? write 5.08",
    ),
    "took metres of a diameter for millimetres": (
        ["line.contact_wire.diameter_mm=0.0144"],
        "usual are 5 to 40 mm: is it 0.0144 m? write 14.4",
    ),
    "took kilonewtons of an axial stiffness for newtons": (
        ["line.contact_wire.axial_stiffness_N=15000"],
        "is it 15000 kN? write 15000000",
    ),
    "took grams of a clamp for kilograms": (
        ["line.dropper.contact_clamp_kg=50"],
        "is it 50 g? write 0.05",
    ),
    "added up two errors of one dropper": (
        ["irregularities.dropper_lengths.by_dropper=[[7,4,3],[6,4,3],[7,4,-10]]"],
        "by_dropper.2.1 is 4 on the command line (--set); irregularities.dropper_lengths.by_dropper"
        ".0 has this already",
    ),
    "took milliseconds of a damping for seconds": (
        ["line.damping.alpha_s=1"],
        "usual are 1e-05 to 0.03 s: is it 1 ms? write 0.001",
    ),
    "told milliseconds as a bound alone": (["numerics.dt_s=1"], "is it 1 ms? write 0.001"),
    "told grams as a bound alone": (
        ["line.contact_wire.mass_kg_per_m=1350"],
        "is it 1350 g/m? write 1.35",
    ),
    "blamed a pre-sag that is none": (
        ["effects.gravity=false"],
        "effects.dropper_slackening is on by default and requires effects.gravity",
    ),
    "showed two droppers at one place": (
        ["line.dropper.positions_m=[5, 5.0000001, 20]"],
        "droppers at 5 and 5.0000001 m; they must be at least 0.001 m apart",
    ),
    "showed a list in Python": (
        ["train.speed_km_h=['a', true]"],
        'train.speed_km_h is ["a", true] on',
    ),
    "showed a table in Python": (["train.speed_km_h={a=1}"], "train.speed_km_h on"),
    "found the seed of a track": (["train.sped=300"], "did you mean train.speed_km_h?"),
    "told a whole number as one that is not": (["line.n_spans=1e3"], "line.n_spans is 1000.0 on"),
    "named no span": (["line.span_m=[60, 4]"], "line.span_m.1 is 4 on"),
}


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


def refusal(*words: str) -> str:
    """The one sentence with which a command line is refused; nothing is written."""
    before = sorted(Path.cwd().iterdir())
    result = invoke(*words)
    assert result.exit_code == 2, result.output
    assert result.stdout == "", result.stdout
    sentence = result.stderr.rstrip("\n")
    assert sentence.startswith("catenary: ") and "\n" not in sentence, sentence
    assert all(letter.isprintable() for letter in sentence), ascii(sentence)
    assert sorted(Path.cwd().iterdir()) == before
    return sentence


@pytest.mark.parametrize("name", PETSC)
@pytest.mark.parametrize("verb", ["plan", "run"])
def test_a_scene_gives_petsc_no_option_that_acts_on_files_or_programs(name: str, verb: str) -> None:
    assignments, expected = PETSC[name]
    out = ["-o", "out"] if verb == "run" else []
    assert expected in refusal(verb, str(SOUND), *out, "--set", *assignments)


@pytest.mark.parametrize("name", REPORTED)
def test_what_was_reported_ends_in_one_sentence(name: str) -> None:
    assignments, expected = REPORTED[name]
    assert expected in refusal("run", str(SOUND), "-o", "out", "--set", *assignments)


def test_the_option_that_gave_a_value_is_named() -> None:
    words = ["sweep", str(SOUND), "-o", "out", "--vary"]
    assert "train.sped on the command line (--vary)" in refusal(*words, "train.sped=200,300")
    told = refusal(*words, "train.speed_km_h=200,-3")
    assert "is -3 on the command line (--vary)" in told and "--set" not in told
    told = refusal(*words, "train.speed_km_h=200,300", "--set", "line.n_spans=0")
    assert "line.n_spans is 0 on the command line (--set)" in told
    Path("v.toml").write_text('fast = ["train.speed_km_h=-3"]\n')
    told = refusal("sweep", str(SOUND), "-o", "out", "--variants", "v.toml")
    assert "is -3 by the variant fast" in told


@pytest.mark.parametrize("name", ["=1+1", "+1+1", "-x", "@A1", "a\\u0007b", ""])
def test_a_variant_is_not_named_like_a_formula(name: str) -> None:
    Path("v.toml").write_text(f'"{name}" = ["train.speed_km_h=200"]\n')
    told = refusal("sweep", str(SOUND), "-o", "out", "--variants", "v.toml")
    assert "cannot name a variant" in told


@pytest.mark.parametrize("value", ['"a\x1b[2Jb"', '"a\tb"', '"\u202ex"'])
def test_a_varied_value_holds_no_control_character(value: str) -> None:
    words = ["sweep", str(SOUND), "-o", "out", "--vary", f"case.title={value},x"]
    assert "holds a control character" in refusal(*words)


@pytest.mark.parametrize("case", ["", "  "])
def test_a_case_without_a_name_is_told(case: str) -> None:
    assert "the case has no name" in refusal("check", case)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["run", "ac_simple"], "Missing option"),
        (["run", "ac_simple", "-o", "out", "--no-such"], "No such option: --no-such"),
        (["nonsense"], "No such command 'nonsense'"),
        (["runn"], "No such command 'runn'; did you mean 'run'? see `catenary --help`"),
        (["plan"], "Missing argument"),
        (["check", "tramway", "--set"], "Option '--set' requires an argument; see `catenary check"),
    ],
)
def test_a_usage_error_is_one_sentence(words: list[str], expected: str, tmp_path: Path) -> None:
    done = catenary(*words, cwd=tmp_path)
    assert done.code == 2 and done.stdout == ""
    (sentence,) = done.stderr.splitlines()
    assert sentence.startswith(f"catenary: {expected}") and "--help`" in sentence


def test_a_byte_order_mark_is_taken(tmp_path: Path) -> None:
    mark = b"\xef\xbb\xbf"
    Path("case.toml").write_bytes(mark + SOUND.read_bytes())
    Path("v.toml").write_bytes(mark + b'slow = ["train.speed_km_h=200"]\n')
    Path("course.csv").write_bytes(mark + b"0,0\r\n9,0.01\r\n18,0\r\n999,0\r\n")
    scene = load_scene(
        tmp_path, ["vehicle.vertical.by_time_file=course.csv", "effects.vehicle_motion=true"]
    )
    assert scene.vehicle is not None and scene.vehicle.vertical is not None
    assert scene.vehicle.vertical.by_time == [[0, 0], [9, 0.01], [18, 0], [999, 0]]
    assert read_named(Path("v.toml")) == {"slow": ["train.speed_km_h=200"]}


@pytest.mark.parametrize("edition", ["2012", '"2012"'])
def test_an_edition_may_be_a_number(edition: str) -> None:
    assert load_scene(SOUND, [f"evaluation.edition={edition}"]).evaluation.edition == "2012"


@pytest.mark.parametrize("case", sorted(shipped()))
def test_a_mesh_is_counted_before_it_is_made(case: str) -> None:
    for change in ("mesh.support_refinement=3", "line.n_spans=31"):
        if case == "tramway" and "n_spans" in change:
            change = "line.n_spans=59"
        if case == "curve" and "n_spans" in change:
            continue  # a stagger for each support
        scene = load_scene(case, [change])
        size, mesh = size_of(scene), mesh_of(scene)
        assert size is not None
        assert (size.nodes, size.droppers) == (mesh.n_nodes, mesh.droppers.shape[0])
        on = scene.switches()
        of_a_node = 2 + 2 * on["lateral_motion"] + on["axial_motion"]  # w, slope; v, slope; u
        shared = move_together(problem_of(scene))
        assert set(shared) == ({second(CONTACT_WIRE)} if case == "dc_twin" else set())
        n_own = mesh.n_nodes - sum(mesh.wires[wire].size for wire in shared)
        assert size.unknowns == of_a_node * n_own


@pytest.mark.parametrize(
    "changes",
    [
        ["line.overlap.first_span=[4,9,20]"],
        ["line.overlap.first_span=6", "line.overlap.repeat_every_spans=5"],
        ["line.overlap.first_span=[4,9,14,19]", "line.span_m=[55,50,55,45,50]"],
        # Stitch wires are kept whole: those about the ends of a section fall away.
        [
            "line.overlap.first_span=[4,9,20]",
            "line.topology=stitched",
            "line.stitch_wire={tension_N=2800,mass_kg_per_m=0.31,bending_stiffness_N_m2=1.6,"
            "length_m=26}",
        ],
    ],
    ids=["three", "repeated", "unlike", "stitched"],
)
def test_a_mesh_of_several_overlaps_is_counted_before_it_is_made(changes: list[str]) -> None:
    scene = load_scene("overlap", ["line.dropper.pre_sag_mm=", "line.dropper.count=5",
                                   "line.dropper.positions_m=", "line.dropper.spacing_m=8",
                                   "line.dropper.pre_sag_mid_mm=0", *changes])  # fmt: skip
    size, mesh = size_of(scene), mesh_of(scene)
    assert size is not None
    assert (size.nodes, size.droppers) == (mesh.n_nodes, mesh.droppers.shape[0])


def test_ten_thousand_spans_are_allowed_and_their_size_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[str] = []
    logger = logging.getLogger("catenary.mesh")
    monkeypatch.setattr(logger, "warning", lambda form, *values: told.append(form % values))
    monkeypatch.setattr(scene_mesh, "make_mesh", lambda *given, **more: None)
    mesh_of(load_scene(SOUND, ["line.n_spans=10000"]))
    (sentence,) = told
    assert "1000002 nodes and 2000004 unknowns" in sentence and "GB of memory" in sentence


def test_fifos_and_devices_are_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo("pipe")
    for name in ("pipe", "/dev/zero", "/dev/tty", "."):
        words = [f'vehicle.vertical.by_time_file="{name}"', "effects.vehicle_motion=true"]
        told = refusal("plan", str(SOUND), "--set", *words)
        kind = "a folder" if name == "." else "no regular file"
        assert f"cannot be read: it is {kind}" in told or "no such device" in told
        words = [f'mesh.file="{name}"', "mesh.elements_per_gap="]
        assert "there is no such file" in refusal("plan", str(SOUND), "--set", *words)
        assert "no case file" in refusal("plan", name)


def test_the_scene_of_a_result_file_is_judged_like_any_other() -> None:
    config = json.loads(json.dumps(resolved(load_scene("en50318_2002"))))
    config["petsc"] = {"log_view": ":canary"}
    with pytest.raises(InputError, match=NOT_FOR_A_SCENE):
        scene_from(config, Origin("run.h5", recorded=True))


def test_a_variant_gives_petsc_no_option() -> None:
    Path("variants.toml").write_text('soft = ["petsc.march_pc_type=lu"]\n')
    words = ["sweep", str(SOUND), "-o", "out", "--variants", "variants.toml"]
    assert "when the program starts" in refusal(*words)
    words = ["sweep", str(SOUND), "-o", "out", "--vary", "petsc.log_view=:canary"]
    assert "when the program starts" in refusal(*words)


def test_options_files_beside_a_case_are_not_read(tmp_path: Path) -> None:
    for name in (".petscrc", "petscrc"):
        (tmp_path / name).write_text("-info :canary\n-options_view :canary\n-log_view :canary\n")
    before = sorted(os.listdir(tmp_path))
    for words in (["check", str(SOUND)], ["static", str(SOUND)]):
        done = catenary(*words, cwd=tmp_path)
        assert done.code == 0, done.stderr
        assert sorted(os.listdir(tmp_path)) == before
    done = catenary(*short_run(Path("out"), "train.end_m=245"), cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert sorted(os.listdir(tmp_path)) == sorted([*before, "out"])


def test_a_program_beside_a_case_runs_only_with_study_and_is_named_before() -> None:
    Path("case.toml").write_text(SOUND.read_text())
    Path("study.py").write_text("import pathlib\npathlib.Path('canary').touch()\n")
    for words in (["check", "."], ["plan", "."]):
        assert invoke(*words).exit_code == 0
    assert not Path("canary").exists()
    result = invoke("run", ".", "--study", "-o", "out")
    assert result.exit_code == 2 and "has no function" in result.stderr
    assert result.stdout.startswith("--study runs the program ")
    assert "study.py" in result.stdout.splitlines()[0]
    assert Path("canary").exists()  # the canary sings when it is let out


def told_by_check(*words: str) -> list[str]:
    """The keys that ``check`` names, one sentence each."""
    result = invoke("check", *words)
    assert result.exit_code == 2 and result.stdout == "", result.output
    sentences = result.stderr.splitlines()
    assert all(sentence.startswith("catenary: ") for sentence in sentences)
    return [sentence.split()[1] for sentence in sentences]


def test_check_tells_every_fault_of_the_tables_with_its_key() -> None:
    changes = (
        ("n_spans = 22", "n_spans = 0"),
        ("speed_km_h", "sped_km_h"),
        ("dt_s = 1e-3", "dt_s = 1"),
    )
    text = (
        SOUND.read_text().replace("[line]", "[line]\nmasts = 3").replace("sound", "so\\u0007und", 2)
    )
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    Path("case.toml").write_text(text)
    keys = told_by_check(".")
    assert sorted(keys) == [
        "case.name",
        "line.masts",
        "line.n_spans",
        "numerics.dt_s",
        "train.sped_km_h",
        "train.speed_km_h",
    ]
    assert refusal("plan", ".").endswith("(and 5 more: `catenary check` lists them)")


def test_check_tells_every_fault_of_the_geometry_with_its_key() -> None:
    changes = {
        "line.encumbrance_m": "0.3",
        "train.speed_km_h": "450",
        "train.pantographs.0.behind_m": "5",
        "evaluation.system": "steam",
        "evaluation.from_m": "50",
        "effects.contact_loss": "false",
        "effects.vertical": "false",
    }
    assigned = [f"{key}={value}" for key, value in changes.items()]
    keys = told_by_check(str(SOUND), "--set", *assigned, "contact.law=hertz")
    assert sorted(keys) == sorted(changes)


def test_faults_beyond_fifty_are_counted() -> None:
    Path("case.toml").write_text(SOUND.read_text() + "".join(f"[x{i}]\n" for i in range(3000)))
    assert told_by_check(".")[-1] == "there"
    assert "(and 2999 more: " in refusal("plan", ".")
