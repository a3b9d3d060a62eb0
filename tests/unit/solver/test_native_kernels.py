"""The kernels in C++: compilers, alignment, numbers next to nothing, a lone process."""

from __future__ import annotations

import os
import platform
import shutil
import signal
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from measuring import History, start_march
from program import RANKS_ENVIRONMENT
from small_lines import en50318_line, mesh_of, numerics, problem_of, train

from catenary.base.process import MPI_SETTINGS, mpi_settings
from catenary.solver.kernels import aligned_arrays
from catenary.solver.kernels.flush_to_zero import flushed
from catenary.solver.time_loop import march

# --- the kernels in C++ ---------------------------------------------------------------------------


KERNELS = Path(__file__).parents[3] / "solver" / "kernels"


def test_the_module_refuses_compilers_that_are_too_old() -> None:
    module = (KERNELS / "python" / "module.cpp").read_text(encoding="utf-8")
    assert '#include "base/targets.hpp"' in module
    assert "#error" in (KERNELS / "base" / "targets.hpp").read_text(encoding="utf-8")


PROGRAM = """
#include <cmath>

#include "base/arrays.hpp"
int main(int n, char**) {
    double numbers[] = {1.0, INFINITY};
    if (n == 1) catenary::check_numbers(numbers, "a motion");
    return catenary::Array2<double>{numbers, 1, 1}(n - 1, 0) == 1.0 ? 0 : 3;
}
"""


@pytest.mark.process
def test_builds_that_look_for_faults_end_at_what_is_no_number_and_out_of_bounds(
    tmp_path: Path,
) -> None:
    """With the flags of ``make sanitize``; without them the program reads what is there."""
    compiler = os.environ.get("CXX", "g++")
    if shutil.which(compiler) is None:
        pytest.skip(f"there is no {compiler}")
    (tmp_path / "a.cpp").write_text(PROGRAM)
    flags = ["-D_GLIBCXX_ASSERTIONS", "-DCATENARY_CHECKS"]
    for flag in flags:
        assert flag in (KERNELS.parents[1] / "setup.py").read_text(encoding="utf-8")
    for name, own in (("usual", []), ("checked", flags)):
        words = ["-std=c++20", "-w", f"-I{KERNELS}", *own, str(tmp_path / "a.cpp")]
        subprocess.run([compiler, *words, "-o", str(tmp_path / name)], check=True)

    def ended(*words: str) -> tuple[int, str]:
        done = subprocess.run([tmp_path / words[0], *words[1:]], capture_output=True, text=True)
        return done.returncode, done.stderr

    assert ended("usual") == (0, "") and ended("usual", "beyond") == (3, "")
    aborted = -signal.SIGABRT
    assert ended("checked") == (aborted, "catenary: number 1 of a motion is inf\n")
    code, says = ended("checked", "beyond")
    assert code == aborted and "Assertion" in says


# --- where arrays begin ---------------------------------------------------------------------------


@pytest.mark.parametrize("size", [0, 1, 7, 5000, 200_000])
def test_arrays_begin_at_a_cache_line_each_at_its_place_of_a_page(size: int) -> None:
    arrays = [aligned_arrays.zeros(size, place) for place in range(7)]
    assert all(array.size == size and not array.any() for array in arrays)
    if size:
        begins = [array.ctypes.data % aligned_arrays.PAGE for array in arrays]
        assert all(begin % aligned_arrays.LINE == 0 for begin in begins)
        # Some lines that one array is ahead of another do not bring them together.
        assert np.diff(sorted(begins)).min() > 8 * aligned_arrays.LINE


def test_a_copy_holds_the_same_in_one_dimension() -> None:
    numbers = np.arange(12.0).reshape(3, 4)[:, ::2]
    assert np.array_equal(aligned_arrays.copy(numbers), numbers.ravel())


# --- numbers that are next to nothing -------------------------------------------------------------


TINY = np.finfo(float).tiny

known = pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64", "aarch64", "arm64"),
    reason="only where a processor can be told so",
)


def tenth_of_the_least() -> float:
    return float((np.array([TINY]) * 0.1)[0])


@known
def test_they_are_zero_within_and_themselves_again_after() -> None:
    with flushed():
        assert tenth_of_the_least() == 0.0
        with flushed():
            assert tenth_of_the_least() == 0.0
        assert tenth_of_the_least() == 0.0
    assert tenth_of_the_least() == 0.1 * TINY > 0.0


@known
def test_they_are_themselves_again_after_an_error() -> None:
    with pytest.raises(RuntimeError), flushed():
        raise RuntimeError
    assert tenth_of_the_least() > 0.0


SUBNORMALS_PROGRAM = """
#include "base/flush_to_zero.hpp"
int main() {
    volatile double least = 2.3e-308, tenth = 0.1;
    try {
        const catenary::FlushedSubnormals flushed;
        if (least * tenth != 0.0) return 1;
        throw 2;
    } catch (int) {
    }
    return least * tenth > 0.0 ? 0 : 3;
}
"""


@known
@pytest.mark.process
def test_they_are_themselves_again_after_an_error_of_a_kernel(tmp_path: Path) -> None:
    compiler = os.environ.get("CXX", "g++")
    if shutil.which(compiler) is None:
        pytest.skip(f"there is no {compiler}")
    (tmp_path / "a.cpp").write_text(SUBNORMALS_PROGRAM)
    sources = [str(tmp_path / "a.cpp"), str(KERNELS / "base" / "flush_to_zero.cpp")]
    program = str(tmp_path / "a")
    subprocess.run([compiler, "-std=c++20", f"-I{KERNELS}", *sources, "-o", program], check=True)
    assert subprocess.run([program]).returncode == 0


def test_usual_numbers_round_as_ever() -> None:
    third = np.array([1.0]) / 3.0
    with flushed():
        assert np.array([1.0]) / 3.0 == third


@known
def test_a_long_line_holds_none_and_its_contact_does_not_notice(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Waves are 1.5 km short of the line's end yet; on the way there the answer falls below all
    # numbers.
    line = en50318_line(30)
    problem = problem_of(line, train=train(70.0, 70.0, 76.0), numerics=numerics(1e-3))
    found = []
    for context in (flushed, nullcontext):
        monkeypatch.setattr(march, "flushed", context)
        run, _ = start_march(problem, mesh_of(line, 4))
        history = History()
        run.run([history])
        state = np.abs(np.concatenate(run._line.kept()))
        subnormal = int(np.count_nonzero((state > 0.0) & (state < TINY)))
        found.append((subnormal, history["contact_force"]))
        run.destroy()
    (without, force), (with_them, usual) = found
    assert without == 0 < with_them
    assert np.array_equal(force, usual)


# --- how MPI starts in a process that no launcher has started -------------------------------------


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
