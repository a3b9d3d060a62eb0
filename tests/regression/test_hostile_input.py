"""What hostile and unlucky input did once, and what it does now: one sentence, code 2, no file.

Each row of a table is an input that broke the program, by the name of what it did.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest
from program import catenary, short_run
from typer.testing import CliRunner

from catenary.cases.cli import app
from catenary.cases.messages import Origin
from catenary.cases.scene import load_scene, scene_from
from catenary.solver.errors import InputError

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


@pytest.fixture(autouse=True)
def _own_hook_and_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(sys, "excepthook", sys.excepthook)  # run replaces it
    monkeypatch.chdir(tmp_path)


def refusal(*words: str) -> str:
    """The one sentence with which a command line is refused; nothing is written."""
    before = sorted(Path.cwd().iterdir())
    result = CliRunner().invoke(app, list(words))
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


def test_the_scene_of_a_result_file_is_judged_like_any_other() -> None:
    config = json.loads(json.dumps(load_scene("en50318_2002").resolved()))
    config["petsc"] = {"log_view": ":canary"}
    with pytest.raises(InputError, match=NOT_FOR_A_SCENE):
        scene_from(config, Origin("run.h5"))


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
        assert CliRunner().invoke(app, words).exit_code == 0
    assert not Path("canary").exists()
    result = CliRunner().invoke(app, ["run", ".", "--study", "-o", "out"])
    assert result.exit_code == 2 and "has no function" in result.stderr
    assert result.stdout.startswith("--study runs the program ")
    assert "study.py" in result.stdout.splitlines()[0]
    assert Path("canary").exists()  # the canary sings when it is let out


def told_by_check(*words: str) -> list[str]:
    """The keys that ``check`` names, one sentence each."""
    result = CliRunner().invoke(app, ["check", *words])
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
