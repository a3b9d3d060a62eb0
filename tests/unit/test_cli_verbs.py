"""The verbs of the command line: help, lists, files, exit codes, who speaks and how much."""

from __future__ import annotations

import csv
import errno
import json
import os
import re
import subprocess
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from program import ENTRY
from scenes import load_scene, shipped
from verb_runner import invoke

from catenary import RunBroken
from catenary.cases.cli.main import app
from catenary.cases.terminal import console
from catenary.solver.effects import all_effects as effects

pytestmark = pytest.mark.usefixtures("quick_reports")

# --- the verbs of the command line ----------------------------------------------------------------


VERBS = ["run", "restart", "sweep", "list", "plan", "check", "mesh", "static", "pantograph"]
VERBS += ["report", "compare", "hard", "stability-map", "new", "doctor", "optimise", "tolerance"]
SUMMARY = {
    "case": "en50318_2002",
    "speed_km_h": 250.0,
    "n_steps": 10,
    "n_dofs": 20,
    "n_ranks": 1,
    "real_time_factor": None,
    "real_time_factor_with_records": None,
    "evaluation_m": [360.0, 600.0],
    "pantographs": [
        {
            "name": "leading",
            "mean_N": 119.25,
            "std_N": 26.4,
            "max_N": 178.6,
            "min_N": 61.6,
            "stat_max_N": 198.5,
            "stat_min_N": None,
            "loss_percent": 0.0,
        }
    ],
    "supports": {"max_uplift_mm": 51.4},
    "droppers": {"n_slackened": 5},
    "acceptance": [
        {"criterion": "mean contact force", "value": 119.25, "limit": 130.6, "passed": True},
        {"criterion": "maximum contact force", "value": None, "limit": 350.0, "passed": None},
    ],
}


@pytest.fixture
def runner(monkeypatch: pytest.MonkeyPatch) -> types.SimpleNamespace:
    """Stands in for the runner: what it was called with, and what it is to return or raise."""
    told = types.SimpleNamespace(result=None, error=None, calls=[])

    def run_case(scene: Any, out: Path, comm: Any, **options: Any) -> Any:
        told.calls.append((scene, out, options))
        if told.error is not None:
            raise told.error
        options["on_closed"](told.result.outcome)
        return told.result

    module = types.ModuleType("catenary.cases.run.runner")
    module.run_case = module.restart_case = run_case  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "catenary.cases.run.runner", module)
    monkeypatch.setattr("catenary.cases.process.petsc_options.start_petsc", lambda arguments: None)
    monkeypatch.setattr(sys, "excepthook", sys.excepthook)
    return told


def outcome(said: str, accepted: bool | None) -> types.SimpleNamespace:
    return types.SimpleNamespace(
        outcome=said,
        summary={**SUMMARY, "passed": accepted},
        phase_wall={"march": 0.24, "report": 0.76},
    )


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_help_with_an_example(verb: str) -> None:
    result = invoke(verb, "--help")
    assert result.exit_code == 0
    assert f"Example: catenary {verb}" in result.stdout


def test_the_help_lists_every_verb() -> None:
    result = invoke("--help")
    assert result.exit_code == 0
    for verb in VERBS:
        assert f"  {verb} " in result.stdout
    assert "..." not in result.stdout.split("Commands:")[1]  # first sentences fit into a line


def test_list_names_every_shipped_case_with_its_title() -> None:
    lines = invoke("list").stdout.splitlines()
    assert [line.split()[0] for line in lines] == list(shipped())
    for line in lines:
        assert load_scene(line.split()[0]).case.title in line


@pytest.mark.parametrize("case", list(shipped()))
def test_plan_names_all_effects_and_the_size(case: str) -> None:
    result = invoke("plan", case)
    assert result.exit_code == 0, result.output
    simulated, left_out = result.stdout.split("Not simulated:")
    for name, effect in effects.registry().items():
        assert (f"\n  {name} " in simulated) != (f"\n  {name} " in left_out)
        assert effect.title in result.stdout
    scene = load_scene(case)
    on = scene.switches()
    names = ["w", "theta_y"] + ["u"] * on["axial_motion"] + ["v", "theta_z"] * on["lateral_motion"]
    as_one = scene.line.twin is not None and not on["relative_motion"]
    of_each = "nodes, contact_wire_2 with those of contact_wire" if as_one else "nodes x"
    each = "" if as_one else f" {len(names)}"
    assert f"{of_each}{each} ({', '.join(names)})" in simulated
    assert "real-time factor" in simulated


def test_plan_shows_how_near_the_speed_is_to_the_wave_speed() -> None:
    # 250 km/h over 438.18 km/h
    assert (
        "0.57 of the contact wire's wave speed (438.2 km/h)"
        in invoke("plan", "en50318_2002").stdout
    )


def test_check_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = invoke("check", "ac_simple", "--set", "line.n_spans=24")
    assert result.exit_code == 0, result.output
    assert result.stdout.startswith("ac_simple is valid: 24 spans, 1320 m, 216 droppers")
    assert list(tmp_path.iterdir()) == []


def test_a_stray_word_is_no_assignment() -> None:
    result = invoke("check", "ac_simple", "fast")
    assert result.exit_code == 2
    assert '"fast" on the command line is neither' in result.stderr


def test_mesh_writes_a_file_once(tmp_path: Path) -> None:
    out = tmp_path / "line.msh"
    assert invoke("mesh", "ac_simple", "-o", str(out)).exit_code == 0
    first = out.read_bytes()
    assert b"contact_wire" in first
    again = invoke("mesh", "ac_simple", "-o", str(out), "--set", "mesh.elements_per_gap=2")
    assert again.exit_code == 2
    assert "--force" in again.stderr
    assert out.read_bytes() == first
    words = ["-o", str(out), "--force", "--set", "mesh.elements_per_gap=2"]
    assert invoke("mesh", "ac_simple", *words).exit_code == 0
    assert len(out.read_bytes()) < len(first)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("line.vtk", "ends in .msh"),
        ("file/line.msh", "cannot be written"),
        ("folder.msh", "is a folder"),
    ],
)
def test_mesh_refuses_impossible_files(name: str, expected: str, tmp_path: Path) -> None:
    (tmp_path / "folder.msh").mkdir()
    (tmp_path / "file").touch()
    result = invoke("mesh", "ac_simple", "-o", str(tmp_path / name))
    assert result.exit_code == 2
    assert expected in result.stderr


def test_a_made_mesh_can_be_given_back(tmp_path: Path) -> None:
    out = tmp_path / "new" / "line.msh"
    assert invoke("mesh", "ac_simple", "-o", str(out)).exit_code == 0
    words = ["--set", f"mesh.file={out}", "--set", "mesh.elements_per_gap="]
    plain, given = invoke("check", "ac_simple"), invoke("check", "ac_simple", *words)
    assert given.exit_code == 0, given.output
    assert given.stdout == plain.stdout
    refused = invoke("mesh", "ac_simple", "-o", str(tmp_path / "other.msh"), *words)
    assert refused.exit_code == 2
    assert "names a mesh already" in refused.stderr


def test_static_prints_the_dropper_table_and_writes_it(tmp_path: Path) -> None:
    out = tmp_path / "droppers.csv"
    result = invoke("static", "ac_simple", "-o", str(out))
    assert result.exit_code == 0, result.output
    assert "Elasticity from" in result.stdout
    with out.open() as stream:
        rows = list(csv.DictReader(stream))
    scene = load_scene("ac_simple")
    assert len(rows) == 9 * scene.line.n_spans
    assert {row["span"] for row in rows} == {str(i + 1) for i in range(scene.line.n_spans)}
    # A later span may only be printed as equal to an earlier one, the first is printed in full,
    # to a tenth of a millimetre.
    printed = [float(line.split()[2]) for line in result.stdout.splitlines()[1:10]]
    assert printed == pytest.approx([float(row["length_m"]) for row in rows[:9]], abs=6e-5)
    everything = tmp_path / "rest.json"
    assert invoke("static", "ac_simple", "-o", str(everything)).exit_code == 0
    table = json.loads(everything.read_text())
    assert np.allclose(table["dropper_length"], [float(row["length_m"]) for row in rows], atol=1e-5)


def test_compare_and_report_name_a_folder_that_holds_no_run(tmp_path: Path) -> None:
    for words in (["compare", str(tmp_path), str(tmp_path)], ["report", str(tmp_path)]):
        result = invoke(*words)
        assert result.exit_code == 2, result.output
        assert str(tmp_path) in result.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("said", "accepted", "strict", "code"),
    [
        ("done", True, True, console.DONE),
        ("done", None, True, console.DONE),
        ("done", False, False, console.DONE),
        ("done", False, True, console.NOT_ACCEPTED),
        ("interrupted", None, True, console.BROKEN),
        ("the contact force is not finite at 1.2 s", None, False, console.BROKEN),
    ],
)
def test_exit_codes_of_run(
    said: str,
    accepted: bool | None,
    strict: bool,
    code: int,
    runner: types.SimpleNamespace,
    tmp_path: Path,
) -> None:
    runner.result = outcome(said, accepted)
    words = ["run", "en50318_2002", "-o", str(tmp_path / "out"), *(["--strict"] if strict else [])]
    result = invoke(*words)
    assert result.exit_code == code, result.output
    if said == "done":
        assert "119.2" in result.stdout and "mean contact force" in result.stdout
    else:
        assert said in result.stderr
        assert result.stdout == ""


def test_run_hands_everything_over(runner: types.SimpleNamespace, tmp_path: Path) -> None:
    runner.result = outcome("done", True)
    words = ["--set", "train.speed_km_h=300", "petsc.march_ksp_type=cg", "--force", "--short"]
    out = tmp_path / "out"
    words += ["--no-report", "--", "-march_ksp_type", "gmres"]
    result = invoke("run", "en50318_2002", "-o", str(out), *words)
    assert result.exit_code == 0, result.output
    ((scene, folder, options),) = runner.calls
    assert folder == out
    assert scene.train.speed_km_h == 300
    assert scene.line.n_spans == load_scene("en50318_2002", shortened=True).line.n_spans
    assert options["force"] is True and options["only_summary"] is True
    assert options["petsc_options"] == ["-march_ksp_type", "cg", "-march_ksp_type", "gmres"]


def test_a_run_that_breaks_ends_in_its_sentence(
    runner: types.SimpleNamespace, tmp_path: Path
) -> None:
    runner.error = RunBroken("the disk is full at 3.2 s")
    result = invoke("run", "en50318_2002", "-o", str(tmp_path / "out"))
    assert result.exit_code == 1
    assert result.stderr == "catenary: the disk is full at 3.2 s\n"


def test_an_interrupt_ends_without_a_traceback(
    runner: types.SimpleNamespace, tmp_path: Path
) -> None:
    runner.error = KeyboardInterrupt()
    result = invoke("run", "en50318_2002", "-o", str(tmp_path / "out"))
    assert result.exit_code == 1
    assert result.stderr == "catenary: interrupted\n"


def test_run_refuses_a_file_as_its_folder(runner: types.SimpleNamespace, tmp_path: Path) -> None:
    file = tmp_path / "out"
    file.write_text("mine")
    result = invoke("run", "en50318_2002", "-o", str(file))
    assert result.exit_code == 2
    assert "is a file" in result.stderr
    assert runner.calls == [] and file.read_text() == "mine"


def test_restart_takes_no_assignments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "excepthook", sys.excepthook)
    result = invoke("restart", str(tmp_path), "line.n_spans=3")
    assert result.exit_code == 2
    assert "cannot be changed" in result.stderr
    result = invoke("restart", str(tmp_path))
    assert result.exit_code == 2
    assert "run.h5" in result.stderr


@pytest.mark.process
def test_the_reader_of_a_pipe_may_leave(tmp_path: Path) -> None:
    done = subprocess.run(
        f"'{sys.executable}' -c '{ENTRY}' list --keys | head -n 1",
        shell=True,
        capture_output=True,
        text=True,
        timeout=240,
        check=True,
    )
    assert done.stdout.count("\n") == 1
    assert "Traceback" not in done.stderr


def test_a_stability_map_is_refused_where_it_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "stability_map.csv").write_text("mine")
    for words, said in (
        (["ambrosio2012", "-o", str(tmp_path / "new")], "is a mechanism"),
        (["en50318_2002", "-o", str(tmp_path)], "is there already"),
        (["en50318_2002", "-o", str(tmp_path / "stability_map.csv")], "is a file"),
    ):
        result = invoke("stability-map", *words)
        assert result.exit_code == 2
        assert said in result.stderr and result.stderr.count("\n") == 1
    assert (tmp_path / "stability_map.csv").read_text() == "mine"
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    "words",
    [
        ("mesh", "ac_simple", "-o", "full.png"),
        ("mesh", "ac_simple", "-o", "full.svg"),
        ("static", "ac_simple", "-o", "full.csv"),
        ("static", "tensioned_section", "--temperatures", "0,10", "-o", "full.png"),
    ],
)
def test_a_full_disk_is_told(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And leaves what was there, of which --force left nothing."""

    def full(self: Path, data: bytes) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.chdir(tmp_path)
    there = Path(words[-1])
    there.write_text("mine")
    monkeypatch.setattr(Path, "write_bytes", full)
    done = invoke(*words, "--force")
    assert done.exit_code == 1, done.output
    assert f"writing {there} failed (No space left on device): free some" in done.output
    assert there.read_text() == "mine" and list(Path.cwd().iterdir()) == [Path.cwd() / there]


def test_a_device_takes_no_uncertainty(tmp_path: Path) -> None:
    table = tmp_path / "sweep.csv"
    table.write_text("variant,a,outcome,pantograph,std_N\nx,1,done,p,2\n")
    done = invoke("uncertainty", str(table), "-o", "/dev/null")
    assert done.exit_code == 2 and "/dev/null is a file; name a folder" in done.output


# --- who speaks and how much ----------------------------------------------------------------------


def test_every_verb_can_be_quiet() -> None:
    command: Any = typer.main.get_command(app)
    for name, verb in command.commands.items():
        assert any("--quiet" in option.opts for option in verb.params), name


def test_every_option_has_a_line_of_help() -> None:
    command: Any = typer.main.get_command(app)
    for name, verb in command.commands.items():
        assert verb.epilog.startswith("Example: "), name
        assert [option.name for option in verb.params if not option.help] == [], name


def test_quiet_says_nothing_but_errors() -> None:
    assert invoke("list").stdout
    done = invoke("list", "--quiet")
    assert done.exit_code == 0 and not done.output
    refused = invoke("check", "no_such_case", "-q")
    assert refused.exit_code == 2 and "no_such_case" in refused.output
    assert invoke("list").stdout  # the next one speaks again


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("sensitivity en50318_2002 --force", "--force replaces results in the folder of -o"),
        ("speed en50318_2002 --force", "--force replaces results in the folder of -o"),
        ("waves results/run --force", "--force replaces results in the folder of -o"),
        ("sweep ac_simple -o x --vary train.speed_km_h=1,2 --part 1/2 --histogram", "a part has"),
        ("sweep ac_simple -o x --vary train.speed_km_h=1,2 --part 1/2 --plot std_N", "a part has"),
        (
            "sweep ac_simple -o x --vary train.speed_km_h=1,2 --plot ,",
            'catenary: "" is no statistic',
        ),
        ("check en50318_2002 -- -log_view", "-log_view after -- is an option for PETSc; this verb"),
    ],
)
def test_options_that_nothing_would_come_of_are_refused(words: str, sentence: str) -> None:
    """They were read and ignored; of those for PETSc only run was said to take them."""
    done = invoke(*words.split())
    assert done.exit_code == 2 and sentence in done.stderr


def test_quiet_and_verbose_exclude_each_other() -> None:
    done = invoke("run", "ac_simple", "-o", "nowhere", "-q", "-v")
    assert done.exit_code == 2
    assert "--quiet and --verbose exclude each other" in done.output


@pytest.mark.parametrize("library", ["PETSc", "MPI", "HDF5", "h5py", "mpi4py", "gmsh"])
def test_version_names_the_libraries(library: str) -> None:
    done = invoke("--version")
    assert done.exit_code == 0
    assert library in done.output
    assert done.output.startswith("catenary ")


def completed(typed: str) -> list[str]:
    """What zsh is offered for a command line, without the descriptions."""
    environment = {"_CATENARY_COMPLETE": "complete_zsh", "_TYPER_COMPLETE_ARGS": typed}
    done = invoke(prog_name="catenary", env=environment)
    return re.findall(r'^(?:_arguments .*?\(\()?"((?:[^":\\]|\\.)+)"', done.stdout, re.MULTILINE)


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("catenary swe", ["sweep"]),
        ("catenary run en50", ["en50318_2002"]),
        ("catenary sweep ac_simple --qu", ["--quiet"]),
        ("catenary check ac_simple --set train.sp", ["train.speed_km_h="]),
        ("catenary check ac_simple --set numerics.integrator=h", ["numerics.integrator=hht"]),
        ("catenary check ac_simple --set effects.head_roll=", ["effects.head_roll=true",
                                                                "effects.head_roll=false"]),
        ("catenary sweep ac_simple --vary line.encumb", ["line.encumbrance_m="]),
        ("catenary accuracy ac_simple --axes dt,co", ["dt,coupling", "dt,contact"]),
        ("catenary list --keys line.damping.al", ["line.damping.alpha_s"]),
        ("catenary check ac_simple --set no_such_key=", []),
    ],
)  # fmt: skip
def test_the_shell_is_offered_what_fits(typed: str, offered: list[str]) -> None:
    assert completed(typed) == offered


@pytest.mark.process
def test_too_low_a_limit_of_memory_is_one_sentence() -> None:
    """OpenBLAS would try for ever to get memory."""
    bash = f"ulimit -v 450000; exec \"$0\" -c '{ENTRY}' report x"
    words = ["bash", "-c", bash, sys.executable]
    done = subprocess.run(words, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("catenary: this process may take 461 MB of memory (ulimit -v)")
    assert done.stderr.count("\n") == 1 and not done.stdout


def in_shell(command: str) -> subprocess.CompletedProcess[str]:
    """A command line of the program, ``catenary``, with its redirections."""
    program = f"{sys.executable} -c '{ENTRY}'"
    shell = ["bash", "-c", command.replace("catenary", program)]
    return subprocess.run(shell, capture_output=True, text=True, timeout=200, check=False)


@pytest.mark.process
@pytest.mark.parametrize(
    "words",
    [
        pytest.param("plan en50318_2002", marks=pytest.mark.study),
        "list",
        pytest.param("--help", marks=pytest.mark.study),
        "--version",
    ],
)
def test_an_output_that_cannot_be_written_is_told(words: str) -> None:
    done = in_shell(f"catenary {words} > /dev/full")
    assert done.returncode == 1
    assert done.stderr == "catenary: the output cannot be printed (No space left on device)\n"


@pytest.mark.process
def test_an_error_that_nobody_can_read_keeps_its_exit_code() -> None:
    assert in_shell("catenary check no_such_case 2> /dev/full").returncode == 2


@pytest.mark.process
@pytest.mark.parametrize(
    "closed",
    [
        pytest.param("2>&-", marks=pytest.mark.study),
        ">&-",
        pytest.param("<&- >&- 2>&-", marks=pytest.mark.study),
    ],
)
def test_streams_that_are_closed_lead_nowhere(closed: str) -> None:
    """The next file that is opened would have their numbers, and get what libraries print."""
    done = in_shell(f"catenary check en50318_2002 {closed}")
    assert done.returncode == 0 and done.stderr == ""
    assert in_shell(f"catenary check no_such_case {closed}").returncode == 2
    opened = "import os; h = os.open(os.devnull, os.O_RDONLY); assert h > 2, h"
    streams = "from catenary.cases.terminal.console import open_closed_streams as o; o()"
    code = f'{sys.executable} -c "{streams}; {opened}" {closed}'
    done = subprocess.run(["bash", "-c", code], capture_output=True, timeout=200, check=False)
    assert done.returncode == 0, done


@pytest.mark.process
def test_a_working_directory_that_is_gone_is_told() -> None:
    gone = "import os, sys, tempfile; own = tempfile.mkdtemp(); os.chdir(own); os.rmdir(own); "
    words = [sys.executable, "-c", f"{gone}sys.argv[1:] = ['doctor']; {ENTRY}"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 2 and not done.stdout
    assert done.stderr == (
        "catenary: the working directory is gone; change into one that is there\n"
    )
