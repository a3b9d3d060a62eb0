"""Pages of the documentation: their equations, files that they name, and the site's own parts."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    path
    for pattern in ("*.md", "docs/**/*.md", "cases/*/README.md")
    for path in ROOT.glob(pattern)
    if path.name != "CHANGELOG.md"
)
THEORY = sorted(path for path in ROOT.glob("docs/theory/*.md") if path.name != "index.md")
_FOLDERS = "solver|mbs|meshgen|postproc|cases|tests|docs|.site|.setup|.ci"
_FILE = re.compile(rf"`((?:{_FOLDERS.replace('.', chr(92) + '.')})/[\w./-]+\.\w+)`")
_EQUATION = re.compile(r"\$\$(.+?)\$\$|(?<![\\$])\$(?!\s)([^$\n]+?)(?<!\s)\$", re.S)
# The worked example of an effect, which a test registers from outside the package.
EXAMPLE = {"solver/effects/shipped/lateral_wind.py"}


def part_of_site(name: str) -> ModuleType:
    """A file of the site's own."""
    spec = importlib.util.spec_from_file_location(name, ROOT / f".site/{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def label(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", PAGES, ids=label)
def test_files_that_a_page_names_are_there(page: Path) -> None:
    named = set(_FILE.findall(page.read_text(encoding="utf-8"))) - EXAMPLE
    assert {name for name in named if not (ROOT / name).is_file()} == set()


@pytest.mark.parametrize("page", THEORY, ids=label)
def test_a_page_of_theory_has_sources_and_tests(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    sources, tests = text.index("\n## Sources\n"), text.index("\n## Tests\n")
    assert sources < tests and "\n- " in text[sources:tests]
    assert any(name.startswith("tests/") for name in _FILE.findall(text[tests:]))
    assert page.name in (page.with_name("index.md")).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def equations() -> ModuleType:
    return part_of_site("equations")


def equations_of(page: Path) -> list[tuple[str, str]]:
    """Equations of a page: one on a line of its own, or else one in a sentence."""
    text = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.S)
    return _EQUATION.findall(text)


@pytest.mark.parametrize("page", [page for page in PAGES if equations_of(page)], ids=label)
def test_equations_are_understood(page: Path, equations: ModuleType) -> None:
    for display, inline in equations_of(page):
        assert equations.mathml(display or inline, bool(display)).startswith("<math")


@pytest.mark.parametrize("wrong", [r"\omgea t", r"a_{b", r"\begin{aligned}a &= b\end{aligned}"])
def test_an_equation_that_is_not_understood_is_refused(wrong: str, equations: ModuleType) -> None:
    with pytest.raises(ValueError, match="not understood"):
        equations.mathml(wrong, True)


def test_a_page_becomes_a_notebook() -> None:
    made = part_of_site("notebooks").notebook("# A\n\n```python\nprint(1)\n```\n\nB\n")
    kinds = [(cell["cell_type"], "".join(cell["source"])) for cell in made["cells"]]
    assert kinds == [("markdown", "# A"), ("code", "print(1)"), ("markdown", "B")]
    assert json.loads(json.dumps(made))["nbformat"] == 4


def test_links_of_the_repository_become_links_of_the_site() -> None:
    pages = part_of_site("repository_pages")

    class Page:
        class file:  # noqa: N801
            src_uri = "cases/curve.md"

    text = (
        "[a](../../docs/wind.md#gusts) [b](../ac_simple/README.md) [c](case.toml) [d](https://x.y)"
    )
    assert pages.on_page_markdown(text, Page, None) == (
        "[a](../wind.md#gusts) [b](ac_simple.md) c [d](https://x.y)"
    )
    note = "<!-- test: not run: needs a cluster -->\n"
    assert pages.on_page_markdown(note, Page, None) == "*Not run by the tests: needs a cluster.*\n"
