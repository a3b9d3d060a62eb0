"""Documents: equations, files and names of code in pages, the site's parts, blocks that run."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path
from types import ModuleType

import pytest
from documents import blocks_of, difference, edited, inline_commands, numbers_agree, plain_words

# --- pages of the documentation -------------------------------------------------------------------


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
PRODUCT = [
    path
    for part in ("solver", "mbs", "meshgen", "postproc", "cases")
    for path in sorted((ROOT / part).rglob("*"))
    if path.suffix in (".py", ".cpp", ".hpp", ".h")
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


def test_lines_of_parts_are_those_of_their_files() -> None:
    page = (ROOT / "docs/development/size.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| [^|*]+ \| (`[^|]+`) \| (\d+) \|", page, re.M)
    said = {where: int(lines) for where, lines in rows}
    part_of = {path: where for where in said for path in re.findall(r"`([^`]+)`", where)}
    found = dict.fromkeys(said, 0)
    for file in [*PRODUCT, ROOT / "setup.py", *ROOT.glob(".setup/*.py"), *ROOT.glob(".site/*.py")]:
        name = file.relative_to(ROOT).as_posix()
        longest = max(filter(name.startswith, part_of), key=len)
        found[part_of[longest]] += len(file.read_text(encoding="utf-8").splitlines())
    assert found == pytest.approx(said, rel=0.1)
    (in_all,) = map(int, re.findall(r"In all there are (\d+) lines", page))
    assert sum(found.values()) == pytest.approx(in_all, rel=0.02)


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


# --- reading documents ----------------------------------------------------------------------------


PAGE = """
See `catenary run CASE -o DIR` and `catenary plan`.

<!-- test: words -->
```
$ catenary plan x \\
  --short    # sizes
3 spans
  ...
$ catenary list
```

```toml
[line]
n_spans = 3
```

<!-- test: run -->

```
catenary run x -o y \\
  --short
make test
```
"""


def test_blocks_and_their_notes() -> None:
    first, second, third = blocks_of(PAGE)
    assert (first.note, first.line, second.kind, third.verb) == ("words", 5, "toml", "run")
    plan, listing = first.shown()
    assert plan.command == "catenary plan x \\\n  --short    # sizes"
    assert plan.output == "3 spans\n  ..."
    assert (listing.command, listing.output) == ("catenary list", "")
    assert third.commands() == ["catenary run x -o y    --short", "make test"]
    assert inline_commands(PAGE) == ["catenary run CASE -o DIR", "catenary plan"]


def test_a_block_that_takes_long_has_its_other_note_too() -> None:
    notes = ("study", "study after results/a results/b", "after results/a", "")
    blocks = [
        block for note in notes for block in blocks_of(f"<!-- test: {note} -->\n```\nx\n```\n")
    ]
    assert [block.is_study for block in blocks] == [True, True, False, False]
    assert [block.verb for block in blocks] == ["", "after", "after", ""]
    assert blocks[1].rest == "results/a results/b"


def test_a_here_document_belongs_to_its_command() -> None:
    (block,) = blocks_of("```\n$ python - <<'EOF'\nprint(1)\nEOF\n1\n```\n")
    (shown,) = block.shown()
    assert shown.command.endswith("EOF") and shown.output == "1"


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("catenary run x \\\n  -o y  # quick", ["catenary", "run", "x", "-o", "y"]),
        (
            "catenary run x --set 'a=[{b=\"$c\"}, 1]'",
            ["catenary", "run", "x", "--set", 'a=[{b="$c"}, 1]'],
        ),
        ("catenary list | head", []),
        ("catenary list > file", []),
        ("catenary run x; catenary list", []),
        ("catenary run x\ncatenary list", []),
        ("python - <<'EOF'\nprint(\"it's\")\nEOF", []),
    ],
)
def test_words_that_need_no_shell(command: str, words: list[str]) -> None:
    assert plain_words(command) == words


@pytest.mark.parametrize(
    ("shown", "actual"),
    [
        ("a  b\nc", "a b c\n"),
        ("mean 26.5 N", "mean 26.53 N"),
        ("mean 26.53 N,", "mean 26.52 N,"),
        ("a\n...\nz", "a\nb\nc\nz"),
        ("...\nz", "a z"),
        ("a\n  ...", "a b c"),
        ("a\n...\nc\n...\ne", "a c b c d e"),
        ("x=1.5e-05", "x=1.6e-05"),
    ],
)
def test_as_shown(shown: str, actual: str) -> None:
    assert difference(shown, actual) == ""


@pytest.mark.parametrize(
    ("shown", "actual"),
    [
        ("a b", "a c"),
        ("a b", "a b c"),
        ("a b c", "a b"),
        ("mean 26.5 N", "mean 26.71 N"),
        ("38 droppers", "37 droppers"),
        ("a\n...\nz", "a\nb\nz\nc"),
        ("...\nz", "z a"),
        ("a\n...", "b a"),
        ("x=1.5e-05", "x=1.5e-04"),
    ],
)
def test_other_than_shown(shown: str, actual: str) -> None:
    assert difference(shown, actual) != ""


def test_words_without_numbers() -> None:
    assert difference("took 3.5 s", "took 99.1 s", with_numbers=False) == ""
    assert difference("took 3.5 s", "took 99.1 ms", with_numbers=False) != ""
    assert numbers_agree("-0.5", "-0.45") and not numbers_agree("0.5", "-0.5")


def test_keys_replace_those_that_are_there() -> None:
    text = '[case]\nname = "a"\n\n[line] # of four\nn = 4\nspan = 60.0\n[line.dropper]\nx = [1]\n'
    found = edited(text, "[line]\nspan = 50.0\nm = 2\n\n[line.dropper]\nx = [2]\n[new]\ny = 1\n")
    assert found == (
        '[case]\nname = "a"\n\n[line] # of four\nm = 2\nn = 4\nspan = 50.0\n'
        "[line.dropper]\nx = [2]\n\n[new]\ny = 1\n"
    )
