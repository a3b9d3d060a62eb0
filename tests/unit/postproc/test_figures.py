"""Layout and encoding of pictures: what is written stays within them, with little computation."""

from __future__ import annotations

import io

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from catenary.postproc.report.pictures import along_track, figures


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
