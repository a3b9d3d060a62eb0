"""Who speaks and how much: --quiet, --version, completion."""

from __future__ import annotations

import re
import subprocess
import sys
from typing import Any

import pytest
import typer
from program import ENTRY
from verb_runner import invoke

from catenary.cases.cli.main import app

pytestmark = pytest.mark.usefixtures("quick_reports")


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
