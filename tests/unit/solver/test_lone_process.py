"""How MPI starts in a process that no launcher has started."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from catenary.base.lone_process import SETTINGS, settings


@pytest.fixture(autouse=True)
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (*SETTINGS, "OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK"):
        monkeypatch.delenv(name, raising=False)


def test_what_reaches_other_processes_is_left_out_while_mpi_starts() -> None:
    before = dict(os.environ)
    with settings():
        assert {name: os.environ[name] for name in SETTINGS} == SETTINGS
    # A launcher that this process may start later has its networks.
    assert dict(os.environ) == before


def test_what_the_environment_says_wins(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMPI_MCA_pml", "ucx")
    with settings():
        assert os.environ["OMPI_MCA_pml"] == "ucx" and "OMPI_MCA_btl" in os.environ
    assert os.environ["OMPI_MCA_pml"] == "ucx" and "OMPI_MCA_btl" not in os.environ


def test_ranks_of_a_launcher_reach_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    with settings():
        assert not set(SETTINGS) & set(os.environ)


@pytest.mark.process
def test_processes_share_no_folder_that_one_could_take_from_another(tmp_path: Path) -> None:
    """Of 240 that started side by side two found the folder removed, and ended."""
    program = (
        "from catenary.base.lone_process import world; world(); import os; print(os.listdir({!r}))"
    )
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
        "from catenary.base.lone_process import SETTINGS, world\n"
        "from catenary.cases.process.library_settings import choose\n"
        "choose(); world()\n"
        "print(set(SETTINGS) & set(os.environ))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout == "set()\n"
