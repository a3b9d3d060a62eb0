"""What a full report says in detail, against signals whose spectra and margins are known."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import html5lib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from catenary import InputError
from catenary.postproc.evaluate import statistics
from catenary.postproc.evaluate.verdict import Criterion, criteria_of
from catenary.postproc.read.results import Results
from catenary.postproc.report import page as pages
from catenary.postproc.report.page import EvaluatedRun
from catenary.postproc.report.pictures import figures, force_pictures, interactive, line_pictures
from catenary.postproc.report.report import SECTIONS, write_report
from catenary.postproc.report.sections import acceptance, dynamics


def evaluated(results: Results) -> EvaluatedRun:
    found = statistics.evaluate(results)
    return EvaluatedRun(results, found, criteria_of(results, found))


def test_spectrum_has_the_power_of_each_part(run_folder: Path) -> None:
    """Of a sine of amplitude a, a^2/2: around 9 Hz 15 N and 20 N, around 60 Hz nothing is shown.

    Hann's window spreads a line over four bins; those within six hold all but 1e-4 of it. The
    lines at 1.67 and 60 Hz are 20 bins and more away, where the window has fallen to 1e-5.
    """
    with Results(run_folder) as results:
        lengths = dynamics.passing_lengths(results)
        (axes,) = force_pictures.force_spectrum(results, lengths).axes
    assert lengths == pytest.approx({"span": 50.0, "dropper": 5.0})
    curves = {line.get_label(): np.asarray(line.get_xydata()) for line in axes.lines}
    for name, amplitude in (("leading", 15.0), ("trailing", 20.0)):
        frequency, power = curves[name].T
        width = frequency[1] - frequency[0]
        near = np.abs(frequency - 9.0) <= 6.0 * width
        assert power[near].sum() * width == pytest.approx(0.5 * amplitude**2, rel=2e-3)
        assert frequency.max() <= 60.0
    # At 300 km/h a span of 50 m passes 5/3 times a second.
    assert "span passing, 1.67 Hz and multiples" in curves
    assert "dropper passing, 16.67 Hz and multiples" in curves


def test_droppers_that_carry_no_contact_wire_pass_nothing(
    run_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As those of a compound line between messenger and auxiliary wire: of each two, one here."""
    with Results(run_folder) as results:
        wires = results.dropper_wires()
        wires[::2, 1] = list(results.roles).index("messenger_wire")
        monkeypatch.setattr(results, "dropper_wires", lambda: wires)
        assert dynamics.passing_lengths(results)["dropper"] == pytest.approx(10.0)


def test_gradient_of_the_contact_point(run_folder: Path) -> None:
    """Of 15 mm over 50 m: 2 pi 15 mm / 50 m; filter and steps of 83 mm change 1e-4 of it."""
    with Results(run_folder) as results:
        found = dynamics.contact_height(results, 0)
        assert found is not None
        x, height, gradient = found
        inside = (x >= results.evaluation[0]) & (x <= results.evaluation[1])
    assert np.ptp(height[inside]) == pytest.approx(0.030, rel=1e-3)
    assert np.abs(gradient[inside]).max() == pytest.approx(2 * np.pi * 0.015 / 50.0, rel=1e-3)


def criterion(value: float, limit: float, relation: str, quantity: str) -> Criterion:
    passed = value <= limit if relation == "<=" else value > limit
    words = f"{quantity} of the run", value, limit, "N", relation, passed, "clause"
    return Criterion(*words, quantity=quantity, pantograph="pantograph")


def told(error: float, *criteria: Criterion, start_share: float = 0.0) -> str:
    arrivals = {"pantographs": [{"start_share_of_std": start_share}]}
    run: Any = SimpleNamespace(
        results=SimpleNamespace(attributes={"arrivals": arrivals}),
        criteria=criteria,
        measured={},
        statistics=SimpleNamespace(pantographs=[SimpleNamespace(name="pantograph", std=30.0)]),
        indicators=SimpleNamespace(force_error=np.array([error])),
    )
    return " ".join(acceptance.nearest_limit(run))


def test_an_error_larger_than_the_margin_could_turn_a_verdict() -> None:
    mean = criterion(149.0, 150.0, "<=", "mean_force")
    largest = criterion(345.0, 350.0, "<=", "force_max")
    assert (
        "could change the verdict on: mean_force of the run (margin 1.0 N, error 1.50 N)."
        in told(1.5, mean)
    )
    assert "it is smaller than the margin" in told(0.9, mean)
    # Extremes have three times the rms error of the history.
    assert "could change the verdict on: force_max of the run" in told(1.7, largest)
    assert "it is smaller than the margin" in told(1.6, largest)
    # A force that is nearly lost has a margin as well, though no share of its limit, which is zero.
    assert (
        "could change the verdict on: force_min of the run (margin 2.0 N, error 3.00 N)."
        in told(1.0, criterion(2.0, 0.0, ">", "force_min"))
    )
    # A failed criterion can be turned as well; what has no estimate cannot be.
    assert "could change the verdict on: mean_force of the run (margin -1.0" in told(
        1.5, criterion(151.0, 150.0, "<=", "mean_force")
    )
    assert "change" not in told(np.nan, mean) and "smaller" not in told(np.nan, mean)


def test_what_the_start_leaves_is_told_where_it_could_turn_a_verdict() -> None:
    """10 % of a deviation of 30 N are 3 N in the history, and three times that in extremes."""
    spread = criterion(42.0, 45.5, "<=", "force_std")
    assert "Start" not in told(0.1, spread, start_share=0.1)
    near = criterion(43.0, 45.5, "<=", "force_std")
    assert (
        "Start-up, which still affects the evaluated stretch, could change the verdict on: "
        "force_std of the run (margin 2.5 N, error 3.00 N)."
    ) in told(0.1, near, start_share=0.1)
    largest = criterion(342.0, 350.0, "<=", "force_max")
    assert "force_max of the run (margin 8.0 N, error 9.00 N)" in told(
        0.1, spread, largest, start_share=0.1
    )
    assert "Start" not in told(0.1, near, largest, start_share=0.01)


def test_the_nearest_limit_is_the_smallest_share() -> None:
    mean = criterion(147.0, 150.0, "<=", "mean_force")  # 2 %
    largest = criterion(346.5, 350.0, "<=", "force_max")  # 1 %
    zero = criterion(1.0, 0.0, ">", "force_min")  # no share of zero
    farther = criterion(2.0, 0.0, ">", "force_min")
    lost = criterion(-1.0, 0.0, ">", "force_stat_min")  # failed
    assert told(0.1, mean, largest, farther, zero).startswith(
        "Nearest to its limit: force_max of the run, with a margin of 3.5 N (1.0 %). "
        "Margins from limits of zero, without a percentage: force_min of the run (1.0 N)."
    )
    assert "zero" not in told(0.1, mean, lost)
    # A number of the scene stands at its limit on purpose.
    speed = criterion(300.0, 300.0, "<=", "train_speed")
    assert "train_speed" not in told(0.1, mean, speed)
    # One that failed has no margin.
    failed = criterion(150.1, 150.0, "<=", "mean_force")
    assert told(0.1, failed, largest).startswith("Passed criterion nearest to its limit: force")


def names_in(folder: Path) -> set[str]:
    page = html5lib.parse((folder / "report.html").read_text(), namespaceHTMLElements=False)
    return {one.get("id") for one in page.iter("h2")} - {None}


@pytest.mark.usefixtures("quick_report")
def test_sections_are_there_where_they_apply(
    run_folder: Path, tmp_path: Path, make_march: Any
) -> None:
    write_report(run_folder, tmp_path, None, SECTIONS, vector=True)
    full = {
        "acceptance",
        "checks",
        "force",
        "spectrum",
        "motion",
        "places",
        "rest",
        "effects",
        "run",
        "above",
    }
    assert names_in(tmp_path) == full
    write_report(run_folder, tmp_path)
    assert names_in(tmp_path) == full - {"spectrum", "places"}
    from catenary.postproc.record.recorder import Recorder

    broken = tmp_path / "broken"
    broken.mkdir()
    march = make_march()
    watcher = Recorder(march.comm, broken / "run.h5", march.header())
    march.drive(watcher, outcome="interrupted", last=30)
    watcher.close()
    write_report(broken, broken, None, SECTIONS, vector=True)
    assert names_in(broken) == full - {"spectrum"}


def test_tables_of_supports_and_droppers(run_folder: Path) -> None:
    with Results(run_folder) as results:
        arms, droppers = dynamics.places(evaluated(results)).blocks
        uplift = results.extremes("arm_uplift")[1]
        lowest, highest = results.extremes("dropper_force")
        x = results.line("dropper_x")
        slack = results.dt * np.count_nonzero(results.channel("dropper_force") <= 0.0, axis=0)
    # Supports at 250, 300 ... 550 m, and a limit of 120 mm.
    assert [row[0] for row in arms.texts()] == [f"{50 * k}.00" for k in range(5, 12)]
    for row, own in zip(arms.texts(), uplift[4:11], strict=True):
        assert float(row[1]) == pytest.approx(1e3 * own, abs=0.05)
        assert float(row[2]) == pytest.approx(120.0 - 1e3 * own, abs=0.1)
    # Of 54 droppers those with the five largest forces and the five longest slacks.
    inside = np.flatnonzero((x >= 250.0) & (x <= 550.0)).tolist()
    numbers = {f"{x[n]:.2f}": n for n in inside}
    rows = droppers.texts()
    assert f"{len(rows)} of {len(inside)} are shown" in droppers.note and len(inside) == 54
    assert [row[0] for row in rows] == sorted((row[0] for row in rows), key=float)
    for word, values in (("largest force", highest), ("longest slack", slack)):
        own = [values[numbers[row[0]]] for row in rows if word in row[5]]
        assert sorted(own) == pytest.approx(sorted(values[inside])[-5:])
    for row in rows:
        n = numbers[row[0]]
        assert float(row[2]) == pytest.approx(highest[n], abs=0.05)
        assert float(row[3]) == pytest.approx(lowest[n], abs=0.05)
        assert float(row[4]) == pytest.approx(slack[n], abs=0.6e-3)
        assert row[5]


def test_what_was_never_slack_is_not_among_the_longest(
    run_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Results(run_folder) as results:
        x = results.line("dropper_x")
        slack = np.where(np.isin(np.arange(x.size), np.flatnonzero(x > 300.0)[:2]), 0.02, 0.0)
        monkeypatch.setattr(dynamics, "slack_times", lambda _: slack)
        _, droppers = dynamics.places(evaluated(results)).blocks
    told = [float(row[4]) for row in droppers.texts() if "longest slack" in row[5]]
    assert told == [0.02, 0.02]


def test_the_limit_of_the_uplift_is_in_its_picture(run_folder: Path) -> None:
    """One that is less than twenty times the uplift of 61.6 mm, which others would shrink to."""
    with Results(run_folder) as results:
        found = statistics.evaluate(results)
        for limit, drawn in ((0.12, True), (0.05, True), (2.0, False)):
            _, axes = line_pictures.arm_uplift(results, found, limit).axes
            low, high = axes.get_ylim()
            assert low == 0.0 and (low < 1e3 * limit < high) == drawn


def test_commands_and_figures_with_units_stay_together() -> None:
    said = pages._with_commands("-7.8 N of 41.7 % <here>: `catenary report -o A` shows 12 of 18.")
    assert said == (
        "\u22127.8\u00a0N of 41.7\u00a0% &lt;here&gt;: <code>catenary report -o A</code> shows "
        "12 of 18."
    )


@figures.own_style()
def panel() -> Axes:
    _, (axes,) = figures.stacked(3.0, 1)
    axes.plot([0.0, 1.0, 2.0], [1.0, np.nan, 3.0], color="#ff0000", label="force")
    axes.bar([1.0, 2.0], [4.0, 5.0], 0.5, color="#00ff00", label="bars")
    axes.vlines([0.5], [0.0], [2.0], color="#0000ff", label="range")
    axes.axvspan(0.25, 0.75, color="#eeeeee")
    axes.axvline(1.5, color="#123456", linestyle="--")
    axes.set_xlim(0.0, 3.0)
    figures.tidy(axes, "x [m]", "y [N]", "Title <b>")
    return axes


def test_a_picture_is_translated_for_plotly() -> None:
    found = json.loads(interactive.as_json(panel().figure))
    bars, line, ranges = found["data"]
    assert (line["x"], line["y"]) == ([0.0, 1.0, 2.0], [1.0, None, 3.0])
    assert line["line"]["color"] == "#ff0000" and line["name"] == "force"
    assert (bars["x"], bars["y"], bars["width"]) == ([1.0, 2.0], [4.0, 5.0], [0.5, 0.5])
    assert ranges["x"][:2] == [0.5, 0.5] and ranges["y"][:2] == [0.0, 2.0]
    stripe, upright = found["layout"]["shapes"]
    assert (stripe["x0"], stripe["x1"], stripe["yref"]) == (0.25, 0.75, "y domain")
    assert (upright["x0"], upright["x1"], upright["line"]["dash"]) == (1.5, 1.5, "dash")
    assert found["layout"]["xaxis"]["range"] == [0.0, 3.0]
    assert found["layout"]["xaxis"]["title"]["text"] == "x [m]"


def test_legends_and_looks_are_translated() -> None:
    figure = figures.new_figure(3.0)
    upper, lower = figure.subplots(2, 1)
    for axes in (upper, lower):
        axes.axvspan(0.0, 1.0, color="#0000ff", alpha=0.25, label="run-in")
        axes.vlines([1.0, 2.0], 0.0, 1.0, label="support", transform=axes.get_xaxis_transform())
    upper.plot([1.0], [2.0], "o", color="red", mfc="none", mec="green")
    figure.legend(handles=[Line2D([], [], color="red", label="messenger wire")])
    found = json.loads(interactive.as_json(figure))
    of_all, point = found["data"]
    assert (of_all["name"], of_all["showlegend"], of_all["x"]) == ("messenger wire", True, [None])
    assert point["marker"]["symbol"] == "circle-open" and point["marker"]["color"] == "#008000"
    shapes = found["layout"]["shapes"]
    assert [shape["opacity"] for shape in shapes if shape["type"] == "rect"] == [0.25, 0.25]
    # One entry of the legend for each name, which shows and hides all shapes that have it.
    told = [(shape["name"], shape["legendgroup"]) for shape in shapes if shape["showlegend"]]
    assert told == [("run-in", "run-in"), ("support", "support")] and len(shapes) == 6


def test_a_picture_that_cannot_be_translated_stays_one() -> None:
    axes = panel()
    axes.pcolormesh(np.zeros((2, 2)))
    assert interactive.as_json(axes.figure) == ""


def test_an_svg_has_its_texts_as_texts_and_no_date() -> None:
    first, second = (figures.svg(panel().figure) for _ in range(2))
    assert first == second
    assert b">x [m]</text>" in first and b"<dc:date>" not in first


@pytest.mark.parametrize(
    ("package", "option", "words"),
    [("weasyprint", "on_paper", "--pdf needs"), ("plotly.offline", "interactive", "--interactive")],
)
def test_without_its_package_nothing_is_written(
    run_folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    package: str,
    option: str,
    words: str,
) -> None:
    monkeypatch.setitem(__import__("sys").modules, package, None)
    with pytest.raises(InputError, match=words):
        write_report(run_folder, tmp_path, **{option: True})
    assert not list(tmp_path.iterdir())


SHEET, CAPTION = pages._SHEET, pages._CAPTION


def figure(top: float, share_of_sheet: float) -> tuple[float, float]:
    return top, top + share_of_sheet * SHEET


def test_a_figure_that_just_misses_the_rest_of_a_sheet_is_printed_smaller() -> None:
    first = figure(0.0, 0.5)
    # Of a second one as high as 0.55 the picture shrinks, and the caption does not.
    expected = (0.5 * SHEET - CAPTION) / (0.55 * SHEET - CAPTION)
    assert pages.shares([first, figure(0.5 * SHEET, 0.55)], [0.0]) == pytest.approx([1.0, expected])
    assert 0.8 < expected < 1.0
    # What fits stays, and so does what would shrink by more than a fifth: it has the next sheet.
    assert pages.shares([first, figure(0.5 * SHEET, 0.49)], [0.0]) == [1.0, 1.0]
    assert pages.shares([first, figure(0.5 * SHEET, 0.7)], [0.0]) == [1.0, 1.0]


def test_a_figure_on_the_next_sheet_leaves_the_rest_of_it() -> None:
    """A third figure of 0.45 misses what a second one of 0.6 leaves, with the heading above it."""
    heading = 30.0
    at = 0.5 * SHEET + heading
    figures = [figure(0.0, 0.5), figure(at, 0.6), figure(at + 0.6 * SHEET, 0.43)]
    alone = pages.shares(figures, [0.0])
    with_heading = pages.shares(figures, [0.0, at - heading])
    assert alone[:2] == with_heading[:2] == [1.0, 1.0]
    assert alone[2] == pytest.approx((0.4 * SHEET - CAPTION) / (0.43 * SHEET - CAPTION))
    assert with_heading[2] == pytest.approx(
        (0.4 * SHEET - heading - CAPTION) / (0.43 * SHEET - CAPTION)
    )


def test_text_goes_on_to_the_next_sheet() -> None:
    """Before the figure are 2.3 sheets of text, and 0.7 of a sheet are left."""
    assert pages.shares([figure(2.3 * SHEET, 0.65)], [0.0]) == [1.0]
    assert pages.shares([figure(2.3 * SHEET, 0.75)], [0.0])[0] < 1.0
