"""Every public name of ``catenary`` has a docstring with an example, and the examples are true."""

from __future__ import annotations

import doctest
import inspect
import pydoc
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import catenary

pytestmark = pytest.mark.usefixtures("quick_reports")

# What is no function and no class of its own: errors say what they are for.
WITHOUT_EXAMPLE = {"__version__", "CatenaryError", "Fault", "InputError", "RunBroken"}
PUBLIC = [name for name in catenary.__all__ if name not in WITHOUT_EXAMPLE]
# Examples of more than a second, whose subjects have tests of their own.
LONG = {"Identified", "identify", "optimise", "Optimum", "uncertainty"}
DOCS = Path(__file__).parents[3] / "docs"
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def members(owner: Any) -> Iterator[tuple[str, Any]]:
    """What a public class offers by name: methods and properties that it has itself."""
    for name, value in vars(owner).items():
        if not name.startswith("_"):
            yield f"{owner.__name__}.{name}", value


def described() -> dict[str, Any]:
    """All that a docstring is wanted of, by name."""
    found: dict[str, Any] = {}
    for name in PUBLIC:
        value = getattr(catenary, name)
        found[name] = value
        if inspect.isclass(value):
            found |= dict(members(value))
    return found


DESCRIBED = described()


@pytest.fixture(scope="module")
def names(tmp_path_factory: pytest.TempPathFactory, quick_reports: None) -> dict[str, Any]:
    """What examples take for given: a scene, its run, the folder of another, steps that go on."""
    folder = tmp_path_factory.mktemp("run")
    scene = catenary.load("en50318_2002", short=True)
    catenary.run(scene, folder)
    sim = catenary.Simulation(scene)
    sim.step(100)
    run = catenary.run(scene)
    return {"catenary": catenary, "scene": scene, "run": run, "folder": folder, "sim": sim}


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.study if name in LONG else ()) for name in DESCRIBED],
)
def test_the_example_is_true(name: str, names: dict[str, Any]) -> None:
    text = pydoc.getdoc(DESCRIBED[name])
    parser, told = doctest.DocTestParser(), []
    test = parser.get_doctest(text, dict(names), name, name, 0)
    assert test.examples, f"{name} has no example"
    doctest.DocTestRunner(verbose=False, optionflags=FLAGS).run(test, out=told.append)
    assert not told, "".join(told)


@pytest.mark.parametrize("name", PUBLIC)
def test_a_function_says_what_it_takes_gives_and_refuses(name: str) -> None:
    value, text = getattr(catenary, name), pydoc.getdoc(getattr(catenary, name))
    if inspect.isclass(value):
        return
    parameters = inspect.signature(value).parameters
    headings = ("Parameters", "Returns", "Raises", "Examples")
    for heading in headings if parameters else ("Returns", "Examples"):
        assert f"\n{heading}\n---" in text, heading
    for parameter in parameters:
        assert parameter in text.split("Returns\n---")[0], parameter
    assert "ollective" in text, "whether it is collective"


def test_the_documents_have_every_name() -> None:
    page = (DOCS / "python.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"^\| `(\w+)\(", page, re.MULTILINE))
    called = {name for name in PUBLIC if not inspect.isclass(getattr(catenary, name))}
    assert listed == called | {"Simulation"}
    reference = (DOCS / "reference" / "python.md").read_text(encoding="utf-8")
    described = re.findall(r"^::: catenary\.(\w+)$", reference, re.MULTILINE)
    assert sorted(described) == sorted(set(catenary.__all__) - {"__version__"})


@pytest.mark.parametrize("name", [name for name in PUBLIC if name[0].islower()])
def test_the_documents_name_arguments_in_their_order(name: str) -> None:
    page = (DOCS / "python.md").read_text(encoding="utf-8")
    (row,) = re.findall(rf"^\| `{name}\((.*?)\)`", page, re.MULTILINE)
    own = [n for n, one in inspect.signature(getattr(catenary, name)).parameters.items()
           if one.kind is not inspect.Parameter.KEYWORD_ONLY]  # fmt: skip
    names = row.split(", ") if row else []
    assert names == own[: len(names)]


def test_names_that_are_not_there_are_refused() -> None:
    with pytest.raises(AttributeError, match="no attribute 'lod'"):
        catenary.lod  # noqa: B018
    assert set(dir(catenary)) == set(catenary.__all__)


def test_examples_leave_nothing_behind(names: dict[str, Any]) -> None:
    assert not list(Path.cwd().glob("catenary_*"))
