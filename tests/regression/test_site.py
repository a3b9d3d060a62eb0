"""The documentation as a site: it is built without a warning and needs no network."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# What a page loads by itself; links that a reader follows may go anywhere.
_LOADED = re.compile(r"""(?:src=|<link[^>]*href=|url\()["']?(https?://[^"')]+)""")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the site, built where warnings are errors."""
    folder = tmp_path_factory.mktemp("site")
    subprocess.run(["make", "--no-print-directory", "links"], cwd=ROOT, check=True)
    command = [sys.executable, "-m", "mkdocs", "build", "-f", ".site/mkdocs.yml", "-d", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.study
@pytest.mark.process
@pytest.mark.timeout(280)
def test_no_page_loads_anything_from_the_network(site: Path) -> None:
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 60
    loaded = {page.name: _LOADED.findall(page.read_text(encoding="utf-8")) for page in pages}
    assert {name: found for name, found in loaded.items() if found} == {}


@pytest.mark.study
@pytest.mark.process
@pytest.mark.timeout(280)
def test_equations_keys_verbs_and_names_are_on_it(site: Path) -> None:
    theory = (site / "theory/one_solve.html").read_text(encoding="utf-8")
    assert theory.count("<math") > 30 and 'class="arithmatex"' not in theory
    keys = (site / "reference/keys.html").read_text(encoding="utf-8")
    assert "line.contact_wire.tension_N" in keys
    verbs = (site / "reference/command_line.html").read_text(encoding="utf-8")
    assert "--study" in verbs and "catenary animate" in verbs
    names = (site / "reference/python.html").read_text(encoding="utf-8")
    assert "with its [test] table" in names.lower() or "catenary.load" in names
    assert "Not run by the tests" in (site / "clusters.html").read_text(encoding="utf-8")
    schema = json.loads((site / "reference/case.schema.json").read_text(encoding="utf-8"))
    assert "line" in schema["properties"]
    assert json.loads((site / "tutorials/python.ipynb").read_text(encoding="utf-8"))["cells"]
