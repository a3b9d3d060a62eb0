"""Lines that only compiled code calls have no entry from Python, and nothing there calls them."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[3]
FILES = sorted(path for part in ("solver", "mbs", "tests") for path in (ROOT / part).rglob("*.py"))
INNER = {"inner", "called"}
COMPILED = {"compiled", "addressed", "in_line", "by_make_up"} | INNER


def module_of(path: Path) -> str:
    return "catenary." + ".".join(path.relative_to(ROOT).with_suffix("").parts)


def decorators(function: ast.FunctionDef) -> set[str]:
    return {name.id for name in function.decorator_list if isinstance(name, ast.Name)}


def inner_lines() -> dict[str, set[str]]:
    """Names of such functions by the module that holds them."""
    found: dict[str, set[str]] = {}
    for path in FILES:
        module, source = module_of(path), path.read_text()
        if not any(name in source for name in INNER):
            continue
        for node in ast.parse(source).body:
            if isinstance(node, ast.FunctionDef) and INNER & decorators(node):
                found.setdefault(module, set()).add(node.name)
    return found


def calls_from_python(module: str, source: str, inner: dict[str, set[str]]) -> Iterator[str]:
    """Calls of such functions outside compiled ones."""
    tree = ast.parse(source)
    called = set(inner.get(module, ()))
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            home = str(node.module)
            for name in node.names:
                if name.name in inner.get(home, ()):
                    called.add(name.asname or name.name)
                within = inner.get(f"{home}.{name.name}", ())
                called |= {f"{name.asname or name.name}.{line}" for line in within}
    for part in tree.body:
        if isinstance(part, ast.FunctionDef) and decorators(part) & COMPILED:
            continue
        for node in ast.walk(part):
            if isinstance(node, ast.Call) and ast.unparse(node.func) in called:
                yield f"{module}, line {node.lineno}: {ast.unparse(node.func)}"


def test_nothing_but_compiled_code_calls_inner_lines() -> None:
    inner = inner_lines()
    assert (
        "add_scaled" not in inner
        and "condense" in inner["catenary.solver.linear.factors.elimination"]
    )
    names = re.compile(rf"\b({'|'.join(set().union(*inner.values()))})\b")
    for path in FILES:
        source = path.read_text()
        if names.search(source):
            assert not list(calls_from_python(module_of(path), source, inner))


def test_a_call_from_python_is_found() -> None:
    inner = {"catenary.solver.part": {"twice"}}
    source = "from catenary.solver import part\nfrom catenary.solver.part import twice\n"
    source += "@compiled\ndef loop(x):\n    return twice(x)\ndef once(x):\n    return twice(x)\n"
    source += "part.twice(1)\nclass Some:\n    def run(self):\n        return twice(2)\n"
    found = list(calls_from_python("catenary.solver.other", source, inner))
    assert [int(place.split("line ")[1].split(":")[0]) for place in found] == [7, 8, 11]
