"""How MPI starts in a process that no launcher has started."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from program import RANKS_ENVIRONMENT

from catenary.base.process import MPI_SETTINGS, mpi_settings


@pytest.fixture(autouse=True)
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    of_ranks = "OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK", "OMPI_MCA_ess", "OMPI_MCA_pmix"
    for name in (*MPI_SETTINGS, *of_ranks):
        monkeypatch.delenv(name, raising=False)


def test_what_reaches_other_processes_is_left_out_while_mpi_starts() -> None:
    before = dict(os.environ)
    with mpi_settings():
        assert {name: os.environ[name] for name in MPI_SETTINGS} == MPI_SETTINGS
    # A launcher that this process may start later has its networks.
    assert dict(os.environ) == before


def test_what_the_environment_says_wins(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMPI_MCA_pml", "ucx")
    with mpi_settings():
        assert os.environ["OMPI_MCA_pml"] == "ucx" and "OMPI_MCA_btl" in os.environ
    assert os.environ["OMPI_MCA_pml"] == "ucx" and "OMPI_MCA_btl" not in os.environ


def test_ranks_of_a_launcher_reach_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    with mpi_settings():
        assert not set(MPI_SETTINGS) & set(os.environ)


@pytest.mark.process
@pytest.mark.parametrize("start", ["from catenary.base.process import world; world()",
                                   "import catenary; from mpi4py import MPI"])  # fmt: skip
def test_programs_that_a_process_with_mpi_starts_have_no_rank(start: str) -> None:
    """As a cell of a notebook that begins with `!`. Open MPI hands the rank down."""
    tell = "from catenary.base.parallel import launched_by_mpirun as own; print(own())"
    program = (
        f"import subprocess, sys; {start}; "
        f"subprocess.run([sys.executable, '-c', {tell!r}], check=True)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "False\n", done.stderr


@pytest.mark.process
@pytest.mark.skipif(shutil.which("mpirun") is None, reason="needs mpirun")
def test_a_process_with_mpi_may_start_mpirun() -> None:
    """It ended without a word."""
    rank = "from mpi4py import MPI; print(MPI.COMM_WORLD.size)"
    program = (
        "import subprocess, sys; from catenary.base.process import world; world(); "
        "subprocess.run(['mpirun', '-n', '2', '--oversubscribe', sys.executable, '-c', "
        f"{rank!r}], check=True)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, **RANKS_ENVIRONMENT},
        capture_output=True,
        text=True,
    )
    # Lines of ranks may mix.
    assert sorted(done.stdout) == ["\n", "\n", "2", "2"], done.stderr


@pytest.mark.process
def test_processes_share_no_folder_that_one_could_take_from_another(tmp_path: Path) -> None:
    """Of 240 that started side by side two found the folder removed, and ended."""
    program = "from catenary.base.process import world; world(); import os; print(os.listdir({!r}))"
    done = subprocess.run(
        [sys.executable, "-c", program.format(str(tmp_path))],
        env={**os.environ, "TMPDIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    # Open MPI 5 makes one, but leaves it where it is.
    assert done.stdout == f"{os.listdir(tmp_path)}\n"


@pytest.mark.process
def test_the_program_hands_nothing_of_it_to_jobs_that_it_submits() -> None:
    """SLURM gives a job the environment of ``sbatch``: its ranks need the networks."""
    program = (
        "import os\n"
        "from catenary.base.process import MPI_SETTINGS, world\n"
        "from catenary.cases.process.libraries import choose_settings\n"
        "choose_settings(); world()\n"
        "print(set(MPI_SETTINGS) & set(os.environ))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout == "set()\n"
