"""The kernels in C++: compilers that they refuse, and builds that look for faults."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from pathlib import Path

import pytest

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
