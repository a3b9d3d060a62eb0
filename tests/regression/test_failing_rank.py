"""When one rank fails, all end soon: with one sentence if the error is ours, else at once."""

from __future__ import annotations

from pathlib import Path

import pytest
from program import MPIRUN, Done, python, short_run, started

# From the failure on; a rank that waits for another would wait for ever. It takes a second where
# cores are free.
AT_ONCE = 60.0
# Raises what nobody expects and leaves a word that it did.
FAIL = """
def fail():
    open("failed", "w").close()
    raise LookupError("nobody thought of this")
"""

pytestmark = pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")


def run_script(text: str, folder: Path, *words: str) -> Done:
    script = folder / "script.py"
    script.write_text(text)
    with started(python(str(script), *words), folder, ranks=2) as program:
        if "fail()" in text:
            program.wait_for((folder / "failed").exists, may_have_ended=True)
        return program.end(limit=AT_ONCE)


@pytest.mark.parametrize("failing", [0, 1])
def test_an_unforeseen_error_of_one_rank_ends_those_that_wait_for_it(
    failing: int, tmp_path: Path
) -> None:
    script = f"""{FAIL}
from mpi4py import MPI
from catenary.base.parallel import abort_on_unforeseen_error
comm = MPI.COMM_WORLD
abort_on_unforeseen_error(comm)
if comm.rank == {failing}:
    fail()
comm.Barrier()
print("went on")
"""
    done = run_script(script, tmp_path)
    assert done.code != 0
    assert done.left == []
    assert done.stderr.count("LookupError: nobody thought of this") == 1
    assert "went on" not in done.stdout


@pytest.mark.parametrize("failing", [pytest.param(0, marks=pytest.mark.study), 1])
def test_an_unforeseen_error_in_a_step_of_one_rank_ends_the_run(
    failing: int, tmp_path: Path
) -> None:
    """It passes through PETSc's time loop, in which the other rank waits for this one."""
    script = f"""{FAIL}
from mpi4py import MPI
from catenary.cases.cli.main import main
from catenary.solver.contact.pantographs import Pantographs

move_to = Pantographs.move_to

def move_or_fail(self, time):
    if MPI.COMM_WORLD.rank == {failing} and time > 0.05:
        fail()
    return move_to(self, time)

Pantographs.move_to = move_or_fail
main()
"""
    done = run_script(script, tmp_path, *short_run(tmp_path / "out"))
    assert done.code != 0
    assert done.left == []
    assert done.stderr.count("LookupError: nobody thought of this") == 1
    assert done.stdout == ""


def test_an_error_of_ours_on_rank_0_is_raised_on_all_ranks(tmp_path: Path) -> None:
    script = """
import sys
from mpi4py import MPI
from catenary import InputError, RunBroken
from catenary.base.parallel import on_root

def refuse():
    raise InputError("mesh.file is no mesh")

def fill_the_disk():
    raise RunBroken("the disk is full")

said = []
for work in (refuse, fill_the_disk):
    try:
        on_root(MPI.COMM_WORLD, work)
    except (InputError, RunBroken) as error:
        said.append(f"{type(error).__name__} {error}")
# What follows finds the ranks at the same place; one of them speaks, so that no words mix.
everywhere = MPI.COMM_WORLD.allgather(said)
if MPI.COMM_WORLD.rank == 0:
    print(everywhere, flush=True)
sys.exit(InputError.exit_code)
"""
    done = run_script(script, tmp_path)
    assert done.code == 2
    assert done.left == []
    said = ["InputError mesh.file is no mesh", "RunBroken the disk is full"]
    assert done.stdout == f"{[said, said]}\n"


def test_an_unforeseen_error_on_rank_0_is_named_on_the_others(tmp_path: Path) -> None:
    script = """
from mpi4py import MPI
from catenary.base.parallel import on_root
try:
    on_root(MPI.COMM_WORLD, lambda: [].pop())
except IndexError as error:
    found = f"IndexError: {error}"
except RuntimeError as error:
    found = f"RuntimeError: {error}"
found = MPI.COMM_WORLD.gather(found)
if found:
    print(found)
"""
    done = run_script(script, tmp_path)
    assert done.code == 0, done.stderr
    own = "IndexError: pop from empty list"
    assert done.stdout.strip() == str([own, f"RuntimeError: rank 0 failed: {own}"])
