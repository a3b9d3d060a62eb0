"""The Python pages of the documents run, one block after the other, as a reader would type them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from documents import blocks_of
from matplotlib.testing.compare import compare_images

pytestmark = pytest.mark.usefixtures("examined_here")

DOCS = Path(__file__).parents[3] / "docs"
NOTEBOOK = DOCS / "tutorials/python.md"
VARIANTS = ("300, 25)", "28e3, 20)")  # speeds and tensions, with their numbers
FEW = ("300, 3)", "28e3, 2)")


def programs(page: Path) -> list[str]:
    """The blocks of Python of a page."""
    return [b.body for b in blocks_of(page.read_text(encoding="utf-8")) if b.kind == "python"]


def run_all(
    blocks: list[str], names: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> list[str]:
    """Run blocks with the same names; what each has printed."""
    told = []
    for number, block in enumerate(blocks):
        exec(compile(block, f"block {number}", "exec"), names)
        told.append(capsys.readouterr().out)
    return told


@pytest.mark.timeout(280)
def test_the_page_of_the_interface(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    session, longer, steps, states, ranks = run_all(programs(DOCS / "python.md"), {}, capsys)
    assert re.fullmatch(r"\d+\.\d+ True\n", session)
    # The last step ends within its way, 0.08 m, of the later end.
    later, shape = longer.splitlines()
    assert 9.9 < float(later) < 10.1
    assert re.fullmatch(r"\(\d+, 1\)", shape)
    assert steps.startswith("5.0 ") or steps.startswith("4.99")
    gains = [float(word) for word in re.findall(r"sigma (\S+) N", states)]
    assert len(gains) == 3 and len(set(gains)) == 3
    assert ranks == "1 processes\n"


def check_notebook(told: list[str], names: dict[str, Any], n_speeds: int, n_tensions: int) -> None:
    """What the notebook has printed and made, for so many variants."""
    session, before, run, task, _, swept = told
    assert session.splitlines()[0] == "250.0 275.0"
    assert {line.partition(" - ")[0] for line in session.splitlines()[1:]} == {
        "train.speed_km_h",
        "line.n_spans",
    }
    assert before.startswith("[]\nen50318_2002: ") and "length_m" in before
    assert "mean_N" in run and "\nTrue [" in run and "N Frozen({'time'" in run
    assert len(names["table"]) == n_speeds * n_tensions and "worst_N" in task
    assert min(names["table"].worst_N) > 50.0
    assert names["table"].at_m.between(360.0, 600.0).all()
    # The slower the train beside the waves, the smaller sigma.
    sigma = names["field"]
    assert (sigma.iloc[-1, 0] < sigma.iloc[-1, -1]) and (sigma.iloc[0, 0] < sigma.iloc[0, -1])
    sigmas = [float(word) for word in re.findall(r"\d+\.\d+", swept.split("200 ")[1])]
    assert len(sigmas) == 4 and sigmas[0] < sigmas[2]  # more at 250 km/h


@pytest.mark.study
@pytest.mark.timeout(280)
def test_the_notebook_with_few_variants(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = programs(NOTEBOOK)
    for many, few in zip(VARIANTS, FEW, strict=True):
        assert sum(block.count(many) for block in blocks) == 1
        blocks = [block.replace(many, few) for block in blocks]
    names: dict[str, Any] = {}
    check_notebook(run_all(blocks, names, capsys), names, 3, 2)
    assert (tmp_path / "sigma.png").stat().st_size > 1000
    # The picture that the page shows, but for letters that another version draws otherwise.
    assert compare_images(str(NOTEBOOK.with_name("force.png")), "force.png", tol=10) is None


@pytest.mark.study
@pytest.mark.timeout(7200)
def test_the_notebook_with_all_variants(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    check_notebook(run_all(programs(NOTEBOOK), names, capsys), names, 25, 20)
    assert compare_images(str(NOTEBOOK.with_name("sigma.png")), "sigma.png", tol=10) is None


def test_the_task_of_a_student_takes_fifteen_lines() -> None:
    """Variants, and the worst dropper of each; imports of libraries left out."""
    (task,) = (block for block in programs(NOTEBOOK) if "speeds, tensions" in block)
    lines = [line for line in task.splitlines() if line.strip() and not line.startswith("import")]
    (picture,) = (block for block in programs(NOTEBOOK) if "contourf" in block)
    assert len(lines) <= 15 and len(picture.splitlines()) <= 10
