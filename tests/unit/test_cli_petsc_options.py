"""PETSc options: the scene's table first, the command line's win, and PETSc really gets them."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Sequence

import pytest

from catenary import InputError
from catenary.cases.process import petsc_options
from catenary.cases.process.petsc_options import as_arguments, split_extras


def test_the_table_comes_first_and_the_command_line_wins() -> None:
    table = {"step_ksp_rtol": 1e-12, "step_ksp_view": True, "march_ts_adapt": False, "log": "x"}
    assert as_arguments(table, ["-step_ksp_rtol", "1e-6"]) == [
        "-step_ksp_rtol",
        "1e-12",
        "-step_ksp_view",
        "-march_ts_adapt",
        "false",
        "-log",
        "x",
        "-step_ksp_rtol",
        "1e-6",
    ]


def test_extras_are_assignments_up_to_the_first_dash() -> None:
    extras = ["a.b=1", "c=-2", "-ksp_type", "cg", "-x", "y=z"]
    assert split_extras(extras) == (["a.b=1", "c=-2"], ["-ksp_type", "cg", "-x", "y=z"])
    assert split_extras([]) == ([], [])
    with pytest.raises(InputError, match="neither key=value nor a PETSc option"):
        split_extras(["a=1", "word", "-ksp_type"])


@pytest.mark.process
@pytest.mark.parametrize("running", [False, True])
def test_petsc_has_the_options_of_the_command_line(running: bool) -> None:
    # In a process of its own: PETSc starts once in the life of a process.
    script = f"""
if {running}:
    from petsc4py import PETSc
from catenary.cases.process import petsc_options
from catenary.cases.process.petsc_options import as_arguments, start_petsc
start_petsc(as_arguments({{"my_type": "cg", "my_flag": True, "my_rtol": 1e-12}}, ["-my_type", "x"]))
from petsc4py import PETSc
options = PETSc.Options()
print(options.getString("my_type"), options.getBool("my_flag"), options.getReal("my_rtol"))
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=240, check=True
    )
    assert done.stdout.split() == ["x", "True", "1e-12"]


def test_one_thread_at_a_time_starts_petsc(monkeypatch: pytest.MonkeyPatch) -> None:
    """First runs of a program, in threads, crashed at options of a PETSc that began to start."""
    inside, most = [0], [0]

    def start(arguments: Sequence[str]) -> None:
        inside[0] += 1
        most[0] = max(most[0], inside[0])
        time.sleep(0.02)
        inside[0] -= 1

    def begin() -> None:
        with petsc_options.options_of({}):
            pass

    monkeypatch.setattr(petsc_options, "start_petsc", start)
    threads = [threading.Thread(target=begin) for _ in range(5)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert most == [1]
