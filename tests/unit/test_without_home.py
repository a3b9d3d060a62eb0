"""A run of a user who has no home and may not write where the program is installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from program import ENTRY

NOBODY = ("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups")


@pytest.mark.parametrize("home", ["/nonexistent", "/root"])  # sudo may keep the home of its caller
@pytest.mark.study
@pytest.mark.process
@pytest.mark.skipif(
    os.geteuid() != 0 or not shutil.which("setpriv"), reason="another user takes root and setpriv"
)
def test_a_user_without_home_and_without_write_access(home: str) -> None:
    if subprocess.run([*NOBODY, "test", "-r", __file__], check=False).returncode:
        pytest.skip("another user cannot read this checkout")
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o777)
        run_as_nobody(Path(folder), home)


def run_as_nobody(folder: Path, home: str) -> None:
    words = ["run", "en50318_2002", "--short", "--quiet", "-o", str(folder / "run")]
    done = subprocess.run(
        [*NOBODY, sys.executable, "-c", ENTRY, *words],
        env={"HOME": home, "TMPDIR": str(folder)},
        cwd="/",
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0 and not done.stderr, done.stderr
    assert (folder / "run" / "summary.json").is_file()
