"""The kernels in C++: what the extension offers is what its stub says."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from catenary.solver.kernels import native

KERNELS = Path(__file__).parents[3] / "solver" / "kernels"


def declared(stub: ast.Module) -> set[str]:
    """Names that a stub declares, what it imports excepted."""
    names = set()
    for node in stub.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names.add(node.target.id)
    return names


def test_the_stub_declares_what_the_extension_offers() -> None:
    stub = ast.parse((KERNELS / "native.pyi").read_text(encoding="utf-8"))
    assert {name for name in dir(native) if not name.startswith("_")} == declared(stub)


def test_the_module_refuses_compilers_that_are_too_old() -> None:
    module = (KERNELS / "python" / "module.cpp").read_text(encoding="utf-8")
    assert '#include "base/compiler.hpp"' in module


@pytest.mark.process
@pytest.mark.skipif(not native.CHECKS, reason="make sanitize builds kernels that check numbers")
def test_checked_kernels_end_the_program_at_the_step_that_leaves_no_number() -> None:
    """Others go on until a link or a contact meets it, and then say so."""
    words = ["-m", "pytest", "-p", "no:cacheprovider", "--capture=sys", "-k", "no_number"]
    test = Path(__file__).with_name("test_march_endings.py")
    done = subprocess.run([sys.executable, *words, test], capture_output=True, text=True)
    assert done.returncode < 0
    assert "of the line's motion is nan" in done.stderr
