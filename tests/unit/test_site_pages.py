"""Pages of the documentation: equations, files and names of code; and the site's own parts."""

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
# Files named by the ends of their paths, and folders; those of other programs are none here.
_SHORT = re.compile(r"`([\w./-]+\.(?:py|cpp|hpp)|(?:solver|mbs|meshgen|postproc)/[\w/]+)`")
OTHERS = {"procs.py", "view.py", "test_NAME.py", *EXAMPLE}
_DOTTED = re.compile(r"`([a-z_]+)\.([A-Za-z_]\w*)\b(?!\.py)")
# Objects that are called as a module is; ends of files that are.
OBJECTS = {"evaluation", "heads", "line", "options", "pantographs", "run", "table"}
ENDS = {"csv", "json", "html", "png", "mp4", "gif", "py", "toml"}
PRODUCT = [
    path
    for part in ("solver", "mbs", "meshgen", "postproc", "cases")
    for path in sorted((ROOT / part).rglob("*"))
    if path.suffix in (".py", ".cpp", ".hpp")
]


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


def test_what_a_page_names_by_the_end_of_its_path_is_there() -> None:
    files = [*PRODUCT, *ROOT.glob("*.py"), *ROOT.glob(".s*/*.py"), *ROOT.glob("tests/**/*.py")]
    there = {f"/{label(path)}" for path in files}
    for page in PAGES:
        named = set(_SHORT.findall(page.read_text(encoding="utf-8"))) - OTHERS
        gone = {one for one in named if not any(path.endswith(f"/{one}") for path in there)}
        gone = {one for one in gone if not (ROOT / one).is_dir()}
        assert gone == set(), page


def test_what_a_comment_names_by_its_module_is_there() -> None:
    """``module.name`` stands in the module, ``package.module`` in the package."""
    words: dict[str, set[str]] = {}
    texts = {path: path.read_text(encoding="utf-8") for path in PRODUCT}
    for path, text in texts.items():
        words.setdefault(path.stem, set()).update(re.findall(r"\w+", text))
        for inner in (path, path.parent):
            words.setdefault(inner.parent.name, set()).add(inner.stem)
    words["kernels"].add("native")
    for path, text in ((path, text) for path, text in texts.items() if path.suffix == ".py"):
        for module, name in _DOTTED.findall(text):
            known = {name} if module in OBJECTS else words.get(module, {name})
            assert name in known | ENDS, f"{path}: {module}.{name}"


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
