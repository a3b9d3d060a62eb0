"""What is installed: the package catenary, the five folders within it, their data, and nothing
under a bare name."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tarfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.process

ROOT = Path(__file__).parents[2]
PARTS = ("meshgen", "solver", "mbs", "postproc", "cases")
FACE = "cases/api"  # the files of the package itself
BUILT_FROM = (*PARTS, "pyproject.toml", "setup.py", "LICENSE", "README.md")
OBJECTS = Path("build", "kernels")
KERNELS = f"catenary/solver/kernels/native{sysconfig.get_config_var('EXT_SUFFIX')}"
LIBRARY = "catenary/solver/kernels/libcatenary.so"

# What a program finds from outside the checkout, printed as JSON.
SHOW = """
import importlib, json, sys
from pathlib import Path
modules = sys.argv[1:]
print(json.dumps({name: str(Path(importlib.import_module(name).__file__)) for name in modules}))
"""


def run(*command: str | Path, cwd: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME")}
    return subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env={**environment, **variables},
        capture_output=True,
        text=True,
        check=False,
        timeout=200,
    )


def must(done: subprocess.CompletedProcess[str]) -> str:
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def installed_name(path: Path) -> str:
    """Under which name a file of the checkout is installed."""
    name = f"catenary/{path.relative_to(ROOT)}"
    return name.replace(f"/{FACE}/", "/").replace("catenary/solver/base/", "catenary/base/")


def python_files() -> list[Path]:
    """Python files of the checkout that are to be installed."""
    return [
        path for part in PARTS for end in ("py", "pyi") for path in (ROOT / part).rglob(f"*.{end}")
    ]


def data() -> list[Path]:
    """Data of the checkout that a run or a report reads."""
    patterns = (
        f"{FACE}/py.typed",
        "cases/*/case.toml",
        "cases/*/README.md",
        "cases/*/reference/*.csv",
        "cases/*/study.toml",
        "cases/studies/hard/hard.toml",
        "cases/studies/reference/*.toml",
        "cases/studies/reference/data/*",
        "postproc/report/templates/*",
        "postproc/film/*.template",
        "postproc/standards/books/*.toml",
        "solver/kernels/simulation/catenary.h",
    )
    return [path for pattern in patterns for path in ROOT.glob(pattern) if path.is_file()]


def kernel_files() -> set[str]:
    """Sources and headers of the kernels, by their names in the checkout."""
    return {str(path.relative_to(ROOT)) for path in ROOT.glob("solver/kernels/*/*.[ch]pp")}


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what a package is built from: building leaves its traces there.

    The kernels' objects are part of it, or each wheel would take as long as the kernels compile.
    """
    copy = tmp_path_factory.mktemp("sources")
    shutil.copytree(ROOT / OBJECTS, copy / OBJECTS)
    for name in BUILT_FROM:
        if (ROOT / name).is_dir():
            shutil.copytree(
                ROOT / name,
                copy / name,
                ignore=shutil.ignore_patterns("__pycache__", "results", "*.so"),
            )
        elif (ROOT / name).exists():
            shutil.copy2(ROOT / name, copy / name)
    return copy


@pytest.fixture(scope="module")
def installed(sources: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that holds the wheel's content as pip installs it."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input")
    must(
        run(
            *pip, "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index",
            "--wheel-dir", folder, sources, cwd=folder,
        )
    )  # fmt: skip
    (wheel,) = folder.glob("catenary-*.whl")
    target = folder / "target"
    must(run(*pip, "install", "--quiet", "--no-deps", "--target", target, wheel, cwd=folder))
    return target


@pytest.mark.study
def test_the_wheel_is_imported_from_where_it_is_installed(installed: Path, tmp_path: Path) -> None:
    modules = (
        "catenary",
        "catenary.scenes",
        "catenary.meshgen",
        "catenary.meshgen.line",
        "catenary.base.errors",
        "catenary.solver.problem.problem",
        "catenary.solver.kernels.native",
        "catenary.mbs.lumped",
        "catenary.postproc",
        "catenary.cases",
    )
    found = json.loads(
        must(run(sys.executable, "-c", SHOW, *modules, cwd=tmp_path, PYTHONPATH=str(installed)))
    )
    assert sorted(found) == sorted(modules)
    for name, file in found.items():
        assert Path(file).is_relative_to(installed), f"{name} came from {file}"


@pytest.mark.study
def test_the_wheel_holds_all_modules_and_data_and_no_tests(installed: Path) -> None:
    there = {str(path.relative_to(installed)) for path in installed.rglob("*") if path.is_file()}
    ours = {name for name in there if name.startswith("catenary/") and "__pycache__" not in name}
    assert ours == set(map(installed_name, (*python_files(), *data()))) | {KERNELS, LIBRARY}
    # beside it only the metadata and the program
    tops = {Path(name).parts[0] for name in there}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"catenary", "bin"}
    assert (installed / "bin" / "catenary").is_file()


@pytest.mark.study
def test_the_wheel_names_both_licences_and_holds_their_texts(installed: Path) -> None:
    """The program is BSD-3-Clause, the reference solutions that it brings are CC BY 4.0."""
    (info,) = installed.glob("catenary-*.dist-info")
    told = (info / "METADATA").read_text().partition("\n\n")[0].splitlines()
    assert "License-Expression: BSD-3-Clause AND CC-BY-4.0" in told
    texts = [line.removeprefix("License-File: ") for line in told if line.startswith("License-F")]
    for name, word in zip(sorted(texts), ("BSD", "CC-BY-4.0"), strict=True):
        assert word in (info / "licenses" / name).read_text()


@pytest.mark.study
def test_the_source_archive_can_build_the_wheel(sources: Path, tmp_path: Path) -> None:
    build = f"from setuptools.build_meta import build_sdist; print(build_sdist({str(tmp_path)!r}))"
    must(run(sys.executable, "-c", build, cwd=sources))
    (archive,) = tmp_path.glob("catenary-*.tar.gz")
    with tarfile.open(archive) as content:
        names = {name.partition("/")[2] for name in content.getnames()}
    wanted = {str(path.relative_to(ROOT)) for path in (*python_files(), *data())}
    assert wanted | kernel_files() | {"pyproject.toml", "setup.py", "LICENSE"} <= names
    assert not [name for name in names if name.endswith(".so")]


@pytest.mark.study
def test_a_source_is_compiled_again_when_a_header_changes(sources: Path, tmp_path: Path) -> None:
    """Told by a compiler of the usual one's name, which writes down how it is called."""
    (made,) = sources.glob(f"{OBJECTS}/*/solver/kernels/python/module.o")
    compiler = shlex.split(made.with_suffix(".command").read_text())[0]
    calls = tmp_path / "calls"
    (tmp_path / Path(compiler).name).write_text(f"""#!/bin/sh
echo "$@" >>{calls}
while [ "$1" != -o ]; do shift; done
echo >"$2"
""")
    (tmp_path / Path(compiler).name).chmod(0o755)

    def compiled() -> bool:
        calls.write_text("")
        build = ("-I", "setup.py", "--quiet", "build_ext", "--build-lib", tmp_path / "lib")
        must(run(sys.executable, *build, cwd=sources, PATH=f"{tmp_path}:{os.environ['PATH']}"))
        return "-c solver/kernels/python/module.cpp" in calls.read_text()

    assert not compiled()
    (sources / "solver" / "kernels" / "base" / "of_nobody.hpp").write_text("")
    assert not compiled()
    (sources / "solver" / "kernels" / "base" / "targets.hpp").touch()
    assert compiled()


@pytest.mark.parametrize("part", PARTS)
def test_a_bare_name_is_refused_with_a_hint(part: str) -> None:
    done = run(sys.executable, "-c", f"import {part}", cwd=ROOT)
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith(f"ImportError: import catenary.{part}, not {part}: ")


@pytest.mark.parametrize("wheel", [False, pytest.param(True, marks=pytest.mark.study)])
def test_the_package_itself_has_one_name(
    wheel: bool, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    place = {"PYTHONPATH": str(request.getfixturevalue("installed"))} if wheel else {}
    done = run(sys.executable, "-P", "-c", "import catenary.cases.api", cwd=tmp_path, **place)
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    says = "ImportError: import catenary, not catenary.cases.api: "
    # From where a wheel is alone there is no such file; here the checkout is found behind it.
    assert last.startswith((says, "ModuleNotFoundError"))


@pytest.mark.study
def test_the_wheel_has_the_public_names(installed: Path, tmp_path: Path) -> None:
    """Each from its file; `py.typed` says to type checkers that they have types."""
    program = (
        "import catenary, pathlib; print(pathlib.Path(catenary.__file__).parent);"
        "print(all(getattr(catenary, name) is not None for name in catenary.__all__))"
    )
    told = must(run(sys.executable, "-c", program, cwd=tmp_path, PYTHONPATH=str(installed)))
    assert told.splitlines() == [str(installed / "catenary"), "True"]
    assert (installed / "catenary" / "py.typed").is_file()


def test_the_editable_install_is_found_from_elsewhere(tmp_path: Path) -> None:
    modules = ["catenary", "catenary.runs", *(f"catenary.{part}" for part in PARTS)]
    found = json.loads(must(run(sys.executable, "-c", SHOW, *modules, cwd=tmp_path)))
    face = {"catenary": "__init__.py", "catenary.runs": "runs.py"}
    assert found == {
        **{name: str(ROOT / FACE / file) for name, file in face.items()},
        **{f"catenary.{part}": str(ROOT / part / "__init__.py") for part in PARTS},
    }


def test_the_program_is_installed_beside_the_interpreter() -> None:
    program = Path(sys.executable).with_name("catenary")
    assert os.access(program, os.X_OK), "run make setup"
