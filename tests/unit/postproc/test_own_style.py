"""Pictures in the program's own style, whatever a user's matplotlibrc says; a picture costs nothing
but itself."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import matplotlib
import pytest
from matplotlib.figure import Figure
from program import catenary_started

from catenary.postproc.report import report
from catenary.postproc.report.pictures import figures, force_pictures

ROOT = Path(__file__).parents[3]
# A style without a visible curve, and letters from LaTeX, which need not be installed.
FOREIGN = {
    "text.usetex": True,
    "axes.facecolor": "black",
    "axes.edgecolor": "black",
    "lines.linestyle": "None",
    "font.size": 22.0,
}


MAKERS = ("stacked", "new_figure", "panels", "Figure")  # functions of which each makes a figure


def test_every_function_that_makes_a_figure_does_so_in_the_own_style() -> None:
    makers = []
    for path in [*(ROOT / "postproc").rglob("*.py"), *(ROOT / "cases").rglob("*.py")]:
        text = path.read_text(encoding="utf-8")
        for function in ast.parse(text).body if any(name in text for name in MAKERS) else []:
            if not isinstance(function, ast.FunctionDef):
                continue
            called = {ast.unparse(one.func) for one in ast.walk(function) if type(one) is ast.Call}
            if any(name.split(".")[-1] in MAKERS for name in called):
                makers.append(path)
                styled = {ast.unparse(one) for one in function.decorator_list}
                assert (
                    styled & {"own_style()", "figures.own_style()"} or path.name == "figures.py"
                ), f"{path}: {function.name} draws in the user's style"
    assert len(makers) > 20


def test_a_users_settings_change_no_picture_and_stay_the_users(
    run_folder: Path, tmp_path: Path
) -> None:
    plain, styled = tmp_path / "plain", tmp_path / "styled"
    plain.mkdir()
    styled.mkdir()
    report.write_report(run_folder, plain)
    with matplotlib.rc_context(FOREIGN):
        report.write_report(run_folder, styled)
        assert matplotlib.rcParams["text.usetex"] is True
    pictures = sorted(plain.glob("*.png"))
    assert len(pictures) >= 7
    for path in pictures:
        assert (styled / path.name).read_bytes() == path.read_bytes(), path.name


@pytest.mark.usefixtures("quick_report")
def test_a_picture_that_cannot_be_drawn_costs_itself_alone(
    run_folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    def refuse(*words: object) -> Figure:
        raise RuntimeError("no such font")

    monkeypatch.setattr(force_pictures, "contact_force", refuse)
    report.write_report(run_folder, tmp_path)
    assert caplog.messages == [
        "contact_force.png was not drawn (no such font); all figures are in the other files"
    ]
    assert not (tmp_path / "contact_force.png").exists()
    assert (tmp_path / "histogram.png").exists() and (tmp_path / "report.html").exists()
    assert json.loads((tmp_path / "summary.json").read_text())["outcome"] == "done"


def test_the_summary_is_there_before_the_first_picture(
    run_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Killed(BaseException):
        """As a signal ends the process."""

    def end(*words: object) -> dict[str, bytes]:
        raise Killed

    monkeypatch.setattr(figures, "painted", end)
    with pytest.raises(Killed):
        report.write_report(run_folder, tmp_path)
    assert json.loads((tmp_path / "summary.json").read_text())["outcome"] == "done"


def picture_drawn_in(folder: Path) -> bytes:
    """A line as a process draws it that imports Matplotlib in this working directory."""
    words = ("mesh", "en50318_2002", "-o", "line.png")
    with catenary_started(*words, cwd=folder, pictures=True) as program:
        done = program.end()
    assert (done.code, done.stderr) == (0, "")
    return (folder / "line.png").read_bytes()


@pytest.fixture(scope="module")
def usual_picture(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return picture_drawn_in(tmp_path_factory.mktemp("usual"))


BROKEN = {
    "no text": b"axes.facecolor: \xff\xfe\x00",
    "other words": b"axes.facecolor black\nnonsense\ntext.usetex: perhaps\n",
    "a folder": None,
}


# A file is looked for by name and never read, so that one content shows it; and when Matplotlib is
# imported, for all pictures of a process, so that one picture does.
@pytest.mark.process
@pytest.mark.parametrize(
    ("of_the_user", "what"),
    [
        (False, "no text"),
        *(
            pytest.param(of_the_user, what, marks=pytest.mark.study)
            for of_the_user, what in (
                (True, "no text"),
                (False, "other words"),
                (False, "a folder"),
            )
        ),
    ],
)
def test_a_matplotlibrc_that_cannot_be_read_changes_no_picture(
    usual_picture: bytes,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    of_the_user: bool,
    what: str,
) -> None:
    """Of the user, or in the working directory."""
    folder = tmp_path
    if of_the_user:
        monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
        folder = tmp_path / "config" / "matplotlib"
        folder.mkdir(parents=True)
    content = BROKEN[what]
    if content is None:
        (folder / "matplotlibrc").mkdir()
    else:
        (folder / "matplotlibrc").write_bytes(content)
    assert picture_drawn_in(tmp_path) == usual_picture
