"""The environment, the version, recipes of packagers, and Matplotlib's own cache."""

from __future__ import annotations

import ast
import importlib.util
import json
import logging
import os
import re
import subprocess
import sys
import sysconfig
import tomllib
from collections.abc import Iterator
from datetime import date
from importlib import metadata
from pathlib import Path
from types import ModuleType

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from verb_runner import invoke

from catenary.cases.process import libraries

# --- the environment ------------------------------------------------------------------------------


ROOT = Path(__file__).parents[2]
SITE = Path(sysconfig.get_path("purelib"))
SHARED = {"numpy", "scipy", "h5py", "mpi4py", "petsc4py"}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
REQUIREMENTS = [
    Requirement(text)
    for text in (*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["test"])
]


@pytest.fixture
def versions() -> ModuleType:
    """.setup/versions.py, which is a script beside the package."""
    spec = importlib.util.spec_from_file_location("versions", ROOT / ".setup" / "versions.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.process
def test_packages_come_from_the_environment_only() -> None:
    show = "import json, sys; print(json.dumps([sys.path, sys.flags.no_user_site]))"
    done = subprocess.run(
        [sys.executable, "-I", "-c", show], capture_output=True, text=True, check=True
    )
    paths, _ = json.loads(done.stdout)
    standard = Path(sysconfig.get_path("stdlib"))
    foreign = [
        path
        for path in map(Path, paths)
        if path.exists()
        and not path.is_relative_to(sys.prefix)
        and path not in (standard, standard / "lib-dynload")
    ]
    assert foreign == []


def test_what_is_linked_shares_mpi_or_numpy() -> None:
    linked = {
        path.name.split("-")[0].split(".")[0] for path in SITE.parent.glob("system-packages/*")
    }
    assert linked >= SHARED, "run make setup"
    for name in SHARED:
        spec = importlib.util.find_spec(name)
        assert spec is not None and spec.origin is not None
        assert Path(spec.origin).is_relative_to(SITE.with_name("system-packages"))


@pytest.mark.process
def test_the_program_ignores_other_packages(tmp_path: Path) -> None:
    for name in ("numpy", "mpl_toolkits", "typer", "catenary"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise RuntimeError('of the user')\n")
    done = subprocess.run(
        [Path(sys.executable).with_name("catenary"), "list"],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
        timeout=240,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "en50318_2002" in done.stdout


@pytest.mark.parametrize("requirement", REQUIREMENTS, ids=lambda one: one.name)
def test_every_requirement_is_bounded_on_both_sides(requirement: Requirement) -> None:
    operators = {part.operator for part in requirement.specifier}
    assert operators == {">=", "<"}


@pytest.mark.parametrize(
    "path", sorted(ROOT.glob(".setup/tested/*.txt")), ids=lambda path: path.stem
)
def test_tested_versions_are_within_the_bounds(path: Path) -> None:
    lines = [line.removeprefix("# system: ") for line in path.read_text().splitlines()]
    tested = dict(line.split("==") for line in lines if "==" in line)
    for requirement in REQUIREMENTS:
        if requirement.marker is None or requirement.marker.evaluate():
            assert requirement.specifier.contains(tested[canonicalize_name(requirement.name)])


def test_other_versions_are_told(
    versions: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    there = versions.versions_in(versions.SITE)
    shared = versions.versions_in(versions.SITE.with_name("system-packages"))
    assert SHARED <= set(shared) and "catenary" not in there
    monkeypatch.setattr(versions, "TESTED", tmp_path / "python.txt")
    assert versions.remark().startswith("No versions were tested with Python 3.")
    monkeypatch.chdir(tmp_path)
    versions.write()
    assert versions.remark() == ""
    text = versions.TESTED.read_text().replace(
        f"pydantic=={there['pydantic']}", "pydantic==0.1\nof-tests==1.0"
    )
    versions.TESTED.write_text(text)
    assert versions.remark() == (
        f"Other than the tested versions: pydantic {there['pydantic']} (tested: 0.1)."
    )


@pytest.mark.process
def test_setup_says_what_it_does_and_for_how_long() -> None:
    """Its steps are named when they begin, a long one says how long it has taken so far, and what
    breaks in the midst of a step leaves no process behind that would hold the output open."""
    text = (ROOT / ".setup" / "setup.sh").read_text(encoding="utf-8")
    speaking = text[text.index("say() {") : text.index("fail() {")]
    script = f"""set -euo pipefail
{speaking}
sleep() {{ command sleep 0.2; }}
begin "installing things" "some 3 s"
command sleep 1
begin "checking them"
exit 3
"""
    done = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, check=False, timeout=240
    )
    assert done.returncode == 3
    so_far = r"(setup:   installing things, \d s so far\n)+"
    begun = r"setup: installing things \(some 3 s\) \.\.\.\n"
    said = rf"{begun}{so_far}setup:   \d s\nsetup: checking them \.\.\.\n"
    assert re.fullmatch(said, done.stderr), done.stderr


# --- the version stands in pyproject.toml; what else states it agrees -----------------------------


VERSION = PROJECT["version"]
HEADING = re.compile(r"^## (?!Unreleased)(\S+) - (\d{4}-\d\d-\d\d)$", re.MULTILINE)


def citation() -> dict[str, str]:
    """Entries of CITATION.cff that stand on one line."""
    text = (ROOT / "CITATION.cff").read_text()
    return dict(re.findall(r"^([\w-]+): (.+)$", text, re.MULTILINE))


def test_the_installed_program_tells_it() -> None:
    assert metadata.version("catenary") == VERSION, "run make setup"
    assert invoke("--version").stdout.splitlines()[0] == f"catenary {VERSION}"


def test_the_changelog_begins_with_unreleased_changes_and_then_has_it() -> None:
    text = (ROOT / "CHANGELOG.md").read_text()
    headings = re.findall(r"^## (.+)$", text, re.MULTILINE)
    assert headings[0] == "Unreleased"
    released = HEADING.findall(text)
    assert len(released) == len(headings) - 1
    assert released[0][0] == VERSION
    days = [date.fromisoformat(day) for _, day in released]
    assert days == sorted(days, reverse=True)


def test_the_citation_has_it_with_its_day() -> None:
    released = dict(HEADING.findall((ROOT / "CHANGELOG.md").read_text()))
    assert citation()["version"] == VERSION
    assert citation()["date-released"] == released[VERSION]


# --- recipes for other package managers, against the project's own declarations -------------------


RECIPES = ROOT / "docs" / "packaging"
# Names of the package index that conda-forge and Spack spell in another way.
OF_CONDA = {"matplotlib": "matplotlib-base", "gmsh": "python-gmsh"}
OF_SPACK = {"gmsh": "gmsh"}


def wanted() -> dict[str, str]:
    """Bounds of the versions of each package that the project needs."""
    pairs = (re.fullmatch(r"([\w-]+)(.*)", one) for one in PROJECT["dependencies"])
    return {pair[1]: pair[2] for pair in pairs if pair}


def test_the_recipe_of_conda_has_the_same_dependencies() -> None:
    recipe = yaml.safe_load((RECIPES / "recipe.yaml").read_text(encoding="utf-8"))
    needs = dict(one.split(" ", 1) for one in recipe["requirements"]["run"])
    assert needs.pop("python") == PROJECT["requires-python"]
    assert needs == {OF_CONDA.get(name, name): bounds for name, bounds in wanted().items()}


def test_the_package_of_spack_has_the_same_dependencies() -> None:
    tree = ast.parse((RECIPES / "package.py").read_text(encoding="utf-8"))
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    specs = [
        str(ast.literal_eval(call.args[0])).split(" ")[0]
        for call in calls
        if ast.unparse(call.func) == "depends_on"
    ]
    needs = {name: bounds for name, _, bounds in (spec.partition("@") for spec in specs)}
    for name, bounds in wanted().items():
        found = needs[OF_SPACK.get(name, f"py-{name}")]
        least, below = re.fullmatch(r">=([\d.]+),<([\d.]+)", bounds).groups()
        first, _, last = found.partition(":")
        assert first == least, name
        # The last version in a range of Spack stands for all that begin with it.
        *upper, end = (int(part) for part in below.split("."))
        assert last == ".".join(map(str, (*upper, end - 1))), name


def test_all_name_one_version() -> None:
    version = PROJECT["version"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    recipe = yaml.safe_load((RECIPES / "recipe.yaml").read_text(encoding="utf-8"))
    module = (RECIPES / "catenary.lua").read_text(encoding="utf-8")
    assert citation["version"] == recipe["context"]["version"] == version
    assert set(re.findall(r"\d+\.\d+\.\d+", module)) == {version}


# --- matplotlib's own cache -----------------------------------------------------------------------


@pytest.fixture(autouse=True)
def no_choice(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv(libraries.CACHE_VARIABLE, "")  # so that it is put back at the end
    monkeypatch.delenv(libraries.CACHE_VARIABLE)
    level = logging.getLogger("matplotlib").level
    yield
    logging.getLogger("matplotlib").setLevel(level)


def test_a_home_that_can_be_written_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "not" / "yet"))
    libraries.choose_matplotlib_folder()
    assert libraries.CACHE_VARIABLE not in os.environ


@pytest.mark.parametrize("home", ["file", "x" * 300])  # a name too long cannot be looked up
def test_without_a_home_it_is_in_a_folder_of_the_program(
    home: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / home))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "kept"))
    libraries.choose_matplotlib_folder()
    assert os.environ[libraries.CACHE_VARIABLE] == str(
        tmp_path / "kept" / "catenary" / "matplotlib"
    )


def test_without_any_folder_it_is_silent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "file"))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(libraries.tempfile, "gettempdir", lambda: str(tmp_path / "file"))
    libraries.choose_matplotlib_folder()
    assert libraries.CACHE_VARIABLE not in os.environ
    assert not logging.getLogger("matplotlib").isEnabledFor(logging.WARNING)
