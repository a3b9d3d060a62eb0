"""Where compiled loops are kept: a folder that can be written, named after what they come from."""

from __future__ import annotations

import logging
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from numba import __version__ as numba_version

from catenary.solver.base.kernels import loop_cache

LOOP = "from catenary.solver.sizes import SIZE\n@compiled\ndef loop(x):\n    return x + SIZE\n"
COMPILE = """
import numpy as np
from catenary.solver.integrators.state_kernels import shift
places = np.zeros(2)
shift(np.ones(2), places, 3.0)
assert places[0] == 4.0
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """Sources of which one holds a loop and one a number that is compiled into it."""
    files = {
        "solver/loops.py": LOOP,
        "solver/sizes.py": "SIZE = 2\n",
        "solver/other.py": "from catenary.solver import loops\n",
        "mbs/more.py": "from catenary.solver import (\n    loops,\n)\n@in_line\ndef f(): ...\n",
    }
    for name, text in files.items():
        path = tmp_path / "package" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path / "package"


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A user with a home, a folder for temporary files and a program that nobody may write to."""
    for name in ("home", "tmp"):
        (tmp_path / name).mkdir()
    (tmp_path / "installed").touch()  # root may write to any folder, but not into a file
    monkeypatch.setattr(loop_cache, "_IN_TREE", tmp_path / "installed" / "loops")
    monkeypatch.setattr(loop_cache.tempfile, "gettempdir", lambda: str(tmp_path / "tmp"))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    for name in ("XDG_CACHE_HOME", loop_cache.VARIABLE):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


@pytest.fixture
def open_folder() -> Iterator[Path]:
    """A folder to which every user may write; those of pytest are closed to others."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o1777)
        yield Path(folder)


def chosen() -> Path | None:
    return loop_cache.folder.__wrapped__(numba_version)


def test_a_constant_of_another_file_is_part_of_a_loop(package: Path) -> None:
    files = loop_cache.sources(package)
    assert [str(path.relative_to(package)) for path in files] == [
        "mbs/more.py", "solver/loops.py", "solver/sizes.py"
    ]  # fmt: skip
    before = loop_cache.digest(files, "1")
    assert before != loop_cache.digest(files, "2")
    (package / "solver" / "sizes.py").write_text("SIZE = 3\n")
    assert before != loop_cache.digest(files, "1")


def test_every_file_with_a_decorated_loop_counts() -> None:
    root = Path(__file__).parents[3]
    decorated = {
        path
        for part in ("solver", "mbs", "cases", "postproc", "meshgen")
        for path in (root / part).rglob("*.py")
        if "\n@compiled" in path.read_text() or "\n@intrinsic" in path.read_text()
    }
    assert decorated and decorated <= set(loop_cache.sources(root))


def test_the_users_cache_then_a_private_folder_then_none(
    machine: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    first = chosen()
    assert first is not None and first.parent == machine / "home" / ".cache" / "catenary"
    monkeypatch.setenv("XDG_CACHE_HOME", str(machine / "cache"))
    second = chosen()
    assert second is not None and second.parent == machine / "cache" / "catenary"
    monkeypatch.setenv("XDG_CACHE_HOME", str(machine / "installed"))  # a file
    third = chosen()
    private = machine / "tmp" / f"catenary-{os.geteuid()}"
    assert third is not None and third.parent == private
    assert private.stat().st_mode & 0o777 == 0o700
    private.chmod(0o777)  # as another user may have left it
    with caplog.at_level(logging.WARNING, "catenary"):
        assert chosen() is None
    assert caplog.messages == [
        "compiled loops are not kept, every run compiles them anew: no folder can be written "
        "(CATENARY_CACHE_DIR)"
    ]


def test_the_users_choice_is_the_only_one(
    machine: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv(loop_cache.VARIABLE, str(machine / "mine"))
    found = chosen()
    assert found is not None and found.parent == machine / "mine"
    monkeypatch.setenv(loop_cache.VARIABLE, str(machine / "installed" / "x"))
    with caplog.at_level(logging.WARNING, "catenary"):
        assert chosen() is None
    assert f"{machine}/installed/x cannot be written" in caplog.messages[0]


def test_what_the_installation_brings_is_copied_once(
    machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop_cache, "_filled", lambda target, shipped: target)
    name = str(chosen() and chosen().name)  # type: ignore[union-attr]
    monkeypatch.undo()
    shipped, target = machine / "shipped" / name, machine / "user" / name
    (shipped / "solver").mkdir(parents=True)
    (shipped / "solver" / "loop.nbi").write_text("compiled")
    target.parent.mkdir()
    for _ in range(2):
        assert loop_cache._filled(target, shipped) == target
        assert (target / "solver" / "loop.nbi").read_text() == "compiled"
    assert [path.name for path in target.parent.iterdir()] == [name]


def test_loops_of_other_sources_go_after_a_month(machine: Path) -> None:
    base = machine / "home" / ".cache" / "catenary"
    for name, age in (("loops-old", 40), ("loops-new", 20)):
        (base / name).mkdir(parents=True)
        then = (base / name).stat().st_mtime - age * 86400
        os.utime(base / name, (then, then))
    found = chosen()
    assert found is not None
    assert {path.name for path in base.iterdir()} == {"loops-new", found.name}


def test_numbas_own_folder_is_left_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    import numba

    from catenary.solver.base.kernels.compiled import compiled

    monkeypatch.setattr(numba.config, "CACHE_DIR", "somewhere")
    compiled(chosen)
    assert numba.config.CACHE_DIR == "somewhere"


@pytest.mark.process
@pytest.mark.skipif(
    os.geteuid() != 0 or not shutil.which("setpriv"), reason="another user takes root and setpriv"
)
@pytest.mark.parametrize("kept", [True, False])
def test_a_user_without_home_and_without_write_access(open_folder: Path, kept: bool) -> None:
    nobody = ("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups")
    if subprocess.run([*nobody, "test", "-r", loop_cache.__file__], check=False).returncode:
        pytest.skip("another user cannot read this checkout")
    chosen = {} if kept else {loop_cache.VARIABLE: "/nonexistent/loops"}
    done = subprocess.run(
        [*nobody, sys.executable, "-c", COMPILE],
        env={"HOME": "/nonexistent", "TMPDIR": str(open_folder), **chosen},
        cwd="/",
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    if not kept:
        assert "anew: /nonexistent/loops cannot be written (CATENARY" in done.stderr
        assert done.stderr.count("\n") == 1
    else:
        assert done.stderr == ""
        kept_loops = "catenary-65534/loops-*/integrators_*/state_kernels.shift-*.nbc"
        assert list(open_folder.glob(kept_loops))
