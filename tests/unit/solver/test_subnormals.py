"""Numbers that are next to nothing: taken for zero under way, and left to others as they are."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from measuring import History, start_march
from small_lines import en50318_line, mesh_of, numerics, problem_of, train

from catenary.solver.kernels.flush_to_zero import flushed
from catenary.solver.time_loop import march

KERNELS = Path(__file__).parents[3] / "solver" / "kernels"
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


PROGRAM = """
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
    (tmp_path / "a.cpp").write_text(PROGRAM)
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
