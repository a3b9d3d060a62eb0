"""The kernels in C++: what the extension offers is what its stub says."""

from __future__ import annotations

import ast
from pathlib import Path

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
