"""The environment: five packages of the system and no others, in the versions that were tested."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path
from types import ModuleType

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

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
