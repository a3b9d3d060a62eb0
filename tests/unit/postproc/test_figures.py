"""Pictures: layout, encoding, the program's own style, marks, ranges."""

from __future__ import annotations

import ast
import io
import json
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image
from program import catenary_started

from catenary.postproc.report import report
from catenary.postproc.report.pictures import along_track, figures, force_pictures
from catenary.postproc.report.pictures.along_track import mark_line
from catenary.postproc.report.pictures.figures import MOST_POINTS, thinned_ranges

# --- layout and encoding of pictures --------------------------------------------------------------


def drawn(figure: Figure) -> Image.Image:
    return Image.open(io.BytesIO(figures.png(figure)))


def panel_of(scale: float, n: int, shared: bool) -> Figure:
    figure, panels = figures.stacked(0.7 + 2.4 * n, n, shared=shared)
    for number, axes in enumerate(panels):
        axes.plot(np.arange(5.0), scale * np.arange(-2.0, 3.0), label=f"curve {number}")
        figures.tidy(axes, "" if shared else "time [s]", "force [N]", "Title")
        figures.legend_above(axes)
    panels[-1].set_xlabel("time [s]")
    return figure


def texts_of(figure: Figure) -> list[Text]:
    """All texts that are drawn: ticks beyond the limits of an axis are placed, but not drawn."""
    hidden: set[object] = set()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = axis.get_view_interval()
            for tick in axis.get_major_ticks():
                if not low <= tick.get_loc() <= high:
                    hidden |= {tick.label1, tick.label2}
    texts = [text for text in figure.findobj(Text) if isinstance(text, Text)]
    return [text for text in texts if text not in hidden and text.get_visible() and text.get_text()]


@pytest.mark.parametrize("n, shared", [(1, False), (2, False), (3, True)])
@pytest.mark.parametrize("scale", [1.3e-3, 1.0, 3.1e4])
def test_texts_lie_within_the_picture_and_beside_each_other(
    n: int, shared: bool, scale: float
) -> None:
    figure = panel_of(scale, n, shared)
    picture = drawn(figure)
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts_of(figure)]
    assert len(boxes) > 7 * n
    for words, box in boxes:
        inside = box.x0 >= 0 and box.y0 >= 0 and box.x1 <= picture.width and box.y1 < picture.height
        assert inside, words
    for place, (words, box) in enumerate(boxes):
        assert not [other for other, its in boxes[place + 1 :] if box.overlaps(its)], words


@pytest.mark.parametrize("scale", [1.3e-3, 1.0, 3.1e4])
def test_a_panel_has_few_ticks(scale: float) -> None:
    """A tick with its label and its line of the grid takes as long to draw as a curve."""
    figure = panel_of(scale, 1, False)
    drawn(figure)
    (axes,) = figure.axes
    assert 4 <= len(axes.get_xticks()) <= 9 and 3 <= len(axes.get_yticks()) <= 6


@pytest.mark.parametrize("scale", [1.3e-3, -1.0, 3.1e4])
def test_no_tick_is_made_that_is_not_drawn(scale: float) -> None:
    figure = panel_of(scale, 1, False)
    (axes,) = figure.axes
    axes.invert_xaxis()
    drawn(figure)
    for axis in (axes.xaxis, axes.yaxis):
        low, high = sorted(axis.get_view_interval())
        places = [tick.get_loc() for tick in axis.get_major_ticks()]
        assert len(places) >= 3 and low <= min(places) and max(places) <= high


def test_the_layout_of_panels_is_not_computed() -> None:
    """It takes as long as the drawing."""
    figure, _ = figures.stacked(3.0, 1)
    assert figure.get_layout_engine() is None
    assert figures.new_figure(3.0).get_layout_engine() is not None


def test_a_dollar_sign_is_no_formula() -> None:
    figure = panel_of(1.0, 1, False)
    figure.axes[0].set_title("a $\\frac{1}$ b", loc="left")
    figure.axes[0].text(1.0, 0.0, "5 $^ of 7 $")
    assert drawn(figure).width == 1170


def test_letters_without_a_glyph_are_boxes_and_no_warning() -> None:
    figure = panel_of(1.0, 1, False)
    figure.axes[0].set_title("架線")
    drawn(figure)


def test_colours_are_as_given() -> None:
    """A palette of few colours would change them."""
    figure, (axes,) = figures.stacked(3.0, 1)
    axes.axvspan(0.0, 1.0, color=figures.SHADE)
    axes.set_xlim(0.0, 1.0)
    picture = drawn(figure)
    found = picture.getpixel((picture.width // 2, picture.height // 2))
    assert found == tuple(int(figures.SHADE[i : i + 2], 16) for i in (1, 3, 5))


def test_ranges_too_small_for_a_line_are_dashes() -> None:
    _, (axes,) = figures.stacked(3.0, 1)
    x = np.array([1.0, 2.0, 3.0, 4.0])
    along_track.draw_ranges(
        axes, x, np.array([0.0, 60.0, 59.5, 60.0]), np.array([200.0, 60.0, 60.0, 63.0])
    )
    _, dashes = axes.lines
    np.testing.assert_array_equal(dashes.get_xydata(), [[2.0, 60.0], [3.0, 60.0]])


TITLE = "Elasticity along a span"


@pytest.mark.parametrize("n_wires", [1, 2, 4, 8])
def test_a_long_legend_stands_below_the_title(n_wires: int) -> None:
    """However many wires a panel names: no legend covers a title or a curve, or leaves the page."""
    figure, panels = figures.stacked(5.2, 2)
    for axes in panels:
        for number in range(n_wires):
            axes.plot([0.0, 1.0], [0.0, number], label=f"contact wire {number} alone")
        figures.tidy(axes, "position [m]", "lift [mm/N]", TITLE)
        figures.legend_above(axes)
    before = [axes.get_window_extent().height for axes in panels]
    picture = drawn(figure)
    boxes = []
    for axes in panels:
        legend = axes.get_legend()
        assert legend is not None and len(legend.get_texts()) == n_wires
        boxes += [legend.get_window_extent(), axes.get_window_extent()]
        title = [
            text for text in texts_of(figure) if text.get_text() == TITLE and text.axes is axes
        ]
        boxes += [text.get_window_extent() for text in title]
    for place, box in enumerate(boxes):
        assert box.x0 >= 0 and box.y0 >= 0
        assert box.x1 <= picture.width and box.y1 <= picture.height
        assert not any(box.overlaps(other) for other in boxes[place + 1 :])
    # Panels keep their height: the picture grows.
    assert [axes.get_window_extent().height for axes in panels] == pytest.approx(before)


# --- pictures in the program's own style, whatever a user's matplotlibrc says; a picture costs ----


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


# --- which of very many ranges a picture draws ----------------------------------------------------


def test_few_ranges_are_drawn_as_they_are() -> None:
    assert thinned_ranges(np.zeros(MOST_POINTS), np.ones(MOST_POINTS)) == slice(None)


def test_of_many_the_peaks_of_both_ends_are_drawn() -> None:
    random = np.random.default_rng(3)
    low = random.normal(size=4 * MOST_POINTS)
    high = low + random.exponential(size=low.size)
    drawn = thinned_ranges(low, high)
    assert isinstance(drawn, np.ndarray) and drawn.size <= MOST_POINTS + 4
    assert low[drawn].min() == low.min() and high[drawn].max() == high.max()
    # Each hundredth of the line has its own peaks still.
    for part in np.array_split(np.arange(low.size), 100):
        inside = drawn[(drawn >= part[0]) & (drawn <= part[-1])]
        assert low[inside].min() == low[part].min() and high[inside].max() == high[part].max()


# --- marks of a line in pictures of a run ---------------------------------------------------------


class Told:
    """Masts every 50 m, a dropper in the middle of each span."""

    def __init__(self, n_spans: int) -> None:
        self._support = 50.0 * np.arange(n_spans + 1)
        self.evaluation = (0.0, self._support[-1])

    def line(self, name: str) -> np.ndarray:
        return {"support_x": self._support, "dropper_x": self._support[:-1] + 25.0}[name]


@pytest.mark.parametrize(
    ("n_spans", "marks"),
    [(20, {"support", "dropper"}), (300, {"dropper"}), (2000, set())],
)
def test_marks_that_would_make_a_grey_ground_are_left_out(n_spans: int, marks: set[str]) -> None:
    figure, axes = plt.subplots()
    mark_line(axes, Told(n_spans), 0.0, 50.0 * n_spans)  # type: ignore[arg-type]
    assert set(axes.get_legend_handles_labels()[1]) - {"evaluation stretch"} == marks
    plt.close(figure)
